"""Bodies keep apart, and fingers touch with the right part of their links."""

from __future__ import annotations

from abc import abstractmethod

from ..collision.link_shapes import inner_axes, link_shapes
from ..evaluation.clearance import ClearanceState
from ..evaluation.state import GraspState
from ..judge.clearance_check import (
    contact_off_link,
    joint_centre_depth,
    penetration,
    side_tilt,
    tip_overhang,
    touching_solids,
)
from ..judge.posed_grasp import PosedGrasp
from ..problem.problem import GraspProblem
from ..problem.term import METRE, ONE, Constraint, Requirement
from ..spatial import Array
from .padding import padded


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
        return padded(self._select(state.clearance)[1], state.x.size)


class _Clearance(_Selected):
    """Clearances: the search keeps the margin of the problem, the judge counts overlap."""

    unit = METRE

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return clearances less the margin."""
        return super().residual(problem, state) - problem.clearance.margin


class LinkObjectClearance(_Clearance):
    """No link penetrates the object: Remark 2 by real geometry."""

    name = "link_object"

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether the problem asks for it."""
        return problem.clearance.link_object == "geometry"

    def _select(self, clearance: ClearanceState) -> tuple[Array, Array]:
        return clearance.link_object, clearance.d_link_object

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the deepest overlap, beyond what the error of a mesh's distance excuses."""
        return penetration(grasp.near_clearances, "link_object", tolerant=True)


class JointCentreClearance(_Clearance):
    """No joint centre lies inside the object: Remark 2 in the paper's own form."""

    name = "joint_centre"

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether the problem asks for it."""
        return problem.clearance.link_object == "joint_centres"

    def _select(self, clearance: ClearanceState) -> tuple[Array, Array]:
        return clearance.link_object, clearance.d_link_object

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the depth of the deepest one."""
        return joint_centre_depth(grasp.problem, grasp.configuration)


class SelfClearance(_Clearance):
    """Fingers keep clear of each other and of the palm."""

    name = "self_collision"

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether the problem asks for it."""
        return problem.clearance.self_collision

    def _select(self, clearance: ClearanceState) -> tuple[Array, Array]:
        return clearance.self_collision, clearance.d_self_collision

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the deepest overlap."""
        return penetration(grasp.near_clearances, "self_collision")


class GroundClearance(_Clearance):
    """No link enters the ground."""

    name = "ground"

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether there is a ground."""
        return problem.clearance.ground is not None

    def _select(self, clearance: ClearanceState) -> tuple[Array, Array]:
        return clearance.ground, clearance.d_ground

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the deepest overlap."""
        return penetration(grasp.near_clearances, "ground")


class TipPatch(_Selected):
    """Fingers touch with the ends of their tips only: n·a ≥ 0."""

    name, unit = "tip_patch", ONE

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether the problem asks for it."""
        return problem.clearance.tip_patch

    def _select(self, clearance: ClearanceState) -> tuple[Array, Array]:
        return clearance.tip_patch, clearance.d_tip_patch

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the largest −n·a."""
        return tip_overhang(grasp.problem, grasp.configuration, grasp.contacts.normals)


class ContactOffLink(Requirement):
    """Contacts lie on the surface of their links, not in the air in front of them."""

    name, unit = "contact_off_link", METRE

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether links keep clear by their geometry and one that touches with a radius has one."""
        if problem.clearance.link_object != "geometry":
            return False
        return any(touching_solids(problem.hand, frame) for frame in problem.frames)

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the largest distance off a link, beyond the skin."""
        return contact_off_link(grasp.problem, grasp.configuration, grasp.contacts.normals)


class Tangency(_Selected):
    """Inner links touch with their sides: n·a = 0, which keeps their capsules outside a convex object.

    It serves ``link_object`` only, by whose overlap a grasp is judged.
    """

    name, unit, equality, judged = "tangency", ONE, True, False

    def wanted(self, problem: GraspProblem) -> bool:
        """Return whether links keep clear and an inner one touches the object."""
        if problem.clearance.link_object != "geometry":
            return False
        return bool(inner_axes(problem.hand, link_shapes(problem.hand), problem.frames))

    def _select(self, clearance: ClearanceState) -> tuple[Array, Array]:
        return clearance.tangency, clearance.d_tangency

    def violation(self, grasp: PosedGrasp) -> float:
        """Return the largest |n·a|."""
        return side_tilt(grasp.problem, grasp.configuration, grasp.contacts.normals)
