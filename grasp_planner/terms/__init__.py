"""Costs and constraints."""
