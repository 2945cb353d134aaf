"""The decision variables of the search: joint angles, palm pose chart and synergy displacements as one vector.

``x = (q, w, δσ)``: q the n_q joint angles [rad]; w a chart of the palm pose around a fixed one, a translation [m]
and a rotation vector [rad] applied on the left, both in O; δσ the n_s synergy displacements [rad]. The paper's
(σ, δσ, w) has the same feasible set: σ is read off afterwards from q = q̄ + S σ − C_q τ (10).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..spatial import Array, rotation_exp, rotation_left_jacobian


@dataclass(frozen=True)
class VariableLayout:
    """Where q, w and δσ sit in x.

    Attributes:
        n_joints: n_q.
        n_synergies: n_s.
    """

    n_joints: int
    n_synergies: int

    @property
    def size(self) -> int:
        """Number of variables."""
        return self.n_joints + 6 + self.n_synergies

    @property
    def n_geometric(self) -> int:
        """Number of variables that move something: all but δσ."""
        return self.n_joints + 6

    @property
    def joints(self) -> slice:
        """Joint angles q [rad]."""
        return slice(0, self.n_joints)

    @property
    def pose(self) -> slice:
        """Palm pose chart w."""
        return slice(self.n_joints, self.n_joints + 6)

    @property
    def translation(self) -> slice:
        """Translation of the palm [m]."""
        return slice(self.n_joints, self.n_joints + 3)

    @property
    def rotation(self) -> slice:
        """Rotation vector of the palm [rad]."""
        return slice(self.n_joints + 3, self.n_joints + 6)

    @property
    def displacement(self) -> slice:
        """Synergy displacements δσ [rad]."""
        return slice(self.n_joints + 6, self.size)


@dataclass(frozen=True)
class PoseChart:
    """A chart of SE(3) around a reference pose of the palm in O.

    Attributes:
        rotation: Reference rotation, of shape (3, 3).
        translation: Reference translation [m], of shape (3,).
    """

    rotation: Array
    translation: Array

    @classmethod
    def around(cls, pose: pin.SE3) -> PoseChart:
        """Return the chart around a pose."""
        return cls(np.array(pose.rotation), np.array(pose.translation))

    def pose(self, w: Array) -> tuple[Array, Array]:
        """Return rotation (3, 3) and translation [m] (3,) of the palm in O at w, of shape (6,)."""
        return rotation_exp(w[3:]) @ self.rotation, self.translation + w[:3]

    def turn_jacobian(self, w: Array) -> Array:
        """Return the angular velocity of the palm in O per rate of the rotation vector, of shape (3, 3)."""
        return rotation_left_jacobian(w[3:])

    def coordinates(self, pose: pin.SE3) -> Array:
        """Return w of a pose, of shape (6,)."""
        turn = pin.log3(np.array(pose.rotation) @ self.rotation.T)
        return np.concatenate([np.array(pose.translation) - self.translation, turn])
