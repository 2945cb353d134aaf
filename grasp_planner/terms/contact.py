"""Fingertips touch the object, on the part of it that may be touched."""

from __future__ import annotations

import numpy as np

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..judge.surface_check import OFF_SURFACE
from ..problem.problem import GraspProblem
from ..problem.term import METRE, Constraint, above_zero
from ..spatial import Array


class SurfaceContact(Constraint):
    """Every contact frame touches the object: gaps are zero; eq. (32)."""

    name, unit, equality = "surface", METRE, True

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the gaps."""
        return state.geometry.gaps

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        return state.d_gaps

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the largest gap or overlap of a fingertip, on a mesh's triangles beyond what its pad takes up."""
        off = np.abs(grasp.surface_contacts.gaps).max() - OFF_SURFACE
        return float(np.maximum(np.abs(grasp.contacts.gaps).max(), off))


class ContactRegion(Constraint):
    """Contacts stay on the part of the surface that may be touched."""

    name, unit = "region", METRE

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the margins of the object's region at the contact points."""
        return problem.grasp_object.region(state.geometry.points)[0].ravel()

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        gradient = problem.grasp_object.region(state.geometry.points)[1]
        rows = gradient.shape[0] * gradient.shape[1]
        jacobian = np.zeros((rows, state.x.size))
        d_points = state.geometry.d_points
        jacobian[:, : d_points.shape[2]] = (gradient @ d_points).reshape(rows, d_points.shape[2])
        return jacobian

    def violation(self, grasp: PosedGrasp) -> float:
        """Return how far the farthest contact is outside the region."""
        margins, _ = grasp.problem.grasp_object.region(grasp.contacts.points)
        return above_zero(-margins.min(initial=0.0))
