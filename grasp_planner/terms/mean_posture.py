"""The posture is close to the mean of the synergies."""

from __future__ import annotations

import numpy as np

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..problem.problem import GraspProblem
from ..spatial import Array
from .small_cost import SmallCost


class MeanPosture(SmallCost):
    """Mean of (q − q̄)² in rad²: 0 at the mean posture of the synergies, that of human hands for a human set."""

    name, setting = "mean_posture", "mean_weight"

    def measure(self, problem: GraspProblem, state: GraspState) -> tuple[float, Array]:
        """Return the measure and its gradient."""
        joints = slice(0, problem.hand.n_joints)
        away, slope = state.x[joints] - problem.synergies.mean, np.zeros(state.x.size)
        slope[joints] = 2.0 * away / len(away)
        return float(away @ away) / len(away), slope

    def clear_measure(self, grasp: PosedGrasp) -> float:
        """Return the measure."""
        return float(np.mean((grasp.joint_angles - grasp.problem.synergies.mean) ** 2))
