"""Tests of objects, and of what they are grasped with."""
