"""A batch of states of the springs problem: postures, palm poses, contact forces; and steps away from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..spatial import Array, Indices, namespace
from .tree import cross


@dataclass(frozen=True)
class States:
    """B states; a step is x = (q, v, w, f) with v and w the twist of the palm in its own frame.

    Attributes:
        joints: q [rad], of shape (B, n_q).
        rotation: Rotation of the palm in O, of shape (B, 3, 3).
        translation: Position of the palm in O [m], of shape (B, 3).
        forces: Contact forces of the hand on the object in P [N], of shape (B, n_c, 3).
        most_force: F that each state may take [N], infinite where that is open, of shape (B,).
    """

    joints: Array
    rotation: Array
    translation: Array
    forces: Array
    most_force: Array

    def __len__(self) -> int:
        return len(self.joints)

    def take(self, rows: Indices) -> States:
        """Return some of the states."""
        return States(*(part[rows] for part in self._parts()))

    def replaced(self, where: npt.NDArray[np.bool_], other: States) -> States:
        """Return the states, those of another batch, which is used up, where a mask of shape (B,) says so."""
        pairs = zip(self._parts(), other._parts(), strict=True)
        return States(*(chosen(where, theirs, mine) for mine, theirs in pairs))

    def joined(self, *others: States) -> States:
        """Return these states and others behind them."""
        xp, parts = namespace(self.joints), (states._parts() for states in (self, *others))
        return States(*(xp.concatenate(each) for each in zip(*parts, strict=True)))

    def stepped(self, step: Array, lower: Array, upper: Array) -> States:
        """Return the states after a step of shape (B, n_x), joint angles kept within limits of shape (n_q,)."""
        n_q = self.joints.shape[1]
        linear, angular = step[:, n_q : n_q + 3], step[:, n_q + 3 : n_q + 6]
        return States(
            namespace(step).clip(self.joints + step[:, :n_q], lower, upper),
            self.rotation @ rotations_exp(angular),
            self.translation + (self.rotation @ linear[:, :, None])[..., 0],
            self.forces + step[:, n_q + 6 :].reshape(self.forces.shape),
            self.most_force,
        )

    def _parts(self) -> tuple[Array, ...]:
        """Return the arrays."""
        return self.joints, self.rotation, self.translation, self.forces, self.most_force


def rotations_exp(vectors: Array) -> Array:
    """Return the rotations of rotation vectors (Rodrigues' formula), of shapes (B, 3, 3) and (B, 3)."""
    xp = namespace(vectors)
    square = xp.einsum("bi,bi->b", vectors, vectors)
    angle = xp.sqrt(square)
    small = angle < 1e-4
    safe = xp.where(small, 1.0, angle)
    first = xp.where(small, 1.0 - square / 6.0, xp.sin(safe) / safe)
    second = xp.where(small, 0.5 - square / 24.0, (1.0 - xp.cos(safe)) / safe**2)
    skews = cross(vectors[:, None], np.eye(3)).transpose(0, 2, 1)
    return np.eye(3) + first[:, None, None] * skews + second[:, None, None] * (skews @ skews)


def chosen(where: npt.NDArray[np.bool_], first: Array, second: Array) -> Array:
    """Return the first array's rows where a mask of shape (B,) says so and the second's elsewhere, both (B, …).

    The first is used up: NumPy is several times faster at writing the second's few rows into it than at a new array.
    """
    if isinstance(first, np.ndarray):
        rows = np.flatnonzero(~where)
        first[rows] = second[rows]
        return first
    return namespace(first).where(where.reshape(-1, *(1 for _ in first.shape[1:])), first, second)
