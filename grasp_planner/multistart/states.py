"""A batch of states of the springs problem: postures, palm poses, contact forces; and steps away from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..spatial import Array, Indices
from .tree import cross


@dataclass(frozen=True)
class States:
    """B states; a step is x = (q, v, w, f) with v and w the twist of the palm in its own frame.

    Attributes:
        joints: q [rad], of shape (B, n_q).
        rotation: Rotation of the palm in O, of shape (B, 3, 3).
        translation: Position of the palm in O [m], of shape (B, 3).
        forces: Contact forces of the hand on the object in P [N], of shape (B, n_c, 3).
    """

    joints: Array
    rotation: Array
    translation: Array
    forces: Array

    def __len__(self) -> int:
        return len(self.joints)

    def take(self, rows: Indices) -> States:
        """Return some of the states."""
        return States(self.joints[rows], self.rotation[rows], self.translation[rows], self.forces[rows])

    def put(self, rows: Indices, other: States) -> States:
        """Return the states with some of them replaced, in order."""
        parts = []
        for mine, theirs in zip(self._parts(), other._parts(), strict=True):
            changed = np.array(mine)
            changed[rows] = theirs
            parts.append(changed)
        return States(*parts)

    def joined(self, other: States) -> States:
        """Return these states and others behind them."""
        return States(*(np.concatenate(pair) for pair in zip(self._parts(), other._parts(), strict=True)))

    def stepped(self, step: Array, lower: Array, upper: Array) -> States:
        """Return the states after a step of shape (B, n_x), joint angles kept within limits of shape (n_q,)."""
        n_q = self.joints.shape[1]
        linear, angular = step[:, n_q : n_q + 3], step[:, n_q + 3 : n_q + 6]
        return States(
            np.clip(self.joints + step[:, :n_q], lower, upper),
            self.rotation @ rotations_exp(angular),
            self.translation + (self.rotation @ linear[:, :, None])[..., 0],
            self.forces + step[:, n_q + 6 :].reshape(self.forces.shape),
        )

    def _parts(self) -> tuple[Array, Array, Array, Array]:
        """Return the arrays."""
        return self.joints, self.rotation, self.translation, self.forces


def rotations_exp(vectors: Array) -> Array:
    """Return the rotations of rotation vectors (Rodrigues' formula), of shapes (B, 3, 3) and (B, 3)."""
    square = np.einsum("bi,bi->b", vectors, vectors)
    angle = np.sqrt(square)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 1.0 - square / 6.0, np.sin(safe) / safe)
    second = np.where(small, 0.5 - square / 24.0, (1.0 - np.cos(safe)) / safe**2)
    skews = cross(vectors[:, None], np.eye(3)).transpose(0, 2, 1)
    return np.eye(3) + first[:, None, None] * skews + second[:, None, None] * (skews @ skews)
