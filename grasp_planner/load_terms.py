"""The constraints of the load cases: friction, normal forces and joint torques under every disturbance."""

from __future__ import annotations

from .problem import GraspProblem
from .spatial import Array
from .state import GraspState
from .terms import Constraint


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


def load_constraints(problem: GraspProblem) -> tuple[Constraint, ...]:
    """Return the constraints of a problem's load cases."""
    return (LoadFriction(), LoadNormalForce(), LoadTorque()) if problem.loads.active else ()
