"""Contact forces stay in their friction cones."""

from __future__ import annotations

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..problem.problem import GraspProblem
from ..problem.term import NEWTON, Constraint, above_zero
from ..spatial import Array


class FrictionCone(Constraint):
    """Every contact force lies in its friction cone; eq. (30)."""

    name, unit, geometric = "friction", NEWTON, False

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the smooth margins."""
        return state.friction_margins

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        return state.d_friction_margins

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the most by which a force leaves its cone."""
        return above_zero(-grasp.friction_margins.min())
