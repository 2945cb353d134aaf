"""The result: a grasp that computes every number about itself, from scratch, by the clear formulas."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from ..checks import finite_array
from ..hand.configuration import HandConfiguration
from ..judge.clearance_check import Clearance, hand_clearances, joint_centre_depth, penetration, tip_overhang
from ..judge.load_check import load_violations
from ..judge.margins import (
    GraspMargins,
    Holding,
    Margin,
    disturbance_response,
    grasp_margins,
    holding,
    passive_margins,
    worst_passive_margin,
)
from ..judge.stability import Stability, grasp_stability
from ..model.compliance import contact_forces, hand_stiffness, internal_forces, joint_torques
from ..model.contacts import Contacts, find_contacts, grasp_matrix
from ..model.force_closure import force_closure_margin, force_norm_floor
from ..model.friction import force_norm, friction_margins, normal_forces
from ..model.task import alignment_deg, object_synergy_map, task_index, transmission_ratio
from ..problem.problem import GraspProblem
from ..spatial import Array, Pose
from ..values import Value
from .search_report import IterationRecord as IterationRecord
from .search_report import SearchReport as SearchReport

FEASIBILITY_TOLERANCE = 1e-6
"""Largest violation of a feasible grasp, in SI units (m, rad, N, N m)."""

NOTICED_OVERLAP, NOTICED_FORCE = 1e-5, 1e-2
"""Overlap [m] and disturbance [N] below which there is none to speak of."""

Status = Literal["feasible", "infeasible", "cancelled"]


@dataclass(frozen=True, eq=False, repr=False)
class Grasp(Value):
    """A posture, a palm pose and synergy displacements, with everything that follows from them.

    Nothing here trusts the solver: contacts come from Pinocchio's forward kinematics, forces from eq. (17)
    written out, and :attr:`violations` from these. Frame O throughout.

    Attributes:
        problem: The problem it answers.
        joint_angles: Actual posture q [rad], of shape (n_q,).
        palm_pose: Pose of the palm frame P in O.
        delta_sigma: δσ [rad], of shape (n_s,).
        search: How it was found; None for a grasp that was given.
    """

    problem: GraspProblem
    joint_angles: Array
    palm_pose: Pose
    delta_sigma: Array
    search: SearchReport | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "palm_pose", Pose.of(self.palm_pose))
        n_q, n_s = self.problem.hand.n_joints, self.problem.n_synergies
        object.__setattr__(self, "joint_angles", finite_array("joint_angles", self.joint_angles, (n_q,)))
        object.__setattr__(self, "delta_sigma", finite_array("delta_sigma", self.delta_sigma, (n_s,)))

    @cached_property
    def configuration(self) -> HandConfiguration:
        """Where the hand is."""
        return HandConfiguration(self.problem.hand, self.joint_angles, self.palm_pose)

    @cached_property
    def contacts(self) -> Contacts:
        """Contact points, normals into the object and gaps."""
        centres = self.configuration.contact_centres(self.problem.frames)
        return find_contacts(centres, self.problem.radii, self.problem.grasp_object)

    @cached_property
    def grasp_matrix(self) -> Array:
        """G, of shape (6, 3 n_c)."""
        return grasp_matrix(self.contacts.points)

    @cached_property
    def hand_jacobian(self) -> Array:
        """J [m/rad], of shape (3 n_c, n_q)."""
        return self.configuration.contact_jacobian(self.problem.frames, self.contacts.points)

    @cached_property
    def stiffness(self) -> Array:
        """K_m [N/m], of shape (3 n_c, 3 n_c)."""
        parameters = self.problem.parameters
        return hand_stiffness(self.hand_jacobian, parameters.structural_compliance, self.problem.joint_compliance)

    @cached_property
    def forces(self) -> Array:
        """Contact forces of the hand on the object [N], of shape (n_c, 3); eq. (17)."""
        problem = self.problem
        return contact_forces(
            self.grasp_matrix,
            self.hand_jacobian,
            problem.synergies.basis,
            self.delta_sigma,
            problem.external_wrench,
            self.stiffness,
            problem.parameters.contact_stiffness,
        ).reshape(-1, 3)

    @cached_property
    def normal_forces(self) -> Array:
        """f_n [N], of shape (n_c,)."""
        return normal_forces(self.forces, self.contacts.normals)

    @cached_property
    def friction_margins(self) -> Array:
        """μ f_n − |f_t| [N], of shape (n_c,)."""
        return friction_margins(self.forces, self.contacts.normals, self.problem.parameters.friction)

    @cached_property
    def joint_torques(self) -> Array:
        """τ = Jᵀ f [N m], of shape (n_q,); eq. (1)."""
        return joint_torques(self.hand_jacobian, self.forces.ravel())

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
            problem.parameters.contact_stiffness,
        )
        return joint_torques(self.hand_jacobian, internal @ self.delta_sigma)

    @cached_property
    def sigma(self) -> Array:
        """Synergy coordinates σ with q = q̄ + S σ − C_q τ, in the least-squares sense [rad], of shape (n_s,)."""
        bent = self.joint_angles + self.problem.joint_compliance * self.bending_torques
        return self.problem.synergies.coordinates(bent)

    @cached_property
    def reference_joint_angles(self) -> Array:
        """q_r = q̄ + S σ [rad], of shape (n_q,); eq. (4)."""
        return self.problem.synergies.joint_angles(self.sigma)

    @cached_property
    def force_norm(self) -> float:
        """F [N]; eq. (18)."""
        return force_norm(self.forces, self.contacts.normals)

    @cached_property
    def force_norm_floor(self) -> float:
        """Least F of any forces in the cones at these contacts [N]."""
        contacts, problem = self.contacts, self.problem
        return force_norm_floor(contacts.points, contacts.normals, problem.parameters.friction, problem.external_wrench)

    @cached_property
    def force_closure_margin(self) -> float:
        """How far inside the cones internal forces can be; positive means force closure."""
        contacts = self.contacts
        return force_closure_margin(contacts.points, contacts.normals, self.problem.parameters.friction)

    @property
    def force_closed(self) -> bool:
        """Whether the contacts can resist any wrench."""
        return self.force_closure_margin > 0.0

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

    @property
    def objective(self) -> float:
        """Z = w_F F + w_C C; eq. (29)."""
        parameters = self.problem.parameters
        return parameters.force_weight * self.force_norm + parameters.task_weight * self.task_index

    @cached_property
    def _holding(self) -> Holding:
        """What the margins need to know."""
        problem, grasp, jacobian = self.problem, self.grasp_matrix, self.hand_jacobian
        k_c = problem.parameters.contact_stiffness
        internal = internal_forces(grasp, jacobian, problem.synergies.basis, self.stiffness, k_c)
        response = disturbance_response(problem, grasp, jacobian)
        return holding(problem, self.contacts, self.forces, jacobian, response, internal)

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
        return grasp_stability(self.problem, self.joint_angles, self.palm_pose, self.contacts, self.forces)

    @cached_property
    def clearances(self) -> tuple[Clearance, ...]:
        """Exact distances of the hand from the object, from itself and from the ground, whether asked for or not."""
        return hand_clearances(self.problem, self.joint_angles, self.palm_pose)

    @cached_property
    def collisions(self) -> dict[str, float]:
        """Largest violation of everything that can be asked to keep clear, in the unit at the end of its name.

        ``tip_patch`` has no unit. All of them are computed, whether the problem asks for them or not.
        """
        problem, q, pose = self.problem, self.joint_angles, self.palm_pose
        return {
            "link_object_m": penetration(self.clearances, "link_object"),
            "joint_centre_m": joint_centre_depth(problem, q, pose),
            "self_collision_m": penetration(self.clearances, "self_collision"),
            "ground_m": penetration(self.clearances, "ground"),
            "tip_patch": tip_overhang(problem, q, pose, self.contacts.normals),
            "abduction_order_rad": float(max(0.0, -(problem.abduction_differences @ q).min(initial=0.0))),
        }

    @cached_property
    def violations(self) -> dict[str, float]:
        """Largest violation of every requirement of the problem, in the unit at the end of its name."""
        hand, q = self.problem.hand, self.joint_angles
        contacts = self.contacts
        region, _ = self.problem.grasp_object.region(contacts.points)
        imbalance = self.grasp_matrix @ self.forces.ravel() + self.problem.external_wrench
        soft = q - self.reference_joint_angles + self.problem.joint_compliance * self.bending_torques
        collisions = self.collisions | {"link_object_m": penetration(self.clearances, "link_object", tolerant=True)}
        return {
            "surface_m": float(np.abs(contacts.gaps).max()),
            "region_m": float(max(0.0, -region.min(initial=0.0))),
            "friction_n": float(max(0.0, -self.friction_margins.min())),
            "joint_limit_rad": float(np.maximum(hand.lower - q, q - hand.upper).max(initial=0.0)),
            "compliance_rad": float(np.abs(soft).max()),
            "equilibrium_n": float(np.abs(imbalance[:3]).max()),
            "equilibrium_nm": float(np.abs(imbalance[3:]).max()),
            **{name: collisions[name] for name in self.problem.clearance.requirements},
            **load_violations(self.problem, self.forces, contacts.normals, self.hand_jacobian, self.grasp_matrix),
        }

    def failures(self, tolerance: float = FEASIBILITY_TOLERANCE) -> dict[str, float]:
        """Return the violations above a tolerance, largest first."""
        failed = {name: value for name, value in self.violations.items() if not value <= tolerance}
        return dict(sorted(failed.items(), key=lambda item: -item[1]))

    def is_feasible(self, tolerance: float = FEASIBILITY_TOLERANCE) -> bool:
        """Return whether every violation is within a tolerance (SI units) and the contacts are force-closed."""
        return not self.failures(tolerance) and self.force_closed

    @property
    def feasible(self) -> bool:
        """Whether it is feasible at the standard tolerance."""
        return self.is_feasible()

    @property
    def status(self) -> Status:
        """``feasible``, ``infeasible``, or ``cancelled`` (stopped before a feasible one was found)."""
        if self.feasible:
            return "feasible"
        return "cancelled" if self.search is not None and self.search.cancelled else "infeasible"

    @cached_property
    def not_asked(self) -> tuple[str, ...]:
        """What the problem did not ask for and the grasp does not have, in words."""
        problem, found = self.problem, []
        options, collisions = problem.clearance, self.collisions
        overlap = max(
            collisions["link_object_m"] if options.link_object != "geometry" else 0.0,
            collisions["self_collision_m"] if not options.self_collision else 0.0,
        )
        if overlap > NOTICED_OVERLAP:
            found.append(f"links may overlap: {1e3 * overlap:.3g} mm")
        if not problem.loads.disturbed:
            held = self.passive_margin.size
            found.append(f"holds a push of only {held:.2g} N" if held > NOTICED_FORCE else "holds no disturbance")
        return tuple(found)

    @property
    def verdict(self) -> str:
        """One sentence: feasible, with what was not asked for; or what could not be met and by how much."""
        if self.feasible:
            note = "" if self.stability.stable else f"; but {self.stability.text}"
            open_points = f"; not asked for: {', '.join(self.not_asked)}" if self.not_asked else ""
            return f"feasible: every requirement is met and the contacts are force-closed{note}{open_points}"
        parts = [f"{name} {value:.3g}" for name, value in self.failures().items()]
        if not self.force_closed:
            parts.append("not force-closed")
        return f"{self.status}: " + ", ".join(parts)
