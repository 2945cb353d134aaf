"""What a grasp is worth by the clear formulas: clearances, load cases, margins, stability."""
