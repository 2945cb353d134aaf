"""Forward kinematics of a hand for a batch of postures: any tree of one-degree joints, any linear coupling.

Joints of one depth are placed together, so that the interpreter's cost is shared by the batch and by the fingers.
Everything is in the palm frame P; the batch is the first axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pinocchio as pin

from ..hand.hand import Hand
from ..spatial import Array, Indices, namespace, skew

TURNING = 1e-9
"""Length of the angular part of a unit joint motion from which a joint turns."""


@dataclass(frozen=True)
class PlacedTree:
    """Where the joints of B postures are, in P; j joints with the fixed root first, n_v of them move.

    Attributes:
        rotations: Rotations of the joint frames, of shape (B, j, 3, 3).
        translations: Their origins [m], of shape (B, j, 3).
        axes: Axes of the moving joints, of shape (B, n_v, 3).
    """

    rotations: Array
    translations: Array
    axes: Array

    def points(self, joints: Indices, offsets: Array) -> Array:
        """Return points fixed to joints [m], of shape (B, k, 3).

        Args:
            joints: Index of the joint of each point, of shape (k,).
            offsets: The points in the frames of their joints [m], of shape (k, 3).
        """
        turned = (self.rotations[:, joints] @ offsets[:, :, None])[..., 0]
        return turned + self.translations[:, joints]

    def directions(self, joints: Indices, vectors: Array) -> Array:
        """Return directions fixed to joints, of shape (B, k, 3); arguments as for :meth:`points`."""
        return (self.rotations[:, joints] @ vectors[:, :, None])[..., 0]


@dataclass(frozen=True)
class _Level:
    """The joints of one depth: a joint turns as fixed + turning sin θ + lifting (1 − cos θ), and slides along.

    Parents are counted among the joints of the depth before.
    """

    parents: Indices | slice
    moving: Indices | slice
    fixed: Array
    turning: Array
    lifting: Array
    offsets: Array
    slides: Array


class BatchedTree:
    """The kinematic tree of a hand.

    Attributes:
        hand: The hand.
        slides: Which of the n_v joints slide instead of turning, of shape (n_v,).
        joint_of: Index of the joint of each moving joint angle, of shape (n_v,).
        carried: 1 where a moving joint carries a joint's frame, of shape (j, n_v).
    """

    def __init__(self, hand: Hand) -> None:
        model = hand.model
        self.hand = hand
        data = model.createData()
        pin.computeJointJacobians(model, data, pin.neutral(model))
        self._in_palm = hand.palm_in_root.inverse()
        n_v = model.nv
        self.carried = np.zeros((model.njoints, n_v))
        for joint, support in enumerate(model.supports):
            self.carried[joint, [model.joints[k].idx_v for k in support.tolist()[1:]]] = 1.0
        self.joint_of = np.zeros(n_v, dtype=int)
        local = np.zeros((n_v, 6))
        for joint in range(1, model.njoints):
            column = model.joints[joint].idx_v
            self.joint_of[column] = joint
            local[column] = data.oMi[joint].actInv(pin.Motion(np.array(data.J)[:, column])).vector
        turning = np.linalg.norm(local[:, 3:], axis=1) > TURNING
        self.slides = ~turning
        self._axes = np.where(turning[:, None], local[:, 3:], local[:, :3])
        self._set_levels(model, data)

    def place(self, q: Array) -> PlacedTree:
        """Return where the joints are.

        Args:
            q: Postures [rad], of shape (B, n_q).
        """
        xp, hand = namespace(q), self.hand
        angles = q @ hand.coupling.T + hand.coupling_offset
        sines, cosines = xp.sin(angles)[..., None, None], xp.cos(angles)[..., None, None]
        turned = [xp.broadcast_to(xp.asarray(self._in_palm.rotation), (len(q), 1, 3, 3))]
        moved = [xp.broadcast_to(xp.asarray(self._in_palm.translation), (len(q), 1, 3))]
        for level in self._levels:
            above, origin = turned[-1][:, level.parents], moved[-1][:, level.parents]
            turn = level.fixed + level.turning * sines[:, level.moving] + level.lifting * (1 - cosines[:, level.moving])
            turned.append(above @ turn)
            offsets = level.offsets + level.slides * angles[:, level.moving, None]
            moved.append((above @ offsets[..., None])[..., 0] + origin)
        rotations, translations = (xp.concatenate(each, axis=1)[:, self._placed_as] for each in (turned, moved))
        axes = (rotations[:, self.joint_of] @ self._axes[:, :, None])[..., 0]
        return PlacedTree(rotations, translations, axes)

    def velocities(self, placed: PlacedTree, points: Array, joints: Indices) -> Array:
        """Return ∂p/∂(all joint angles) of points fixed to joints [m/rad], of shape (B, k, n_v, 3).

        Args:
            placed: The postures.
            points: The points in P [m], of shape (B, k, 3).
            joints: Index of the joint of each point, of shape (k,).
        """
        arms = points[:, :, None] - placed.translations[:, None, self.joint_of]
        result = cross(placed.axes[:, None], arms)
        if self.slides.any():
            result = namespace(result).where(self.slides[:, None], placed.axes[:, None], result)
        return result * self.carried[joints][:, :, None]

    def spins(self, placed: PlacedTree, joints: Indices) -> Array:
        """Return the angular velocity of joints' frames per velocity of all joints, of shape (B, k, n_v, 3)."""
        return placed.axes[:, None] * (self.carried[joints] * ~self.slides)[:, :, None]

    def _set_levels(self, model: pin.Model, data: pin.Data) -> None:
        """Group the joints by depth, and find where each stands when these groups follow each other."""
        depth = np.zeros(model.njoints, dtype=int)
        neutral = [pin.SE3(each) for each in data.oMi]
        for joint in range(1, model.njoints):
            depth[joint] = depth[model.parents[joint]] + 1
        self._levels: list[_Level] = []
        groups = [np.flatnonzero(depth == step) for step in range(int(depth.max()) + 1)]
        self._placed_as = np.argsort(np.concatenate(groups))
        for before, joints in pairwise(groups):
            parents = np.array([model.parents[int(joint)] for joint in joints])
            moving = np.array([model.joints[int(joint)].idx_v for joint in joints])
            still = [
                neutral[int(above)].actInv(neutral[int(joint)]) for joint, above in zip(joints, parents, strict=True)
            ]
            fixed = np.array([each.rotation for each in still])
            turns = skew(self._axes[moving] * ~self.slides[moving][:, None])
            self._levels.append(
                _Level(
                    parents=_evenly(np.searchsorted(before, parents)),
                    moving=_evenly(moving),
                    fixed=fixed,
                    turning=fixed @ turns,
                    lifting=fixed @ turns @ turns,
                    offsets=np.array([each.translation for each in still]),
                    slides=(fixed @ (self._axes[moving] * self.slides[moving][:, None])[..., None])[..., 0],
                )
            )


def _evenly(indices: Indices) -> Indices | slice:
    """Return indices as a slice where they rise evenly: what a slice takes is not copied."""
    first, step = int(indices[0]), int(indices[1] - indices[0]) if len(indices) > 1 else 1
    even = step > 0 and np.array_equal(indices, first + step * np.arange(len(indices)))
    return slice(first, first + step * len(indices), step) if even else indices


def cross(first: Array, second: Array) -> Array:
    """Return the cross products of vectors along the last axis, with broadcasting."""
    x, y, z = first[..., 0], first[..., 1], first[..., 2]
    u, v, w = second[..., 0], second[..., 1], second[..., 2]
    return namespace(first).stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)
