"""Nonlinear programs and their solution: sequential quadratic programming, Newton steps, KKT points. No robotics."""
