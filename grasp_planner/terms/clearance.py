"""The constraints that keep bodies apart and fingers in order, and the list of those that a problem asks for."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from ..collision.link_shapes import inner_axes, link_shapes
from ..evaluation.clearance import ClearanceState
from ..evaluation.state import GraspState
from ..problem.problem import GraspProblem
from ..spatial import Array
from .base import MODEL_CONSTRAINTS, Constraint
from .loads import load_constraints


class _Selected(Constraint):
    """A part of the clearance state."""

    @abstractmethod
    def _select(self, clearance: ClearanceState) -> tuple[Array, Array]:
        """Return values and their derivatives by (q, w)."""

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the values."""
        assert state.clearance is not None
        return self._select(state.clearance)[0]

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        assert state.clearance is not None
        return _padded(self._select(state.clearance)[1], state.x.size)


class _Clearance(_Selected):
    """Clearances that keep the margin of the problem."""

    unit, equality, scale = "m", False, 100.0

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return clearances less the margin."""
        return super().residual(problem, state) - problem.clearance.margin


class LinkObjectClearance(_Clearance):
    """No link penetrates the object: Remark 2, by real geometry or by joint centres."""

    name = "link_object"

    def _select(self, clearance: ClearanceState) -> tuple[Array, Array]:
        return clearance.link_object, clearance.d_link_object


class SelfClearance(_Clearance):
    """Fingers keep clear of each other and of the palm."""

    name = "self_collision"

    def _select(self, clearance: ClearanceState) -> tuple[Array, Array]:
        return clearance.self_collision, clearance.d_self_collision


class GroundClearance(_Clearance):
    """No link enters the ground."""

    name = "ground"

    def _select(self, clearance: ClearanceState) -> tuple[Array, Array]:
        return clearance.ground, clearance.d_ground


class TipPatch(_Selected):
    """Fingers touch with the ends of their tips only: n·a ≥ 0."""

    name, unit, equality, scale = "tip_patch", "1", False, 1.0

    def _select(self, clearance: ClearanceState) -> tuple[Array, Array]:
        return clearance.tip_patch, clearance.d_tip_patch


class Tangency(_Selected):
    """Inner links touch with their sides: n·a = 0, which keeps their capsules outside a convex object."""

    name, unit, equality, scale = "tangency", "1", True, 1.0

    def _select(self, clearance: ClearanceState) -> tuple[Array, Array]:
        return clearance.tangency, clearance.d_tangency


class AbductionOrder(Constraint):
    """The abduction angles of the fingers keep their physical order: Remark 1."""

    name, unit, equality, scale = "abduction_order", "rad", False, 10.0

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the differences of neighbours."""
        return problem.abduction_differences @ state.x[: problem.hand.n_joints]

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives, which are constant."""
        return _padded(problem.abduction_differences, state.x.size)


def problem_constraints(problem: GraspProblem) -> tuple[Constraint, ...]:
    """Return the constraints of a problem: those of the model, those its clearance options ask for, its load cases."""
    options = problem.clearance
    wanted: tuple[tuple[bool, Constraint], ...] = (
        (options.link_object != "off", LinkObjectClearance()),
        (options.self_collision, SelfClearance()),
        (options.ground is not None, GroundClearance()),
        (options.tip_patch, TipPatch()),
        (options.link_object == "geometry" and _touches_with_sides(problem), Tangency()),
        (options.remark1 and problem.hand.description.remark1 is not None, AbductionOrder()),
    )
    return (*MODEL_CONSTRAINTS, *(term for on, term in wanted if on), *load_constraints(problem))


def _touches_with_sides(problem: GraspProblem) -> bool:
    """Return whether an inner link touches the object."""
    return bool(inner_axes(problem.hand, link_shapes(problem.hand), problem.frames))


def _padded(derivative: Array, size: int) -> Array:
    """Append zero columns for variables that move nothing."""
    padded = np.zeros((len(derivative), size))
    padded[:, : derivative.shape[1]] = derivative
    return padded
