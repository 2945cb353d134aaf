"""A grasp by the clear formulas: every number of it from posture, palm pose and δσ alone, one formula after another."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from ..checks import finite_array
from ..exceptions import InvalidValueError
from ..hand.configuration import HandConfiguration
from ..model.compliance import bent, contact_forces, hand_stiffness, internal_forces, joint_torques
from ..model.contacts import Contacts, find_contacts
from ..model.force_closure import force_closure_margin, force_norm_floor, shows_force_closure
from ..model.friction import force_norm, friction_margins, normal_forces
from ..model.task import alignment_deg, object_synergy_map, task_index, transmission_ratio
from ..problem.problem import GraspProblem
from ..spatial import Array, Pose
from ..values import Value
from .clearance_check import Clearance, ClearanceKind, configuration_clearances, penetration
from .load_check import LoadCheck, check_loads, load_force_changes
from .margins import (
    GraspMargins,
    Holding,
    Margin,
    commanded_basis,
    disturbance_response,
    grasp_margins,
    holding,
    passive_margins,
    worst_passive_margin,
)
from .stability import Stability, grasp_stability
from .surface_check import exact_contacts

OF_POSE = "configuration", "clearances", "near_clearances", "contacts", "surface_contacts"
OF_POSTURE = *OF_POSE, "grasp_matrix", "hand_jacobian", "stiffness"
"""What follows from posture, palm pose and problem alone."""


@dataclass(frozen=True, eq=False, repr=False)
class PosedGrasp(Value):
    """A posture, a palm pose and what makes the forces, with everything that follows from them.

    Nothing here trusts the search: contacts come from Pinocchio's forward kinematics, forces from eq. (17) written
    out, or they are given and have to balance the load and bend the joints as the springs say. What is required of
    it, and whether it meets that, a :class:`~grasp_planner.grasp.grasp.Grasp` says. Frame O throughout.

    Attributes:
        problem: The problem it answers.
        joint_angles: Actual posture q [rad], of shape (n_q,).
        palm_pose: Pose of the palm frame P in O.
        delta_sigma: δσ [rad], of shape (n_s,); not used where forces come from springs.
        contact_forces: The forces of the hand on the object where they come from springs, as intensities of the
            contact model [N], of shape (n_c, d); None for no force there, and by eq. (17).
    """

    problem: GraspProblem
    joint_angles: Array
    palm_pose: Pose
    delta_sigma: Array
    contact_forces: Array | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "palm_pose", Pose.of(self.palm_pose))
        n_q, n_s = self.problem.hand.n_joints, self.problem.n_synergies
        object.__setattr__(self, "joint_angles", finite_array("joint_angles", self.joint_angles, (n_q,)))
        object.__setattr__(self, "delta_sigma", finite_array("delta_sigma", self.delta_sigma, (n_s,)))
        springs, n_c = self.problem.parameters.force_law == "springs", len(self.problem.frames)
        given = self.contact_forces
        if given is not None and not springs:
            raise InvalidValueError("contact_forces", given, "None where forces follow from δσ by eq. (17)")
        if springs:
            shape = (n_c, self.problem.contact_model.dimension)
            given = finite_array("contact_forces", np.zeros(shape) if given is None else given, shape)
        object.__setattr__(self, "contact_forces", given)

    def with_forces(self, contact_forces: Array) -> Self:
        """Return it with other contact forces, without computing again what follows from the posture alone."""
        found = replace(self, contact_forces=contact_forces)
        found.__dict__.update({name: self.__dict__[name] for name in OF_POSTURE if name in self.__dict__})
        return found

    @cached_property
    def configuration(self) -> HandConfiguration:
        """Where the hand is."""
        return HandConfiguration(self.problem.hand, self.joint_angles, self.palm_pose)

    @cached_property
    def contacts(self) -> Contacts:
        """Contact points, normals into the object and gaps."""
        problem = self.problem
        centres = self.configuration.contact_centres(problem.frames)
        return find_contacts(centres, problem.radii, problem.grasp_object)

    @cached_property
    def surface_contacts(self) -> Contacts:
        """The same contacts on the object's exact surface, of a mesh its triangles."""
        return exact_contacts(self.contacts, self.problem.radii, self.problem.grasp_object)

    @cached_property
    def grasp_matrix(self) -> Array:
        """G: intensities of the contacts, for hard fingers their forces, to the wrench; of shape (6, d n_c)."""
        return self.problem.contact_model.grasp_matrix(self.contacts.points, self.contacts.normals)

    @cached_property
    def hand_jacobian(self) -> Array:
        """J [m/rad], of shape (d n_c, n_q)."""
        twists = self.configuration.contact_twists(self.problem.frames, self.contacts.points)
        return self.problem.contact_model.hand_jacobian(twists, self.contacts.normals)

    @cached_property
    def stiffness(self) -> Array:
        """K_m [N/m], of shape (d n_c, d n_c)."""
        problem = self.problem
        return hand_stiffness(self.hand_jacobian, problem.structural_compliances, problem.joint_compliance)

    @cached_property
    def intensities(self) -> Array:
        """Intensities λ of the contacts, for hard fingers their forces [N], of shape (n_c, d); given, or by (17)."""
        problem = self.problem
        if self.contact_forces is not None:
            return self.contact_forces
        return contact_forces(
            self.grasp_matrix,
            self.hand_jacobian,
            problem.synergies.basis,
            self.delta_sigma,
            problem.external_wrench,
            self.stiffness,
            problem.contact_springs,
        ).reshape(len(problem.frames), -1)

    @cached_property
    def forces(self) -> Array:
        """Contact forces of the hand on the object [N], of shape (n_c, 3)."""
        return self.problem.contact_model.forces(self.intensities, self.contacts.normals)

    @cached_property
    def moments(self) -> Array:
        """Contact moments of the hand on the object about the contact points [N m], of shape (n_c, 3)."""
        return self.problem.contact_model.moments(self.intensities, self.contacts.normals)

    @cached_property
    def covectors(self) -> Array:
        """ν of the contacts, for hard fingers their normals: f_n = ν·λ, of shape (n_c, d)."""
        return self.problem.contact_model.covectors(self.contacts.normals)

    @cached_property
    def normal_forces(self) -> Array:
        """f_n [N], of shape (n_c,)."""
        return normal_forces(self.intensities, self.covectors)

    @cached_property
    def friction_margins(self) -> Array:
        """μ f_n − |λ − f_n ν|, for hard fingers μ f_n − |f_t| [N], of shape (n_c,)."""
        return friction_margins(self.intensities, self.covectors, self.problem.friction)

    @cached_property
    def joint_torques(self) -> Array:
        """τ = Jᵀ λ [N m], of shape (n_q,); eq. (1)."""
        return joint_torques(self.hand_jacobian, self.intensities.ravel())

    @cached_property
    def bending_torques(self) -> Array:
        """The torques that bend the joints in eq. (10): of the total forces, or as in (33) of the internal ones."""
        problem = self.problem
        if problem.parameters.torque_model == "total":
            return self.joint_torques
        internal = internal_forces(
            self.grasp_matrix,
            self.hand_jacobian,
            problem.synergies.basis,
            self.stiffness,
            problem.contact_springs,
        )
        return joint_torques(self.hand_jacobian, internal @ self.delta_sigma)

    @cached_property
    def sigma(self) -> Array:
        """Synergy coordinates σ with q = q̄ + S σ − C_q τ, in the least-squares sense [rad], of shape (n_s,)."""
        yielded = bent(self.problem.joint_compliance, self.bending_torques)
        return self.problem.synergies.coordinates(self.joint_angles + yielded)

    @cached_property
    def reference_joint_angles(self) -> Array:
        """q_r = q̄ + S σ [rad], of shape (n_q,); eq. (4)."""
        return self.problem.synergies.joint_angles(self.sigma)

    @cached_property
    def force_norm(self) -> float:
        """F [N]; eq. (18)."""
        return force_norm(self.intensities, self.covectors)

    @cached_property
    def force_norm_floor(self) -> float:
        """Least F of any forces in the cones at these contacts [N]."""
        contacts, problem = self.contacts, self.problem
        model, wrench = problem.contact_model, problem.external_wrench
        return force_norm_floor(contacts.points, contacts.normals, problem.friction, wrench, model)

    @cached_property
    def load_force_floor(self) -> float:
        """Least F of any forces at these contacts that hold every load case, by the passive answer of this posture [N].

        The floor of the problem without load cases.
        """
        contacts, problem = self.contacts, self.problem
        if not problem.loads.active:
            return self.force_norm_floor
        return force_norm_floor(
            contacts.points,
            contacts.normals,
            problem.friction / problem.loads.friction_safety,
            problem.external_wrench,
            problem.contact_model,
            changes=load_force_changes(problem, self.grasp_matrix, self.hand_jacobian),
            least_normal=problem.loads.min_normal_force,
        )

    @cached_property
    def force_closure_margin(self) -> float:
        """How far inside the cones internal forces can be; positive means force closure."""
        contacts, problem = self.contacts, self.problem
        return force_closure_margin(contacts.points, contacts.normals, problem.friction, problem.contact_model)

    @cached_property
    def force_closed(self) -> bool:
        """Whether the contacts can resist any wrench: mostly forces near its own show it."""
        contacts, problem = self.contacts, self.problem
        at = contacts.points, contacts.normals, problem.friction
        return shows_force_closure(*at, self.intensities, problem.contact_model) or self.force_closure_margin > 0.0

    @cached_property
    def object_synergy_map(self) -> Array:
        """H_s, of shape (6, n_s); eq. (21)."""
        return object_synergy_map(self.grasp_matrix, self.hand_jacobian @ self.problem.synergies.basis)

    @cached_property
    def task_index(self) -> float:
        """C; eq. (28)."""
        return task_index(self.object_synergy_map, self.problem.tasks)

    @cached_property
    def transmission_ratios(self) -> tuple[float, ...]:
        """α or β of every task direction; eq. (26), (27)."""
        return tuple(transmission_ratio(self.object_synergy_map, task) for task in self.problem.tasks)

    @cached_property
    def alignments(self) -> tuple[tuple[float, bool], ...]:
        """Angle [degrees] between each task direction and the longest axis of its ellipsoid; degenerate flag."""
        return tuple(alignment_deg(self.object_synergy_map, task) for task in self.problem.tasks)

    @cached_property
    def _holding(self) -> Holding:
        """What the margins need to know."""
        problem, grasp, jacobian = self.problem, self.grasp_matrix, self.hand_jacobian
        internal = commanded_basis(problem, grasp, jacobian)
        response = disturbance_response(problem, grasp, jacobian)
        return holding(problem, self.contacts, self.intensities, jacobian, response, internal)

    @cached_property
    def passive_margin(self) -> Margin:
        """Largest disturbing force resisted in the worst direction with the references held."""
        return worst_passive_margin(self._holding)

    def passive_margins_along(self, wrenches: Array) -> list[Margin]:
        """Return the largest disturbances resisted along unit wrenches in O, of shape (n, 6), the references held."""
        return passive_margins(self._holding, np.atleast_2d(wrenches))

    @cached_property
    def margins(self) -> GraspMargins:
        """Largest disturbances resisted, in the worst direction and along the tasks, whether asked for or not."""
        return grasp_margins(self._holding, self.problem.tasks, self.passive_margin)

    @cached_property
    def stability(self) -> Stability:
        """Stiffness with which the object is held, preload included, and the motion resisted least."""
        return grasp_stability(self.problem, self.joint_angles, self.palm_pose, self.contacts, self.intensities)

    @cached_property
    def clearances(self) -> tuple[Clearance, ...]:
        """Exact distances of the hand from the object, from itself and from the ground, whether asked for or not."""
        return configuration_clearances(self.problem, self.configuration)

    @cached_property
    def near_clearances(self) -> tuple[Clearance, ...]:
        """Those of :attr:`clearances` that are overlaps; of pairs that are far apart nothing is measured."""
        return configuration_clearances(self.problem, self.configuration, near=0.0)

    def overlap(self, kind: ClearanceKind) -> float:
        """Return the deepest overlap of a kind [m], whether it was to be avoided or not; 0 if there is none."""
        return penetration(self.near_clearances, kind)

    @cached_property
    def load_check(self) -> LoadCheck:
        """What the load cases of the problem make of forces and torques."""
        return check_loads(self.problem, self.intensities, self.covectors, self.hand_jacobian, self.grasp_matrix)
