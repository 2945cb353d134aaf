"""The decision variables of the search: joint angles, palm pose chart and what makes the forces, as one vector.

``x = (q, w, δσ)`` by eq. (17), ``x = (q, w, f)`` where forces come from springs: q the n_q joint angles [rad]; w a
chart of the palm pose around a fixed one, a translation [m] and a rotation vector [rad] applied on the left, both in
O; δσ the n_s synergy displacements [rad]; f the contact forces in the palm frame [N], where Jᵀ f does not see the
pose. The paper's (σ, δσ, w) has the same feasible set as the first: σ is read off afterwards from
q = q̄ + S σ − C_q τ (10).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..problem.problem import GraspProblem
from ..spatial import Array, rotation_exp, rotation_left_jacobian


@dataclass(frozen=True)
class VariableLayout:
    """Where q, w and δσ or f sit in x.

    Attributes:
        n_joints: n_q.
        n_displacements: n_s, or 0 where forces come from springs.
        n_forces: d n_c where forces come from springs, 3 n_c for hard fingers, else 0.
    """

    n_joints: int
    n_displacements: int
    n_forces: int = 0

    @classmethod
    def of(cls, problem: GraspProblem) -> VariableLayout:
        """Return the layout of a problem."""
        if problem.parameters.force_law == "springs":
            return cls(problem.hand.n_joints, 0, problem.contact_model.dimension * len(problem.frames))
        return cls(problem.hand.n_joints, problem.n_synergies)

    @property
    def size(self) -> int:
        """Number of variables."""
        return self.n_joints + 6 + self.n_displacements + self.n_forces

    @property
    def n_geometric(self) -> int:
        """Number of variables that move something: all but δσ and f."""
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
        return slice(self.n_joints + 6, self.n_joints + 6 + self.n_displacements)

    @property
    def forces(self) -> slice:
        """Contact forces f in the palm frame [N]."""
        return slice(self.n_joints + 6 + self.n_displacements, self.size)


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
