"""Contacts that are to be measured: of a planned grasp, or from elsewhere, with what is known of the hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..grasp.grasp import Grasp
from ..judge.stability import joint_preload
from ..model.compliance import joint_stiffness
from ..model.contact_model import ContactModel
from ..model.force_closure import HARD
from ..model.mixed_contacts import MixedContacts
from ..model.quasi_static import CompliantGrasp, Preload, compliant_grasp
from ..spatial import Array
from ..values import Value
from .wrench_space import Bound, WrenchSpace


@dataclass(frozen=True, eq=False, repr=False)
class JointRange(Value):
    """Where the joints are within their range.

    Attributes:
        q: Joint angles [rad], of shape (n_q,).
        lower: Lower limits.
        upper: Upper limits.
        mean: The posture without any command, q̄.
    """

    q: Array
    lower: Array
    upper: Array
    mean: Array


@dataclass(frozen=True, eq=False, repr=False)
class ContactSet(Value):
    """Contacts from anywhere, and what moves them where that is known.

    Attributes:
        points: c_i [m], of shape (n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).
        friction: μ of each contact, of shape (n_c,).
        centre: The object's centre of mass [m], of shape (3,); wrenches are about it.
        forces: f_i on the object [N], of shape (n_c, 3); intensities λ_i, of shape (n_c, d), for another model.
        wrench: w_ext on the object [N, N m], of shape (6,).
        springs: Hand and stiffnesses.
        model: What the contacts transmit, also of several models in one grasp.
        joints: Posture of the hand.
        tasks: Wrenches that the hand is to exert on the object [N, N m], of shape (k, 6).
    """

    points: Array
    normals: Array
    friction: Array
    centre: Array
    forces: Array | None = None
    wrench: Array | None = None
    springs: CompliantGrasp | None = None
    model: ContactModel = HARD
    joints: JointRange | None = None
    tasks: Array | None = None

    @property
    def frictional(self) -> npt.NDArray[np.bool_]:
        """Which contacts have friction, of shape (n_c,)."""
        if isinstance(self.model, MixedContacts):
            return self.model.frictional
        return np.full(len(self.points), self.model.has_friction)

    @property
    def least_friction(self) -> float:
        """μ of the slipperiest contact that has friction; of any where none has."""
        counted = self.frictional
        return float(self.friction[counted if counted.any() else ...].min())

    @property
    def contact_springs(self) -> CompliantGrasp | None:
        """The springs with as many intensities a contact as the covectors have, of which some may do nothing."""
        if self.springs is not None and isinstance(self.model, MixedContacts):
            return self.model.padded(self.springs)
        return self.springs

    @property
    def grasp_matrix(self) -> Array:
        """G about the centre, of shape (6, d n_c)."""
        return self.model.grasp_matrix(self.points - self.centre, self.normals)

    @property
    def covectors(self) -> Array:
        """ν of every contact, for hard fingers the normals, of shape (n_c, d)."""
        return self.model.covectors(self.normals)

    def wrench_space(self, bound: Bound = "L1") -> WrenchSpace:
        """Return the wrenches that the contacts can exert, moments divided by L."""
        known = (self.grasp_matrix, self.normals, self.friction)
        return WrenchSpace.of(*known, bound=bound, length=self.length, model=self.model)

    @property
    def length(self) -> float:
        """L: the largest distance of a contact from the centre [m], by which moments are measured."""
        return float(np.linalg.norm(self.points - self.centre, axis=1).max())


def contact_set(grasp: Grasp, *, preloaded: bool = False) -> ContactSet:
    """Return the contacts of a planned grasp.

    Args:
        grasp: The grasp.
        preloaded: Whether the springs have the geometric stiffness of the forces in the joints, ∂(Jᵀ f)/∂q.
    """
    problem, springs, preload = grasp.problem, None, Preload()
    if preloaded:
        held = (grasp.joint_angles, grasp.palm_pose, grasp.contacts, grasp.intensities)
        preload = Preload(joints=joint_preload(problem, *held))
    if problem.parameters.contact_stiffness > 0.0 and not problem.rigid_joints.any():
        springs = compliant_grasp(
            grasp.grasp_matrix,
            grasp.hand_jacobian,
            problem.synergies.basis,
            contact_stiffness=problem.contact_springs,
            joint_stiffness=joint_stiffness(problem.joint_compliance),
            preload=preload,
        )
    wrenches = [task.direction for task in problem.tasks if not task.is_motion]
    return ContactSet(
        grasp.contacts.points,
        grasp.contacts.normals,
        np.broadcast_to(problem.parameters.friction, len(grasp.contacts.points)),
        np.zeros(3),
        grasp.intensities,
        problem.external_wrench,
        springs,
        problem.contact_model,
        JointRange(grasp.joint_angles, problem.hand.lower, problem.hand.upper, problem.synergies.mean),
        np.array(wrenches) if wrenches else None,
    )
