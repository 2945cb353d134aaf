"""What a hand is: URDF and description, read strictly; coupling, contact frames, kinematics."""
