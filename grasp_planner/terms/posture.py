"""The posture is one that synergies, springs and joints allow."""

from __future__ import annotations

import numpy as np

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..model.compliance import bent
from ..problem.problem import GraspProblem
from ..problem.term import RADIAN, Constraint, Requirement, above_zero
from ..spatial import Array
from .padding import padded


class SoftSynergy(Constraint):
    """The posture is one the synergies and the joint compliance give together; eq. (4), (10)."""

    name, unit, equality, geometric = "compliance", RADIAN, True, False

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return S_⊥ᵀ (q − q̄ + C_q τ)."""
        return state.compliance

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        return state.d_compliance

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the largest angle of q − (q̄ + S σ) + C_q τ with the σ that fits best."""
        yielded = bent(grasp.problem.joint_compliance, grasp.bending_torques)
        return float(np.abs(grasp.joint_angles - grasp.reference_joint_angles + yielded).max())


class JointLimits(Requirement):
    """Joint angles are within their limits; eq. (31). The search holds them as bounds of its variables."""

    name, unit = "joint_limit", RADIAN

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the most by which a joint is beyond a limit."""
        hand, q = grasp.problem.hand, grasp.joint_angles
        return float(np.maximum(hand.lower - q, q - hand.upper).max(initial=0.0))


class AbductionOrder(Constraint):
    """The abduction angles of the fingers keep their physical order: Remark 1."""

    name, unit = "abduction_order", RADIAN

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether the problem asks for it and the hand has an order."""
        return problem.clearance.remark1 and problem.hand.description.remark1 is not None

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return the differences of neighbours."""
        return problem.abduction_differences @ state.x[: problem.hand.n_joints]

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return their derivatives, which are constant."""
        return padded(problem.abduction_differences, state.x.size)

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the most by which two neighbours are out of order."""
        return above_zero(-(grasp.problem.abduction_differences @ grasp.joint_angles).min(initial=0.0))
