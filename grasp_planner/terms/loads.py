"""The constraints of the load cases: friction, normal forces and joint torques under every disturbance."""

from __future__ import annotations

import numpy as np

from ..evaluation.state import GraspState
from ..problem.problem import GraspProblem
from ..spatial import Array
from .base import Constraint


class LoadFriction(Constraint):
    """In every load case every contact force lies in the cone of μ/s."""

    name, unit, equality, scale = "load_friction", "N", False, 1.0
    geometric = False

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the margins of all contacts in all cases."""
        assert state.loads is not None
        return state.loads.friction

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        assert state.loads is not None
        return state.loads.d_friction


class LoadNormalForce(Constraint):
    """In every load case every normal force is between its limits."""

    name, unit, equality, scale = "load_normal_force", "N", False, 1.0
    geometric = False

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return what is left to the limits in the worst cases."""
        assert state.loads is not None
        return state.loads.normal

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        assert state.loads is not None
        return state.loads.d_normal


class LoadTorque(Constraint):
    """In every load case every joint torque is within its limit."""

    name, unit, equality, scale = "load_torque", "N m", False, 10.0
    geometric = False

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return what is left to the limits in the worst cases."""
        assert state.loads is not None
        return state.loads.torque

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        assert state.loads is not None
        return state.loads.d_torque


class ForceBudget(Constraint):
    """F stays within its budget."""

    name, unit, equality, scale = "force_norm", "N", False, 1.0
    geometric = False

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return what is left of the budget."""
        assert problem.loads.max_force_norm is not None
        return np.array([problem.loads.max_force_norm - state.force_norm])

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        return -state.d_force_norm[None]


def load_constraints(problem: GraspProblem) -> tuple[Constraint, ...]:
    """Return the constraints of a problem's load cases."""
    if not problem.loads.active:
        return ()
    budget = () if problem.loads.max_force_norm is None else (ForceBudget(),)
    return (LoadFriction(), LoadNormalForce(), LoadTorque(), *budget)
