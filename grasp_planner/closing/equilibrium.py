"""Hand, springs, friction and object at rest: one step of a quasi-static simulation, by a semi-smooth Newton method.

Unknown are the posture q, the contact forces f and, where the object is free, its six displacements. They solve

    q = q̄ + S σ − C_q Jᵀ f within the joint limits (10),     G f + w = 0 where the object is free (11),

with every contact either apart (f = 0), stuck (gap 0, no slip) or sliding (gap 0, |f_t| = μ f_n along the slip of the
step): the projections of Alart and Curnier, "A mixed formulation for frictional contact problems prone to Newton like
solution methods", Comput. Methods Appl. Mech. Eng. 92 (1991). The object's frame O is the frame of the computation: an
object that moves is a palm that moves the other way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..hand.kinematics import ContactKinematics, HandKinematics
from ..model.compliance import bent, joint_stiffness, softened
from ..problem.problem import GraspProblem
from ..spatial import Array, Pose, cross_rows, rotation_exp, skew
from .contact_law import Flags, block_diagonal, contact_axes, contact_rows

MAX_ITERATIONS = 15
SHARES = (1.0, 0.5, 0.25, 0.1)
"""Shares of a Newton step that are tried until the residual falls; if it never does, the best is taken."""
TOLERANCE, ACCEPTED = 1e-5, 5e-3
"""Largest residual [N] at which iterations end, and with which the best is accepted where they do not get there."""
SLOW = 0.5
"""Iterations end, too, where a residual that would be accepted falls by less than to this share of the one before."""
DAMPING = 1e-5
"""Compliance added to that of the fingers in Newton steps only [m/N]: a stretched finger has directions without any."""
FURTHEST = 0.01
"""Longest step of the object in an iteration [m], rotations counted at 50 mm."""
LIMIT_SOFTNESS = 0.01
"""Compliance of a joint at its limit, relative to its own: with rigid limits some fingers could not be bent at all."""
ARM = 0.05
"""Length that brings rotations and torques to the same units as lengths and forces [m]."""

_UNITS = np.array([1.0, 1.0, 1.0, ARM, ARM, ARM])


@dataclass(frozen=True)
class RestState:
    """A state of hand and object; frame O, which moves with the object.

    Attributes:
        q: Posture [rad], of shape (n_q,).
        rotation: Of the palm in O, of shape (3, 3).
        translation: Of the palm in O [m], of shape (3,).
        forces: Of the hand on the object [N], of shape (n_c, 3).
        centres: Fingertips, or centres of their spheres [m], of shape (n_c, 3).
        gaps: Distances of the fingertips from the surface [m], of shape (n_c,).
        normals: Unit normals into the object, of shape (n_c, 3).
        slips: Slip of each contact in the step that ended here [m], of shape (n_c,).
    """

    q: Array
    rotation: Array
    translation: Array
    forces: Array
    centres: Array
    gaps: Array
    normals: Array
    slips: Array


@dataclass(frozen=True)
class Anchors:
    """Where the contacts were when the step began, or when they touched within it.

    Attributes:
        centres: Fingertips, or centres of their spheres, in O [m], of shape (n_c, 3).
        postures: Posture of each contact's finger then [rad], of shape (n_c, n_q).
        allowed: Which contacts may touch, of shape (n_c,).
    """

    centres: Array
    postures: Array
    allowed: Flags


@dataclass(frozen=True)
class Conditions:
    """What the next state of rest has to meet.

    Attributes:
        reference: q̄ + S σ of the references [rad], of shape (n_q,).
        anchors: Where the contacts come from.
        wrench: Wrench on the free object at its centre of mass, in axes that don't turn with it [N, N m], of shape
            (6,); None if it is held.
        drag: Force against the object's motion in this step [N/m].
    """

    reference: Array
    anchors: Anchors
    wrench: Array | None = None
    drag: float = 0.0


@dataclass(frozen=True)
class _Place:
    """Kinematics of a state in O."""

    centres: Array
    normals: Array
    gaps: Array
    jacobian: Array
    angular: Array
    grasp: Array


class RestSolver:
    """Finds states of rest of one problem, one after the other; for one thread.

    Attributes:
        left: Evaluations that it may still make.
        used: Evaluations it has made.
        friction: μ of every contact, 0 without friction, of shape (n_c,).

    Args:
        problem: Hand, object, springs and friction.
        palm_pose: Pose of the palm in O while the object is where it was planned.
    """

    def __init__(self, problem: GraspProblem, palm_pose: Pose) -> None:
        self.problem, self.home = problem, palm_pose
        self.left, self.used = 1_000_000, 0
        self.friction = problem.friction * problem.contact_model.has_friction
        self._kinematics = HandKinematics(problem.hand, problem.frames)

    def begin(self, q: Array) -> RestState:
        """Return a state without contact at a posture."""
        none, zero = np.zeros((len(self.problem.frames), 3)), np.zeros(len(self.problem.frames))
        state = RestState(q, self.home.rotation, self.home.translation, none, none, zero, none, zero)
        place = self._place(state)
        return replace(state, centres=place.centres, gaps=place.gaps, normals=place.normals)

    def unbalanced(self, state: RestState, wrench: Array) -> Array:
        """Return G f + w at a state, w given in the axes of O [N, N m], of shape (6,)."""
        return self._place(state).grasp @ state.forces.ravel() + wrench

    def solve(self, before: RestState, conditions: Conditions) -> RestState | None:
        """Return the next state of rest, or None if there is none near.

        Args:
            before: The state before.
            conditions: What it has to meet.
        """
        state = before
        place, step, residual = self._newton(state, before, conditions)
        best = (residual, state, place)
        for _ in range(MAX_ITERATIONS):
            if step is None or not np.isfinite(residual) or residual < TOLERANCE or self.left <= 0:
                break
            tried = []
            for share in SHARES:
                trial = _moved(state, *(share * part for part in step))
                tried.append((trial, *self._newton(trial, before, conditions)))
                if tried[-1][3] < (1.0 - 0.5 * share) * residual:
                    break
            last = residual
            state, place, step, residual = min(tried, key=lambda each: each[3])
            best = min(best, (residual, state, place), key=lambda each: each[0])
            if SLOW * last < residual < ACCEPTED:
                break
        residual, state, place = best
        if not residual < ACCEPTED:
            return None
        pressed = np.einsum("ij,ij->i", state.forces, place.normals) > 0.0
        slips = pressed * np.linalg.norm(self._slip(state, before, place, conditions.anchors), axis=1)
        return replace(state, centres=place.centres, gaps=place.gaps, normals=place.normals, slips=slips)

    def _place(self, state: RestState) -> _Place:
        """Return points, normals, gaps, Jacobians and grasp matrix at a state."""
        found: ContactKinematics = self._kinematics.compute(state.q)
        turn, radii = state.rotation, self.problem.radii[:, None]
        centres = found.position @ turn.T + state.translation
        surface = self.problem.grasp_object.solid.sample(centres)
        normals = -surface.gradient / np.linalg.norm(surface.gradient, axis=1, keepdims=True)
        angular = turn @ found.angular
        arm = radii * normals
        jacobian = turn @ found.linear - skew(arm) @ angular
        points = centres + arm
        grasp = np.vstack([np.tile(np.eye(3), (1, len(points))), skew(points).transpose(1, 0, 2).reshape(3, -1)])
        gaps = surface.distance - self.problem.radii
        return _Place(centres, normals, gaps, jacobian, angular, grasp)

    def _slip(self, state: RestState, before: RestState, place: _Place, anchors: Anchors) -> Array:
        """Return how far each contact has slipped over the object since its anchor [m], of shape (n_c, 3)."""
        moved = place.centres - anchors.centres
        if self.problem.radii.any():
            turned = np.einsum("ijk,ik->ij", place.angular, state.q - anchors.postures)
            turned = turned + _turn(state.rotation @ before.rotation.T)
            moved = moved + cross_rows(turned, self.problem.radii[:, None] * place.normals)
        along = np.einsum("ij,ij->i", moved, place.normals)
        return moved - along[:, None] * place.normals

    def _newton(
        self, state: RestState, before: RestState, conditions: Conditions
    ) -> tuple[_Place, tuple[Array, Array, Array] | None, float]:
        """Return kinematics, the Newton step (δq, δf, twist of the palm in O) and the largest residual, scaled."""
        self.left -= 1
        self.used += 1
        place, anchors = self._place(state), conditions.anchors
        m = place.gaps.size * 3
        torques = place.jacobian.reshape(m, -1).T @ state.forces.ravel()
        off_joints, soft = self._springs(state.q, conditions.reference, torques)
        axes = contact_axes(place.normals)
        local = np.einsum("ijk,ik->ij", axes, state.forces)
        slip = np.einsum("ijk,ik->ij", axes, self._slip(state, before, place, anchors))[:, 1:]
        laws = contact_rows(local, place.gaps, slip, self.friction, anchors.allowed)
        by_force, by_motion, off = block_diagonal(laws[0]), block_diagonal(laws[1]), laws[2].ravel()
        # Motion of the contact points over the object, along the axes of the contacts.
        by_joint = (axes @ place.jacobian).reshape(m, -1)
        by_palm = (axes @ place.grasp.T.reshape(-1, 3, 6)).reshape(m, 6)
        compliance = softened(by_joint, soft) @ by_joint.T + DAMPING * np.eye(m)
        matrix = by_force - by_motion @ compliance
        right = by_motion @ (by_joint @ off_joints) - off
        residual = max(100.0 * float(np.abs(off_joints).max()), float(np.abs(off).max()))
        if conditions.wrench is not None:
            balance, by_twist = self._balance(state, before, place, conditions)
            matrix = np.block([[matrix, by_motion @ by_palm], [by_palm.T, by_twist]])
            right = np.concatenate([right, -balance])
            residual = max(residual, float(np.abs(balance / _UNITS).max()))
        try:
            solution = np.linalg.solve(matrix, right)
        except np.linalg.LinAlgError:
            return place, None, residual
        d_local, twist = solution[:m], solution[m:] if conditions.wrench is not None else np.zeros(6)
        share = min(1.0, FURTHEST / max(float(np.linalg.norm(twist * _UNITS)), 1e-12))
        d_q = -off_joints - bent(soft, by_joint.T @ d_local)
        d_f = np.einsum("ikj,ik->ij", axes, d_local.reshape(-1, 3))
        return place, (share * d_q, share * d_f, share * twist), residual

    def _springs(self, q: Array, reference: Array, torques: Array) -> tuple[Array, Array]:
        """Return how far joints are from where springs, torques and stops put them, and how they yield to torques.

        With joints that bend each other the stops act through D = 1/diag(K_q): a joint within its limits is where
        q − D (K_q (q − q_r) + τ) says, which for a diagonal is q_r − C_q τ.

        Args:
            q: Posture [rad], of shape (n_q,).
            reference: q_r [rad], of shape (n_q,).
            torques: τ [N m], of shape (n_q,).

        Returns:
            The step to that place, negative, of shape (n_q,), and the compliance, of shape (n_q,) or (n_q, n_q).
        """
        hand, c_q = self.problem.hand, self.problem.joint_compliance
        if c_q.ndim == 1:
            wanted, own = reference - c_q * torques, c_q
        else:
            stiffness = joint_stiffness(c_q)
            own = 1.0 / np.diag(stiffness)
            wanted = q - own * (stiffness @ (q - reference) + torques)
        inside = np.clip(wanted, hand.lower, hand.upper)
        off = q - inside - LIMIT_SOFTNESS * (wanted - inside)
        free = np.where(wanted == inside, 1.0, LIMIT_SOFTNESS)
        if c_q.ndim == 1:
            return off, free * own
        slope = np.diag(1.0 - free) + (free * own)[:, None] * stiffness
        return np.linalg.solve(slope, off), np.linalg.solve(slope, np.diag(free * own))

    def _balance(
        self, state: RestState, before: RestState, place: _Place, conditions: Conditions
    ) -> tuple[Array, Array]:
        """Return G f + w of the free object, of shape (6,), and what its load and drag add to its derivative."""
        assert conditions.wrench is not None
        # In O the load turns against the object.
        turned = state.rotation @ self.home.rotation.T
        load = np.concatenate([turned @ conditions.wrench[:3], turned @ conditions.wrench[3:]])
        # The palm moves in O against the object: a drag on the object pulls along this motion.
        motion = np.concatenate([state.translation - before.translation, _turn(state.rotation @ before.rotation.T)])
        drag = conditions.drag * _UNITS**2
        by_twist = np.diag(drag)
        by_twist[:3, 3:] -= skew(load[:3])
        by_twist[3:, 3:] -= skew(load[3:])
        return place.grasp @ state.forces.ravel() + load + drag * motion, by_twist


def _moved(state: RestState, d_q: Array, d_f: Array, twist: Array) -> RestState:
    """Return a state after a step; the forces do not turn with it."""
    turn = rotation_exp(twist[3:])
    translation, kept = turn @ state.translation + twist[:3], (state.centres, state.gaps, state.normals, state.slips)
    return RestState(state.q + d_q, turn @ state.rotation, translation, state.forces + d_f, *kept)


def _turn(rotation: Array) -> Array:
    """Return the rotation vector of a small rotation [rad], of shape (3,)."""
    return 0.5 * np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
