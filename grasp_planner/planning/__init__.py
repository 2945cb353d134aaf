"""The search: starts, phase one, the scaled program, the solver, the best grasp."""
