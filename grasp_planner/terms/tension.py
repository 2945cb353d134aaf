"""Tendons only pull, and motors have a largest force: the tensions of a hand that is driven by force."""

from __future__ import annotations

import numpy as np

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..problem.problem import GraspProblem
from ..problem.tendon_drive import driving_tendons, tension_map
from ..problem.term import NEWTON, Constraint, above_zero
from ..spatial import Array


class Tension(Constraint):
    """Every tension is within its limits: not negative where a tendon only pulls, not above the motor's force."""

    name, unit, geometric = "tension", NEWTON, False

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether σ stands for forces of motors that have limits."""
        tendons = driving_tendons(problem)
        return tendons is not None and bool(np.isfinite([tendons.least, tendons.largest]).any())

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return tensions less their least, then their largest less them; those without a limit are left out."""
        tendons = driving_tendons(problem)
        assert tendons is not None
        tensions = tension_map(problem, tendons) @ (state.reference - problem.synergies.mean)
        low, high = np.isfinite(tendons.least), np.isfinite(tendons.largest)
        return np.concatenate([(tensions - tendons.least)[low], (tendons.largest - tensions)[high]])

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives."""
        tendons = driving_tendons(problem)
        assert tendons is not None
        slope = tension_map(problem, tendons) @ state.d_reference
        return np.vstack([slope[np.isfinite(tendons.least)], -slope[np.isfinite(tendons.largest)]])

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the most by which a tension is beyond a limit, the tensions from σ."""
        tendons = driving_tendons(grasp.problem)
        assert tendons is not None
        tensions = grasp.sigma / tendons.scales(grasp.problem.joint_compliance)
        return above_zero(np.maximum(tendons.least - tensions, tensions - tendons.largest).max())
