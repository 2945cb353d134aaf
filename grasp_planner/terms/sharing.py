"""Fingers share the force."""

from __future__ import annotations

import numpy as np

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..problem.problem import GraspProblem
from ..spatial import Array
from .small_cost import SmallCost

NO_FORCE = 1e-3
"""Sum of normal forces that smooths the measure at starts without force [N]."""


class ForceSharing(SmallCost):
    """n Σ f_n² / (Σ f_n)² − 1: 0 where all fingers press alike, n − 1 where one takes everything."""

    name, setting = "force_sharing", "sharing_weight"

    def measure(self, problem: GraspProblem, state: GraspState) -> tuple[float, Array]:
        """Return the measure and its gradient."""
        normal, slopes = state.normal_forces, state.d_normal_forces
        total = float(normal.sum())
        squared, size = float(normal @ normal), total**2 + NO_FORCE**2
        slope = normal @ slopes / size - (squared * total / size**2) * slopes.sum(axis=0)
        return len(normal) * squared / size - 1.0, 2.0 * len(normal) * slope

    def clear_measure(self, grasp: PosedGrasp) -> float:
        """Return the measure from the shares."""
        total = float(grasp.normal_forces.sum())
        shares = grasp.normal_forces / np.hypot(total, NO_FORCE)
        return float(len(shares) * (shares**2).sum() - 1.0)
