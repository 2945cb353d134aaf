"""Limits under every load case: friction, normal forces, joint torques; and the budget of F."""

from __future__ import annotations

import numpy as np

from ..evaluation.load_response import LoadState
from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..problem.problem import GraspProblem
from ..problem.term import NEWTON, NEWTON_METRE, Constraint, above_zero
from ..spatial import Array


class _LoadLimit(Constraint):
    """A limit that every load case keeps."""

    geometric = False

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether the problem has load cases."""
        return problem.loads.active


class LoadFriction(_LoadLimit):
    """In every load case every contact force lies in the cone of μ/s."""

    name, unit = "load_friction", NEWTON

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the margins of all contacts in all cases."""
        return _loads(state).friction

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        return _loads(state).d_friction

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the most by which a force leaves its cone."""
        return above_zero(-grasp.load_check.friction)


class LoadMinNormal(_LoadLimit):
    """In every load case every contact presses with its least force or more."""

    name, unit = "load_min_normal", NEWTON

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return normal forces less the least one, in the worst cases."""
        return _loads(state).normal[: _least_rows(problem, state)]

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        return _loads(state).d_normal[: _least_rows(problem, state)]

    def violation(self, grasp: PosedGrasp) -> float:
        """Return by how much the least normal force is too small."""
        return above_zero(grasp.problem.loads.min_normal_force - grasp.load_check.least_normal)


class LoadMaxNormal(_LoadLimit):
    """In no load case does a contact press with more than its largest force."""

    name, unit = "load_max_normal", NEWTON

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return what is left to the largest normal force in the worst cases; nothing without a limit."""
        return _loads(state).normal[_least_rows(problem, state) :]

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        return _loads(state).d_normal[_least_rows(problem, state) :]

    def violation(self, grasp: PosedGrasp) -> float:
        """Return by how much the largest normal force is too large."""
        return above_zero(grasp.load_check.largest_normal - grasp.problem.max_normal_force)


class LoadTorque(_LoadLimit):
    """In every load case every joint torque is within its limit."""

    name, unit = "load_torque", NEWTON_METRE

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return what is left to the limits in the worst cases."""
        return _loads(state).torque

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        return _loads(state).d_torque

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the most by which a torque exceeds its limit."""
        return above_zero(grasp.load_check.torque)


class ForceBudget(Constraint):
    """F stays within its budget."""

    name, unit, geometric = "load_force_norm", NEWTON, False

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether there is a budget."""
        return problem.loads.active and problem.loads.max_force_norm is not None

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return what is left of the budget."""
        assert problem.loads.max_force_norm is not None
        return np.array([problem.loads.max_force_norm - state.force_norm])

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        return -state.d_force_norm[None]

    def violation(self, grasp: PosedGrasp) -> float:
        """Return by how much F exceeds it."""
        assert grasp.problem.loads.max_force_norm is not None
        return above_zero(grasp.force_norm - grasp.problem.loads.max_force_norm)


def _loads(state: GraspState) -> LoadState:
    """Return the state of the load cases."""
    assert state.loads is not None
    return state.loads


def _least_rows(problem: GraspProblem, state: GraspState) -> int:
    """Return how many rows of the normal forces are about the least ones: half of them where there is a largest one."""
    rows = len(_loads(state).normal)
    return rows // 2 if np.isfinite(problem.max_normal_force) else rows
