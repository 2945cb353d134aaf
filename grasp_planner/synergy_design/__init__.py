"""Synergy sets made for a hand from grasps it planned, and what a set closes around."""
