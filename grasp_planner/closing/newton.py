"""One Newton step towards a state of rest, for the states of many closings of a problem at once.

Unknown are the posture q, the contact forces f and, where the object is free, its six displacements. They solve

    q = q̄ + S σ − C_q Jᵀ f within the joint limits (10),     G f + w = 0 where the object is free (11),

with every contact either apart (f = 0), stuck (gap 0, no slip) or sliding (gap 0, |f_t| = μ f_n along the slip of the
step): the projections of Alart and Curnier, "A mixed formulation for frictional contact problems prone to Newton like
solution methods", Comput. Methods Appl. Mech. Eng. 92 (1991). The object's frame O is the frame of the computation: an
object that moves is a palm that moves the other way. The states of a batch, its first axis, do not know each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..model.compliance import joint_stiffness
from ..multistart.tree import BatchedTree, cross
from ..problem.problem import GraspProblem
from ..spatial import Array, skew
from .contact_law import block_diagonal, contact_axes, contact_rows
from .rest import Conditions, RestState

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
class Asked:
    """A state whose Newton step is asked for.

    Attributes:
        state: The state.
        before: The state of rest that the step began from.
        conditions: What the next state of rest has to meet.
        home: Rotation of the palm in O while the object is where it was planned, of shape (3, 3).
    """

    state: RestState
    before: RestState
    conditions: Conditions
    home: Array


@dataclass(frozen=True)
class NewtonStep:
    """The Newton step at a state, and where its contacts are; frame O.

    Attributes:
        centres: Fingertips, or centres of their spheres [m], of shape (n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).
        gaps: Gaps [m], of shape (n_c,).
        slips: How far each contact has slipped over the object since its anchor [m], of shape (n_c, 3).
        residual: The largest residual, scaled [N].
        d_q: Step of the posture [rad], of shape (n_q,).
        d_forces: Step of the forces [N], of shape (n_c, 3).
        twist: Step of the palm [m, rad], of shape (6,); all steps are nan where there is none.
    """

    centres: Array
    normals: Array
    gaps: Array
    slips: Array
    residual: float
    d_q: Array
    d_forces: Array
    twist: Array


class RestEvaluator:
    """Evaluates Newton steps of a problem.

    Args:
        problem: Hand, object, springs and friction.
    """

    def __init__(self, problem: GraspProblem) -> None:
        self.problem = problem
        self.friction = problem.friction * problem.contact_model.has_friction
        self._tree = BatchedTree(problem.hand)
        self._joints = np.array([frame.joint_id for frame in problem.frames], dtype=int)
        self._centres = np.array([frame.centre for frame in problem.frames])

    def steps(self, asked: Sequence[Asked]) -> list[NewtonStep]:
        """Return the Newton steps at some states.

        Args:
            asked: The states, B of them.
        """
        rows = _Rows(asked)
        place = self._place(rows)
        slips = self._slips(rows, place)
        balance, by_twist = self._balance(rows, place)
        residual, d_q, d_forces, twist = self._solved(rows, place, slips, balance, by_twist)
        parts = (place.centres, place.normals, place.gaps, slips, residual, d_q, d_forces, twist)
        return [NewtonStep(*row) for row in zip(*parts, strict=True)]

    def _place(self, rows: _Rows) -> _Place:
        """Return points, normals, gaps, Jacobians and grasp matrices."""
        turn, radii, coupling = rows.rotation[:, None], self.problem.radii, self.problem.hand.coupling
        placed = self._tree.place(rows.q)
        points = placed.points(self._joints, self._centres)
        back = rows.rotation.transpose(0, 2, 1)[:, None]
        motion = coupling.T @ self._tree.velocities(placed, points, self._joints) @ back
        spins = coupling.T @ self._tree.spins(placed, self._joints) @ back if radii.any() else np.zeros_like(motion)
        centres = (turn @ points[..., None])[..., 0] + rows.translation[:, None]
        surface = self.problem.grasp_object.solid.sample(centres.reshape(-1, 3))
        slope = surface.gradient.reshape(centres.shape)
        normals = -slope / np.linalg.norm(slope, axis=2, keepdims=True)
        arms = radii[:, None] * normals
        if radii.any():
            motion = motion + cross(spins, arms[:, :, None])
        return _Place(centres, normals, surface.distance.reshape(normals.shape[:2]) - radii, arms, motion, spins)

    def _slips(self, rows: _Rows, place: _Place) -> Array:
        """Return how far each contact has slipped over the object since its anchor [m], of shape (B, n_c, 3)."""
        moved = place.centres - rows.anchor_centres
        if self.problem.radii.any():
            turned = np.einsum("bijk,bij->bik", place.spins, rows.q[:, None] - rows.anchor_postures)
            moved = moved + cross(turned + rows.turned[:, None], place.arms)
        along = np.einsum("bij,bij->bi", moved, place.normals)
        return moved - along[..., None] * place.normals

    def _balance(self, rows: _Rows, place: _Place) -> tuple[Array, Array]:
        """Return G f + w of free objects, of shape (B, 6), and what load and drag add to its derivative."""
        forces, load = rows.forces, rows.load
        balance = load + rows.drag[:, None] * _UNITS**2 * np.concatenate([rows.shifted, rows.turned], axis=1)
        balance[:, :3] += forces.sum(axis=1)
        balance[:, 3:] += cross(place.points, forces).sum(axis=1)
        by_twist = rows.drag[:, None, None] * np.diag(_UNITS**2)
        by_twist[:, :3, 3:] -= skew(load[:, :3])
        by_twist[:, 3:, 3:] -= skew(load[:, 3:])
        return balance, by_twist

    def _solved(
        self, rows: _Rows, place: _Place, slips: Array, balance: Array, by_twist: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Return the largest residuals and the steps of postures, forces and palms."""
        count, n_c, n_q = len(rows.q), len(self._joints), rows.q.shape[1]
        m = 3 * n_c
        torques = np.einsum("bijk,bik->bj", place.motion, rows.forces)
        off_joints, soft = self.springs(rows.q, rows.reference, torques)
        axes = contact_axes(place.normals.reshape(-1, 3)).reshape(count, n_c, 3, 3)
        local, slip = ((axes @ each[..., None])[..., 0].reshape(-1, 3) for each in (rows.forces, slips))
        friction = np.tile(self.friction, count)
        laws = contact_rows(local, place.gaps.ravel(), slip[:, 1:], friction, rows.allowed.ravel())
        by_force, by_motion = (block_diagonal(law.reshape(count, n_c, 3, 3)) for law in laws[:2])
        off = laws[2].reshape(count, m)
        # Motion of the contact points over the object, along the axes of the contacts.
        by_joint = (axes @ place.motion.transpose(0, 1, 3, 2)).reshape(count, m, n_q)
        levers = axes @ -skew(place.points)
        by_palm = np.concatenate([axes, levers], axis=3).reshape(count, m, 6)
        softened = by_joint * soft[:, None] if soft.ndim == 2 else by_joint @ soft
        compliance = softened @ by_joint.transpose(0, 2, 1) + DAMPING * np.eye(m)
        matrix = np.zeros((count, m + 6, m + 6))
        matrix[:, :m, :m] = by_force - by_motion @ compliance
        matrix[:, :m, m:] = by_motion @ by_palm
        matrix[:, m:, :m], matrix[:, m:, m:] = by_palm.transpose(0, 2, 1), by_twist
        bent_off = (by_joint @ off_joints[..., None])[..., 0]
        right = np.concatenate([(by_motion @ bent_off[..., None])[..., 0] - off, -balance], axis=1)
        matrix[~rows.free, m:], matrix[~rows.free, :, m:], right[~rows.free, m:] = 0.0, 0.0, 0.0
        matrix[~rows.free, m:, m:] = np.eye(6)
        residual = np.maximum(100.0 * np.abs(off_joints).max(axis=1), np.abs(off).max(axis=1))
        unbalanced = np.abs(balance / _UNITS).max(axis=1)
        residual = np.where(rows.free, np.maximum(residual, unbalanced), residual)
        solution = _solve(matrix, right)
        d_local, twist = solution[:, :m], solution[:, m:]
        length = np.linalg.norm(twist * _UNITS, axis=1)
        share = np.minimum(1.0, FURTHEST / np.maximum(length, 1e-12))[:, None]
        d_q = -off_joints - np.einsum("bkj,bk->bj", softened, d_local)
        d_forces = np.einsum("bikj,bik->bij", axes, d_local.reshape(count, n_c, 3))
        return residual, share * d_q, share[..., None] * d_forces, share * twist

    def springs(self, q: Array, reference: Array, torques: Array) -> tuple[Array, Array]:
        """Return how far joints are from where springs, torques and stops put them, and how they yield to torques.

        With joints that bend each other the stops act through D = 1/diag(K_q): a joint within its limits is where
        q − D (K_q (q − q_r) + τ) says, which for a diagonal is q_r − C_q τ.

        Args:
            q: Postures [rad], of shape (B, n_q).
            reference: q_r [rad], of shape (B, n_q).
            torques: τ [N m], of shape (B, n_q).

        Returns:
            The step to that place, negative, of shape (B, n_q), and the compliance, symmetric, of shape (B, n_q) or
            (B, n_q, n_q).
        """
        hand, c_q = self.problem.hand, self.problem.joint_compliance
        if c_q.ndim == 1:
            wanted, own = reference - c_q * torques, c_q
        else:
            own = 1.0 / np.diag(self._stiffness)
            wanted = q - own * ((q - reference) @ self._stiffness + torques)
        inside = np.clip(wanted, hand.lower, hand.upper)
        off = q - inside - LIMIT_SOFTNESS * (wanted - inside)
        free = np.where(wanted == inside, 1.0, LIMIT_SOFTNESS)
        if c_q.ndim == 1:
            return off, free * own
        slope = (1.0 - free)[:, :, None] * np.eye(len(own)) + (free * own)[:, :, None] * self._stiffness
        yielding = np.linalg.solve(slope, (free * own)[:, :, None] * np.eye(len(own)))
        return np.linalg.solve(slope, off[..., None])[..., 0], yielding

    @cached_property
    def _stiffness(self) -> Array:
        """K_q of joints that bend each other, of shape (n_q, n_q)."""
        return joint_stiffness(self.problem.joint_compliance)


@dataclass(frozen=True)
class _Place:
    """Kinematics of states in O; motion and spins by the joints, of shape (B, n_c, n_q, 3)."""

    centres: Array
    normals: Array
    gaps: Array
    arms: Array
    motion: Array
    spins: Array

    @property
    def points(self) -> Array:
        """The contact points [m], of shape (B, n_c, 3)."""
        return self.centres + self.arms


class _Rows:
    """What is asked, stacked."""

    def __init__(self, asked: Sequence[Asked]) -> None:
        states, befores = [each.state for each in asked], [each.before for each in asked]
        conditions = [each.conditions for each in asked]
        anchors = [each.anchors for each in conditions]
        self.q = np.array([each.q for each in states])
        self.rotation = np.array([each.rotation for each in states])
        self.translation = np.array([each.translation for each in states])
        self.forces = np.array([each.forces for each in states])
        self.reference = np.array([each.reference for each in conditions])
        self.drag = np.array([each.drag for each in conditions])
        self.anchor_centres = np.array([each.centres for each in anchors])
        self.anchor_postures = np.array([each.postures for each in anchors])
        self.allowed = np.array([each.allowed for each in anchors])
        self.free = np.array([each.wrench is not None for each in conditions])
        none = np.zeros(6)
        wrenches = np.array([none if each.wrench is None else each.wrench for each in conditions])
        home = np.array([each.home for each in asked])
        # In O the load turns against the object.
        turn = self.rotation @ home.transpose(0, 2, 1)
        self.load = (turn[:, None] @ wrenches.reshape(-1, 2, 3, 1)).reshape(-1, 6)
        # The palm moves in O against the object: a drag on the object pulls along this motion.
        self.shifted = self.translation - np.array([each.translation for each in befores])
        self.turned = _turns(self.rotation @ np.array([each.rotation for each in befores]).transpose(0, 2, 1))


def _turns(rotations: Array) -> Array:
    """Return the rotation vectors of small rotations [rad], of shape (B, 3)."""
    return 0.5 * (rotations[:, [2, 0, 1], [1, 2, 0]] - rotations[:, [1, 2, 0], [2, 0, 1]])


def _solve(matrices: Array, right: Array) -> Array:
    """Return the solutions, nan where a matrix is singular."""
    try:
        return np.asarray(np.linalg.solve(matrices, right[..., None])[..., 0])
    except np.linalg.LinAlgError:
        if len(matrices) == 1:
            return np.full_like(right, np.nan)
        rows = zip(matrices, right, strict=True)
        return np.concatenate([_solve(matrix[None], row[None]) for matrix, row in rows])
