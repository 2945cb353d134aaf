"""The terms of the planning problem: costs and constraints, each reading one evaluated state.

To add one, write a class with two methods and list it in :data:`MODEL_CONSTRAINTS` or :data:`COSTS`; those that can
be switched off are in :mod:`grasp_planner.terms.clearance`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from ..evaluation.state import GraspState
from ..problem.problem import GraspProblem
from ..spatial import Array


class Constraint(ABC):
    """A constraint ``residual = 0`` (equality) or ``residual ≥ 0`` on a state.

    Attributes:
        name: Name in histories and reports.
        unit: Unit of the residual.
        equality: Whether it is an equality.
        scale: Factor that brings residuals to order one for the solver.
        geometric: Whether it depends on posture and palm pose only, not on forces.
    """

    name: ClassVar[str]
    unit: ClassVar[str]
    equality: ClassVar[bool]
    scale: ClassVar[float]
    geometric: ClassVar[bool] = True

    @abstractmethod
    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the residuals, of shape (m,)."""

    @abstractmethod
    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return ∂residual/∂x, of shape (m, n_x)."""

    def violation(self, problem: GraspProblem, state: GraspState) -> float:
        """Return the largest violation, in the constraint's unit; 0 if none."""
        residual = self.residual(problem, state)
        if residual.size == 0:
            return 0.0
        return float(np.abs(residual).max() if self.equality else max(0.0, -residual.min()))


class SurfaceContact(Constraint):
    """Every contact frame touches the object: gaps are zero; eq. (32)."""

    name, unit, equality, scale = "surface", "m", True, 100.0

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the gaps."""
        return state.geometry.gaps

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        return state.d_gaps


class SoftSynergy(Constraint):
    """The posture is one the synergies and the joint compliance give together; eq. (4), (10)."""

    name, unit, equality, scale = "compliance", "rad", True, 10.0
    geometric = False

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return S_⊥ᵀ (q − q̄ + C_q τ)."""
        return state.compliance

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        return state.d_compliance


class FrictionCone(Constraint):
    """Every contact force lies in its friction cone; eq. (30)."""

    name, unit, equality, scale = "friction", "N", False, 1.0
    geometric = False

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the smooth margins."""
        return state.friction_margins

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        return state.d_friction_margins


class ContactRegion(Constraint):
    """Contacts stay on the part of the surface that may be touched."""

    name, unit, equality, scale = "region", "m", False, 100.0

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


class Cost(ABC):
    """A scalar to be made small.

    Attributes:
        name: Name in histories and reports.
    """

    name: ClassVar[str]

    @abstractmethod
    def value(self, state: GraspState) -> float:
        """Return the value."""

    @abstractmethod
    def gradient(self, state: GraspState) -> Array:
        """Return the gradient by x, of shape (n_x,)."""


class ForceNorm(Cost):
    """F, the size of the normal forces [N]; eq. (18)."""

    name = "force_norm"

    def value(self, state: GraspState) -> float:
        """Return F."""
        return state.force_norm

    def gradient(self, state: GraspState) -> Array:
        """Return ∂F/∂x."""
        return state.d_force_norm


class TaskIndex(Cost):
    """C, how badly the task is transmitted; eq. (28)."""

    name = "task_index"

    def value(self, state: GraspState) -> float:
        """Return C."""
        return state.task_index

    def gradient(self, state: GraspState) -> Array:
        """Return ∂C/∂x."""
        return state.d_task_index


MODEL_CONSTRAINTS: tuple[Constraint, ...] = (SurfaceContact(), SoftSynergy(), FrictionCone(), ContactRegion())
"""The constraints every planning problem has."""

COSTS: tuple[Cost, ...] = (ForceNorm(), TaskIndex())
"""Every cost of the planning problem."""
