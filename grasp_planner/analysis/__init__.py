"""What follows from a grasp: why not, improving, tolerances, post-optimality."""
