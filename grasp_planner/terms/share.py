"""No finger idles: each takes a least share of the force."""

from __future__ import annotations

import numpy as np

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..problem.problem import GraspProblem
from ..problem.term import NEWTON, Constraint, above_zero
from ..spatial import Array

MOST_OF_EQUAL = 0.5
"""Largest part of an equal share that is asked of a finger, however many there are."""


class FingerShare(Constraint):
    """Every normal force is at least a share s of the sum of all: f_n,i ≥ s Σ f_n.

    It serves the search without weights only: a finger that idles is a poor grasp, no wrong one.
    """

    name, unit, geometric, judged = "finger_share", NEWTON, False, False

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether there is a share to hold."""
        return not problem.parameters.weighted and problem.parameters.least_share > 0.0

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return f_n,i − s Σ f_n."""
        return _shares_removed(problem) @ state.normal_forces

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        return _shares_removed(problem) @ state.d_normal_forces

    def violation(self, grasp: PosedGrasp) -> float:
        """Return by how much the least normal force misses its share."""
        return above_zero(-(_shares_removed(grasp.problem) @ grasp.normal_forces).min())


def _shares_removed(problem: GraspProblem) -> Array:
    """Return 1 − s 1ᵀ, of shape (n_c, n_c)."""
    count = len(problem.frames)
    return np.eye(count) - min(problem.parameters.least_share, MOST_OF_EQUAL / count)
