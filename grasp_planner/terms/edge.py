"""Fingertips keep away from edges: the object's normals differ little under their footprints."""

from __future__ import annotations

import numpy as np

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..judge.surface_check import FOOTPRINT, SPREAD
from ..problem.problem import GraspProblem
from ..problem.term import RADIAN, Constraint, above_zero
from ..spatial import Array
from .padding import padded

REACH = 2e-3
"""How far around a contact the search compares normals [m]: the footprint and the width over which the smooth distance
rounds an edge."""
LIMIT = float(np.radians(35.0))
"""Widest angle that the search allows there; on an edge of 90° the smooth normal is 45° from both sides [rad]."""
_SIDES = np.vstack([np.eye(3), -np.eye(3)])


class EdgeDistance(Constraint):
    """No contact on an edge or a rim of a mesh: the normals within a footprint spread by 40° at most.

    The search compares the normal at a contact with that at six points in its tangent plane; the residual is the
    difference of the cosines over sin of the limit, the angle left [rad] to first order at the limit.
    """

    name, unit = "edge", RADIAN

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether the object has edges of its own, and real geometry counts."""
        return problem.grasp_object.distance_error > 0.0 and problem.clearance.link_object == "geometry"

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the angles left, six a contact."""
        slope = problem.grasp_object.gradients(self._around(state))
        cosine = -(state.geometry.normals[:, None] * slope).sum(axis=-1) / np.linalg.norm(slope, axis=-1)
        return np.asarray((cosine - np.cos(LIMIT)) / np.sin(LIMIT)).ravel()

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        geometry, found = state.geometry, problem.grasp_object.field(self._around(state))
        normals, d_normals = geometry.normals, geometry.d_normals
        # u = a (e − n nᵀe): its derivative, and that of the point c + u.
        along = normals @ _SIDES.T
        d_along = np.einsum("kj,cjg->ckg", _SIDES, d_normals)
        d_offset = along[..., None, None] * d_normals[:, None] + normals[:, None, :, None] * d_along[:, :, None]
        d_point = geometry.d_points[:, None] - REACH * d_offset
        length = np.linalg.norm(found.gradient, axis=-1)[..., None]
        outward = found.gradient / length
        cosine = -(normals[:, None] * outward).sum(axis=-1)[..., None]
        covector = -(normals[:, None] + cosine * outward) / length
        rows = np.einsum("cki,ckij,ckjg->ckg", covector, found.hessian, d_point)
        rows -= np.einsum("cki,cig->ckg", outward, d_normals)
        return padded(rows.reshape(-1, rows.shape[-1]) / np.sin(LIMIT), state.x.size)

    def violation(self, grasp: PosedGrasp) -> float:
        """Return by how much the normals of the exact surface spread too widely under a footprint."""
        spread = grasp.problem.grasp_object.normal_spread(grasp.surface_contacts.points, FOOTPRINT)
        return above_zero(spread.max() - SPREAD)

    def _around(self, state: GraspState) -> Array:
        """Return the points in the tangent planes, of shape (n_c, 6, 3)."""
        normals = state.geometry.normals
        tangent = _SIDES - (normals @ _SIDES.T)[..., None] * normals[:, None]
        return state.geometry.points[:, None] + REACH * tangent
