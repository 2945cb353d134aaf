"""Many starts at once: the springs problem for a whole batch of states, and what brings them to feasibility."""
