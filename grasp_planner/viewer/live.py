"""The hand under the sliders: synergy coordinates, squeeze and poses in, a complete :class:`Grasp` out. No display."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..exceptions import GraspPlannerError
from ..grasp.grasp import Grasp
from ..grasp.squeeze import balanced
from ..model.compliance import bent
from ..problem.problem import GraspProblem
from ..spatial import Array, Pose, readonly
from .squeeze import best_squeeze

TOUCH_DISTANCE = 0.005
"""Gap at which the contact forces set in; they are complete at gap zero [m]."""
MAX_BEND = 0.3
"""Largest bending of a joint by its torque that is shown [rad]."""
BEND_TOLERANCE = 1e-9
"""Change of the bending at which it counts as settled, far below the tolerance of a feasible grasp [rad]."""
TINY = 1e-30
BEND_STEPS, ROUGH_STEPS = 15, 2
"""Most fixed-point steps for the actual posture, and while the squeeze is still being chosen."""


@dataclass(frozen=True)
class LiveState:
    """What the sliders and gizmos say.

    Attributes:
        problem: The problem; its gravity is that in O at the present object pose.
        sigma: σ [rad], of shape (n_s,).
        delta_sigma: δσ [rad], of shape (n_s,); not used where forces come from springs.
        contact_forces: Intensities of the contacts where they do [N], of shape (n_c, d), before they balance the load.
        hand_pose: Pose of the palm frame P in the world.
        object_pose: Pose of O in the world.
        offset: What the posture has besides synergies and bending [rad], of shape (n_q,).
        gravity: Gravity in the world [m/s²], of shape (3,).
        bend: Bending C_q τ at the last evaluation, where the next one starts [rad], of shape (n_q,).
    """

    problem: GraspProblem
    sigma: Array
    delta_sigma: Array
    hand_pose: Pose
    object_pose: Pose
    offset: Array
    gravity: Array
    bend: Array
    contact_forces: Array | None = None

    @classmethod
    def of(cls, grasp: Grasp, object_pose: Pose | None = None) -> LiveState:
        """Return the state that shows a grasp, with the object at a pose in the world (identity if left out)."""
        at = Pose.identity() if object_pose is None else object_pose
        bend = _bend(grasp)
        return cls(
            problem=grasp.problem,
            sigma=grasp.sigma,
            delta_sigma=grasp.delta_sigma,
            hand_pose=at * grasp.palm_pose,
            object_pose=at,
            offset=grasp.joint_angles + bend - grasp.problem.synergies.joint_angles(grasp.sigma),
            gravity=np.array(at.rotation) @ grasp.problem.parameters.gravity,
            bend=bend,
            contact_forces=grasp.contact_forces,
        )

    def squeezed(self, squeeze: Array) -> LiveState:
        """Return the state with another δσ, or other contact forces where they come from springs."""
        springs = self.problem.parameters.force_law == "springs"
        return replace(self, contact_forces=squeeze) if springs else replace(self, delta_sigma=squeeze)

    @property
    def palm_pose(self) -> Pose:
        """Pose of the palm frame P in O."""
        return self.object_pose.inverse() * self.hand_pose

    def with_problem(self, problem: GraspProblem) -> LiveState:
        """Return the state for another problem: same poses, the posture kept as well as its synergies can.

        With another hand the posture is that of σ = 0.
        """
        n_q, n_s = problem.hand.n_joints, problem.n_synergies
        if problem.hand.joint_names != self.problem.hand.joint_names:
            zero = np.zeros(n_q)
            return replace(
                self, problem=problem, sigma=np.zeros(n_s), delta_sigma=np.zeros(n_s), offset=zero, bend=zero
            )
        if _same_synergies(problem, self.problem):
            return replace(self, problem=problem)
        # Fewer or other synergies: the nearest posture they can make.
        sigma = problem.synergies.coordinates(self.problem.synergies.joint_angles(self.sigma) + self.offset)
        delta = np.zeros(n_s)
        shared = min(n_s, len(self.delta_sigma))
        delta[:shared] = self.delta_sigma[:shared]
        return replace(self, problem=problem, sigma=sigma, delta_sigma=delta, offset=np.zeros(n_q))

    def with_object_pose(self, pose: Pose) -> LiveState:
        """Return the state with the object elsewhere; gravity stays down in the world."""
        gravity = np.array(pose.rotation).T @ self.gravity
        if np.allclose(gravity, self.problem.parameters.gravity, rtol=0.0, atol=1e-12):
            return replace(self, object_pose=pose)
        parameters = replace(self.problem.parameters, gravity=readonly(gravity))
        return replace(self, object_pose=pose, problem=replace(self.problem, parameters=parameters))


@dataclass(frozen=True)
class Shown:
    """All that undo brings back.

    Attributes:
        live: What sliders and gizmos say.
        grasp: The grasp.
        base_squeeze: δσ, or contact forces, that a squeeze of 1 means.
        squeeze: The squeeze.
        automatic_squeeze: Whether it is chosen for the least force.
        note: Where the grasp comes from.
        moved: Whether the grasp is still to be evaluated.
    """

    live: LiveState
    grasp: Grasp
    base_squeeze: Array
    squeeze: float
    automatic_squeeze: bool
    note: str
    moved: bool


def evaluate(state: LiveState, *, automatic_squeeze: bool = False) -> tuple[LiveState, Grasp]:
    """Return the grasp a state stands for: the posture settled under its contact forces.

    The actual posture solves q = q̄ + S σ − C_q τ(q) (10), where τ sets in as the fingertips come within 5 mm.

    Args:
        state: The state.
        automatic_squeeze: Whether to squeeze with the least force that holds the object, where one does.

    Returns:
        The state with its new bending and squeeze, and the grasp.
    """
    grasp = _settle(state, ROUGH_STEPS if automatic_squeeze else BEND_STEPS)
    if automatic_squeeze and contact_share(grasp) > 0.0:
        for steps in (ROUGH_STEPS, BEND_STEPS):
            best = best_squeeze(grasp)
            if best is None:
                steps = BEND_STEPS
            state = replace(state if best is None else state.squeezed(best), bend=_bend(grasp))
            grasp = _settle(state, steps)
    return replace(state, bend=_bend(grasp)), grasp


def contact_share(grasp: Grasp) -> float:
    """Return how much of a contact the fingertips make: 1 when all touch, 0 from 5 mm on."""
    return float(np.clip(1.0 - np.abs(grasp.contacts.gaps).max() / TOUCH_DISTANCE, 0.0, 1.0))


def _settle(state: LiveState, steps: int) -> Grasp:
    """Solve for the actual posture, from the last bending: fixed-point steps, each mixed with the one before it.

    The mix is that of Anderson, Iterative Procedures for Nonlinear Integral Equations, J. ACM 12(4), 1965, of depth 1:
    as much of the last step is taken back as makes the change of the bending smallest to first order.
    """
    problem, hand = state.problem, state.problem.hand
    free = problem.synergies.joint_angles(state.sigma) + state.offset
    palm, bend = state.palm_pose, state.bend
    grasp = _posture(state, free - bend, palm)
    last: tuple[Array, Array] | None = None
    for _ in range(steps):
        following = _bend(grasp)
        change = following - bend
        if np.abs(change).max() < BEND_TOLERANCE:
            break
        bend = following
        if last is not None:
            turn = change - last[1]
            bend = following - (turn @ change) / max(float(turn @ turn), TINY) * (following - last[0])
        last = following, change
        grasp = _posture(state, np.clip(free - bend, hand.lower, hand.upper), palm)
    return grasp


def _posture(state: LiveState, q: Array, palm: Pose) -> Grasp:
    """Return the grasp of a posture kept within the joint limits."""
    problem, hand = state.problem, state.problem.hand
    q = np.clip(q, hand.lower, hand.upper)
    grasp = Grasp(problem, q, palm, state.delta_sigma)
    if problem.parameters.force_law != "springs":
        return grasp
    given = state.contact_forces
    wanted = np.zeros_like(grasp.intensities) if given is None or given.shape != grasp.intensities.shape else given
    return grasp.with_forces(balanced(grasp, wanted))


def _bend(grasp: Grasp) -> Array:
    """Return how far the contact torques bend the joints [rad], of shape (n_q,)."""
    share = contact_share(grasp)
    if share == 0.0:
        return np.zeros(grasp.problem.hand.n_joints)
    try:
        bend = share * bent(grasp.problem.joint_compliance, grasp.bending_torques)
    except (GraspPlannerError, np.linalg.LinAlgError):
        return np.zeros(grasp.problem.hand.n_joints)
    return np.clip(bend, -MAX_BEND, MAX_BEND)


def _same_synergies(one: GraspProblem, other: GraspProblem) -> bool:
    """Return whether two problems have the same synergies."""
    return one.synergies.basis.shape == other.synergies.basis.shape and bool(
        np.array_equal(one.synergies.basis, other.synergies.basis)
        and np.array_equal(one.synergies.mean, other.synergies.mean)
    )
