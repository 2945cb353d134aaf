"""The object is in equilibrium. The search needs no constraint for it: its forces balance by construction, eq. (17)."""

from __future__ import annotations

import numpy as np

from ..judge.posed_grasp import PosedGrasp
from ..problem.term import NEWTON, NEWTON_METRE, Requirement
from ..spatial import Array


class ForceBalance(Requirement):
    """Contact forces balance the weight."""

    name, unit = "equilibrium_force", NEWTON

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the largest component of the force that is left."""
        return float(np.abs(_imbalance(grasp)[:3]).max())


class MomentBalance(Requirement):
    """Moments of the contact forces balance about the centre of mass."""

    name, unit = "equilibrium_moment", NEWTON_METRE

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the largest component of the moment that is left."""
        return float(np.abs(_imbalance(grasp)[3:]).max())


def _imbalance(grasp: PosedGrasp) -> Array:
    """Return G f + w_ext [N, N m], of shape (6,)."""
    return grasp.grasp_matrix @ grasp.intensities.ravel() + grasp.problem.external_wrench
