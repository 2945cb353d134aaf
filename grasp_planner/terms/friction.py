"""Contact forces stay in their friction cones."""

from __future__ import annotations

import numpy as np

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..model.friction import friction_margins
from ..problem.cone_reserve import cone_reserve
from ..problem.problem import GraspProblem
from ..problem.term import NEWTON, Constraint, above_zero
from ..spatial import Array


class FrictionCone(Constraint):
    """Every contact force lies in its friction cone; eq. (30)."""

    name, unit, geometric = "friction", NEWTON, False

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the smooth margins, on meshes less what a normal of the triangles may take away."""
        return state.friction_margins - cone_reserve(problem) * state.normal_forces

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        return state.d_friction_margins - cone_reserve(problem)[:, None] * state.d_normal_forces

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the most by which a force leaves its cone, on the true surface too where geometry counts."""
        least = grasp.friction_margins.min()
        if grasp.problem.clearance.link_object == "geometry":
            normals, friction = grasp.surface_contacts.normals, grasp.problem.friction
            least = np.minimum(least, friction_margins(grasp.forces, normals, friction).min())
        return above_zero(-least)
