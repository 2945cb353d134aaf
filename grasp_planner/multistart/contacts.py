"""Contacts, forces, springs and equilibrium for a batch of states, with derivatives by x = (q, v, w, f).

The batched twin of :mod:`grasp_planner.evaluation`, in the palm frame P; hard fingers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..evaluation.state import FORCE_SMOOTHING, FRICTION_SMOOTHING
from ..problem.problem import GraspProblem
from ..spatial import Array, namespace, skew
from .rows import own_columns
from .states import States
from .tree import BatchedTree, PlacedTree, cross


@dataclass(frozen=True)
class BatchedContacts:
    """n_c contacts of B states in P; n_g = n_q + 6 variables (q, v, w) move them, n_x with the forces.

    Attributes:
        states: The states.
        placed: Where the joints are.
        points: Contact points [m], of shape (B, n_c, 3).
        normals: Unit normals into the object, of shape (B, n_c, 3).
        gaps: Gaps [m], of shape (B, n_c).
        velocities: ∂p/∂q of the material points at the contacts, J [m/rad], of shape (B, n_c, n_q, 3).
        d_points: ∂points, of shape (B, n_c, n_g, 3).
        d_normals: ∂normals, of shape (B, n_c, n_g, 3).
        d_gaps: ∂gaps, of shape (B, n_c, n_g).
        torques: Jᵀ f [N m], of shape (B, n_q).
        d_torques: ∂torques, of shape (B, n_q, n_x).
        balance: G f + w_ext about the object's origin [N, N m], of shape (B, 6).
        d_balance: ∂balance, of shape (B, 6, n_x).
        normal_forces: f_n [N], of shape (B, n_c).
        d_normal_forces: ∂f_n, of shape (B, n_c, n_x).
        origin: The object's origin in P [m], of shape (B, 3).
    """

    states: States
    placed: PlacedTree
    points: Array
    normals: Array
    gaps: Array
    velocities: Array
    d_points: Array
    d_normals: Array
    d_gaps: Array
    torques: Array
    d_torques: Array
    balance: Array
    d_balance: Array
    normal_forces: Array
    d_normal_forces: Array
    origin: Array

    def cone_margins(self, friction: Array) -> tuple[Array, Array]:
        """Return μ f_n − √(|f_t|² + ε²), of shape (B, n_c), and its derivatives by x, of shape (B, n_c, n_x).

        Args:
            friction: μ of every contact, of shape (n_c,).
        """
        forces, normal, d_normal = self.states.forces, self.normal_forces, self.d_normal_forces
        xp, n_g = namespace(forces), self.d_normals.shape[2]
        squared = xp.einsum("bik,bik->bi", forces, forces) - normal**2
        length = xp.sqrt(xp.maximum(squared, 0.0) + FRICTION_SMOOTHING**2)
        slope = (friction + normal / length)[..., None] * d_normal
        by_force = slope[..., n_g:] - own_columns(forces / length[..., None])
        return friction * normal - length, xp.concatenate([slope[..., :n_g], by_force], axis=2)

    @property
    def force_norm(self) -> Array:
        """F [N], of shape (B,)."""
        xp = namespace(self.normal_forces)
        return xp.sqrt(xp.einsum("bi,bi->b", self.normal_forces, self.normal_forces) + FORCE_SMOOTHING**2)

    @property
    def force_room(self) -> tuple[Array, Array]:
        """Return how much more F may be [N], of shape (B, 1), and its derivatives by x, of shape (B, 1, n_x)."""
        force = self.force_norm
        slope = (self.normal_forces / force[:, None])[:, None] @ self.d_normal_forces
        return (self.states.most_force - force)[:, None], -slope


class BatchedContactEvaluator:
    """Evaluates the contacts of a problem."""

    def __init__(self, problem: GraspProblem, tree: BatchedTree) -> None:
        self.problem, self.tree = problem, tree
        self._joints = np.array([frame.joint_id for frame in problem.frames], dtype=int)
        self._centres = np.array([frame.centre for frame in problem.frames])
        self._carried = tree.carried[self._joints]
        n_v = self._carried.shape[1]
        self._upper = np.triu(np.ones((n_v, n_v)))
        self._strict = np.triu(np.ones((n_v, n_v)), 1)

    def evaluate(self, states: States) -> BatchedContacts:
        """Evaluate the contacts of states, with all derivatives."""
        problem, tree, xp = self.problem, self.tree, namespace(states.joints)
        coupling, radii = problem.hand.coupling, problem.radii
        placed = tree.place(states.joints)
        centres = placed.points(self._joints, self._centres)
        normals, gaps, d_gaps_centre, bend = self._surface(states, centres)
        full = tree.velocities(placed, centres, self._joints)
        spins = tree.spins(placed, self._joints)
        n_q = coupling.shape[1]

        by_joints = coupling.T @ full
        unit = xp.broadcast_to(np.eye(3), (*centres.shape, 3))
        # Of the tips' centres against the object; row k of skew(p) is e_k × p.
        moved = xp.concatenate([by_joints, unit, skew(centres)], axis=2)
        leant = moved @ -bend
        # n turns against the palm: −w × n
        d_normals = xp.concatenate([leant[:, :, : n_q + 3], leant[:, :, n_q + 3 :] - skew(normals)], axis=2)
        points = centres + radii[:, None] * normals
        rolled = radii[:, None, None] * d_normals
        d_points = xp.concatenate([by_joints + rolled[:, :, :n_q], rolled[:, :, n_q:]], axis=2)

        arms = radii[:, None] * normals
        material = full + cross(spins, arms[:, :, None])
        velocities = coupling.T @ material
        torques, d_torques = self._torques(states.forces, material, spins, velocities, d_points)
        origin = -(states.rotation.transpose(0, 2, 1) @ states.translation[..., None])[..., 0]
        balance, d_balance = self._balance(states, points, d_points, origin)
        by_motion = (d_normals @ states.forces[..., None])[..., 0]
        return BatchedContacts(
            states=states,
            placed=placed,
            points=points,
            normals=normals,
            gaps=gaps - radii,
            velocities=velocities,
            d_points=d_points,
            d_normals=d_normals,
            d_gaps=(moved @ d_gaps_centre[..., None])[..., 0],
            torques=torques,
            d_torques=d_torques,
            balance=balance,
            d_balance=d_balance,
            normal_forces=xp.einsum("bik,bik->bi", normals, states.forces),
            d_normal_forces=xp.concatenate([by_motion, own_columns(normals)], axis=2),
            origin=origin,
        )

    def _surface(self, states: States, centres: Array) -> tuple[Array, Array, Array, Array]:
        """Return normals, distances, ∇φ in P, and the matrix by which normals follow motions (transposed), in P."""
        xp, (count, n_c, _) = namespace(centres), centres.shape
        turned = states.rotation[:, None]
        in_object = (turned @ centres[..., None])[..., 0] + states.translation[:, None]
        sample = self.problem.grasp_object.sample(in_object.reshape(-1, 3))
        back = turned.transpose(0, 1, 3, 2)
        gradient = (back @ sample.gradient.reshape(count, n_c, 3, 1))[..., 0]
        slope = xp.sqrt(xp.einsum("bik,bik->bi", gradient, gradient))[..., None]
        normals = -gradient / slope
        bend = back @ sample.hessian.reshape(count, n_c, 3, 3) @ turned / slope[..., None]
        bend = bend - normals[..., :, None] * (normals[..., None, :] @ bend)
        return normals, sample.distance.reshape(count, n_c), gradient, bend.transpose(0, 1, 3, 2)

    def _torques(
        self, forces: Array, material: Array, spins: Array, velocities: Array, d_points: Array
    ) -> tuple[Array, Array]:
        """Return τ = Jᵀ f and its derivatives: by the tree's second derivatives, by points, by forces."""
        xp, coupling, (count, n_c, _) = namespace(forces), self.problem.hand.coupling, forces.shape
        n_q, n_g = coupling.shape[1], d_points.shape[2]
        torques = xp.einsum("biqk,bik->bq", velocities, forces)
        # f·(ω_a × ∂p/∂q_b) for a at or before b in the chain; both factors vanish off the chain.
        pulls = cross(forces[:, :, None], spins)
        n_v = pulls.shape[2]
        products = pulls.transpose(0, 2, 1, 3).reshape(count, n_v, -1) @ material.transpose(0, 1, 3, 2).reshape(
            count, -1, n_v
        )
        curved = products * self._upper + (products * self._strict).transpose(0, 2, 1)
        # What the point of contact moves on the finger itself: f × ω_a against ∂p less that of the material point.
        sliding = xp.concatenate([d_points[:, :, :n_q] - velocities, d_points[:, :, n_q:]], axis=2)
        levers = (coupling.T @ pulls).transpose(0, 2, 1, 3).reshape(count, n_q, -1)
        slid = levers @ sliding.transpose(0, 1, 3, 2).reshape(count, -1, n_g)
        by_joints = coupling.T @ curved @ coupling + slid[:, :, :n_q]
        by_forces = velocities.transpose(0, 2, 1, 3).reshape(count, n_q, 3 * n_c)
        return torques, xp.concatenate([by_joints, slid[:, :, n_q:], by_forces], axis=2)

    def _balance(self, states: States, points: Array, d_points: Array, origin: Array) -> tuple[Array, Array]:
        """Return G f + w_ext about the object's origin, in P, and its derivatives."""
        xp, forces, (count, n_c, n_g, _) = namespace(points), states.forces, d_points.shape
        turned = states.rotation.transpose(0, 2, 1)
        wrench = self.problem.external_wrench
        pushed, twisted = turned @ wrench[:3], turned @ wrench[3:]
        total = forces.sum(axis=1)
        arms = points - origin[:, None]
        balance = xp.concatenate([total + pushed, cross(arms, forces).sum(axis=1) + twisted], axis=1)
        still, each = xp.zeros((count, 3, n_g - 3)), xp.broadcast_to(np.tile(np.eye(3), n_c), (count, 3, 3 * n_c))
        by_force = xp.concatenate([still, skew(pushed), each], axis=2)
        # δa = δp − δo with δo = o × w − v: the object moves against the palm.
        moved = -xp.einsum("bikl,bigl->bkg", skew(forces), d_points)
        linear = moved[..., -6:-3] - skew(total)
        angular = moved[..., -3:] + skew(twisted) + skew(total) @ skew(origin)
        levers = skew(arms).transpose(0, 2, 1, 3).reshape(count, 3, 3 * n_c)
        by_moment = xp.concatenate([moved[..., :-6], linear, angular, levers], axis=2)
        return balance, xp.concatenate([by_force, by_moment], axis=1)
