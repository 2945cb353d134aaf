"""No finger idles: each takes a least share of the force."""

from __future__ import annotations

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..problem.finger_share import shares_removed, wants_shares
from ..problem.problem import GraspProblem
from ..problem.term import NEWTON, Constraint, above_zero
from ..spatial import Array


class FingerShare(Constraint):
    """Every normal force is at least a share s of the sum of all: f_n,i ≥ s Σ f_n.

    It serves the search without weights only: a finger that idles is a poor grasp, no wrong one.
    """

    name, unit, geometric, judged = "finger_share", NEWTON, False, False

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether there is a share to hold."""
        return wants_shares(problem)

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return f_n,i − s Σ f_n."""
        return shares_removed(problem) @ state.normal_forces

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        return shares_removed(problem) @ state.d_normal_forces

    def violation(self, grasp: PosedGrasp) -> float:
        """Return by how much the least normal force misses its share."""
        return above_zero(-(shares_removed(grasp.problem) @ grasp.normal_forces).min())
