"""Measurements: random problems, benchmark, the paper's tables, physics against the number of synergies."""
