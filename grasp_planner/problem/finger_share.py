"""The least share of the force that a search without weights leaves to every finger."""

from __future__ import annotations

import numpy as np

from ..spatial import Array
from .problem import GraspProblem

MOST_OF_EQUAL = 0.5
"""Largest part of an equal share that is asked of a finger, however many there are."""


def wants_shares(problem: GraspProblem) -> bool:
    """Return whether a problem has a share to hold."""
    return not problem.parameters.weighted and problem.parameters.least_share > 0.0


def shares_removed(problem: GraspProblem) -> Array:
    """Return 1 − s 1ᵀ of shape (n_c, n_c): times normal forces, what they have more than the share s of their sum."""
    count = len(problem.frames)
    return np.eye(count) - min(problem.parameters.least_share, MOST_OF_EQUAL / count)
