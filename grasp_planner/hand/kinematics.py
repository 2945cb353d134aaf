"""Where the contact frames are and how they move: positions, Jacobians and their derivatives, in the palm frame.

Pinocchio computes the joint Jacobians; the derivatives follow from them in closed form. For a chain of 1-DoF
joints the second derivative of a point p is ``∂²p/∂q_a∂q_b = ω_a × ∂p/∂q_b`` for a at or before b in the chain,
which is what Pinocchio's kinematic Hessians hold (the tests compare both).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..spatial import Array, skew
from .contact_frame import ContactFrame
from .hand import Hand


@dataclass(frozen=True)
class ContactKinematics:
    """Kinematics of n_c contact frames at one posture; palm frame, derivatives by the n_q independent joints.

    Attributes:
        position: Fingertips: the contact frames' origins, moved by their offsets [m], of shape (n_c, 3).
        linear: ∂position/∂q [m/rad], of shape (n_c, 3, n_q).
        angular: Angular velocity per joint velocity, of shape (n_c, 3, n_q).
        linear_derivative: ∂linear/∂q_k [m/rad²], of shape (n_q, n_c, 3, n_q), k first; empty if not asked for.
        angular_derivative: ∂angular/∂q_k [1/rad], of shape (n_q, n_c, 3, n_q); empty if not asked for.
        placements: Poses of all joints in the root frame, of shape (n_joints + 1, 4, 4).
        twists: Their Jacobian columns (linear, angular) about the root's origin [m/rad, 1], of shape (6, nv).
    """

    position: Array
    linear: Array
    angular: Array
    linear_derivative: Array
    angular_derivative: Array
    placements: Array
    twists: Array


class HandKinematics:
    """Kinematics of some contact frames of a hand, with its own Pinocchio workspace.

    Not for use from several threads at once: each needs its own.
    """

    def __init__(self, hand: Hand, frames: Sequence[ContactFrame]) -> None:
        self.hand = hand
        self.frames = tuple(frames)
        self._data = hand.model.createData()
        supports = [hand.model.supports[frame.joint_id].tolist() for frame in self.frames]
        self._mask = np.zeros((len(supports), 1, hand.model.nv))
        for row, support in enumerate(supports):
            for joint in support[1:]:
                self._mask[row, 0, hand.model.joints[joint].idx_v] = 1.0
        index = np.arange(hand.model.nv)
        self._before = (index[:, None] <= index[None, :]).astype(float)[:, None, None, :]
        self._strictly_before = (index[:, None] < index[None, :]).astype(float)[:, None, None, :]
        self._mounts = np.array([[*frame.centre, 1.0] for frame in self.frames])[:, :, None]
        self._joints = np.array([frame.joint_id for frame in self.frames], dtype=int)
        palm = hand.palm_in_root.inverse()
        self._palm_rotation = np.array(palm.rotation)
        self._palm_translation = np.array(palm.translation)

    def compute(self, q: Array, *, angular: bool = True, derivatives: bool = False) -> ContactKinematics:
        """Evaluate the kinematics at a posture.

        Args:
            q: Independent joint angles [rad], of shape (n_q,).
            angular: Whether derivatives of the angular part are wanted too (fingertips with a radius).
            derivatives: Whether the derivatives of the Jacobians are wanted.

        Returns:
            Positions, Jacobians and, if asked for, their derivatives, in the palm frame.
        """
        hand, data = self.hand, self._data
        pin.computeJointJacobians(hand.model, data, hand.full_configuration(q))
        # Columns of data.J are joint twists about the root's origin; move them into the palm frame and to p.
        rotation = self._palm_rotation
        twists = np.array(data.J)
        omega = rotation @ twists[3:]
        at_origin = rotation @ twists[:3]
        placements = np.array([placement.homogeneous for placement in data.oMi])
        arm = (placements[self._joints] @ self._mounts)[:, :3, 0] @ rotation.T
        linear_full = (at_origin - skew(arm) @ omega) * self._mask
        angular_full = omega * self._mask
        coupling = hand.coupling
        position = arm + self._palm_translation
        linear, angular_part = linear_full @ coupling, angular_full @ coupling
        linear_derivative = angular_derivative = np.empty((0, *linear.shape))
        if derivatives:
            crosses = skew(omega.T)[:, None]
            linear_derivative = self._contract(self._pair_products(crosses, linear_full, symmetric=True))
            if angular:
                angular_derivative = self._contract(self._pair_products(crosses, angular_full, symmetric=False))
        return ContactKinematics(
            position, linear, angular_part, linear_derivative, angular_derivative, placements, twists
        )

    def _pair_products(self, crosses: Array, columns: Array, *, symmetric: bool) -> Array:
        """Return ω_a × column_b for all joints a before b of each contact's chain, of shape (nv, n_c, 3, nv)."""
        products = crosses @ columns
        products *= self._mask.transpose(2, 0, 1)[..., None]
        if not symmetric:
            return products * self._strictly_before
        return products * self._before + (products * self._strictly_before).transpose(3, 1, 2, 0)

    def _contract(self, tensor: Array) -> Array:
        """Contract both joint indices of a (nv, n_c, 3, nv) tensor with the coupling."""
        coupling = self.hand.coupling
        n_v, n_q = coupling.shape
        n_c = tensor.shape[1]
        inner = (tensor.reshape(-1, n_v) @ coupling).reshape(n_v, -1)
        return (coupling.T @ inner).reshape(n_q, n_c, 3, n_q)
