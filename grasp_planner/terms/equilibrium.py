"""The object is in equilibrium: a constraint where forces come from springs, by construction by eq. (17)."""

from __future__ import annotations

import numpy as np

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..problem.problem import GraspProblem
from ..problem.term import NEWTON, NEWTON_METRE, Constraint
from ..spatial import Array


class ForceBalance(Constraint):
    """Contact forces balance the weight."""

    name, unit, equality, geometric = "equilibrium_force", NEWTON, True, False

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the force that is left; nothing by eq. (17)."""
        return state.balance[:3]

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        return state.d_balance[:3]

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the largest component of the force that is left."""
        return float(np.abs(_imbalance(grasp)[:3]).max())


class MomentBalance(Constraint):
    """Moments of the contact forces balance about the centre of mass."""

    name, unit, equality, geometric = "equilibrium_moment", NEWTON_METRE, True, False

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the moment that is left; nothing by eq. (17)."""
        return state.balance[3:]

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        return state.d_balance[3:]

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the largest component of the moment that is left."""
        return float(np.abs(_imbalance(grasp)[3:]).max())


def _imbalance(grasp: PosedGrasp) -> Array:
    """Return G f + w_ext [N, N m], of shape (6,)."""
    return grasp.grasp_matrix @ grasp.intensities.ravel() + grasp.problem.external_wrench
