"""Fingertips keep away from edges: the object's normals differ little under their footprints."""

from __future__ import annotations

import numpy as np

from ..evaluation.edge_reserve import edge_reserve, edge_reserve_and_slope, edges_count
from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..judge.surface_check import FOOTPRINT, SPREAD
from ..problem.problem import GraspProblem
from ..problem.term import RADIAN, Constraint, above_zero
from ..spatial import Array
from .padding import padded


class EdgeDistance(Constraint):
    """No contact on a sharp edge or a rim: the normals within a footprint spread by 40° at most.

    The search compares the normals on both sides of a contact, along three directions of its tangent plane.
    """

    name, unit = "edge", RADIAN

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether the object has sharp edges, and real geometry counts."""
        return edges_count(problem)

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the angles left, three a contact."""
        return edge_reserve(problem.grasp_object, state.geometry.points, state.geometry.normals).ravel()

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        geometry = state.geometry
        slopes = (np.swapaxes(slope, -1, -2) for slope in (geometry.d_points, geometry.d_normals))
        _, rows = edge_reserve_and_slope(problem.grasp_object, geometry.points, geometry.normals, *slopes)
        return padded(rows.reshape(-1, rows.shape[-1]), state.x.size)

    def violation(self, grasp: PosedGrasp) -> float:
        """Return by how much the normals of the exact surface spread too widely under a footprint."""
        spread = grasp.problem.grasp_object.normal_spread(grasp.surface_contacts.points, FOOTPRINT)
        return above_zero(spread.max() - SPREAD)
