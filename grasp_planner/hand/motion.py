"""How the independent joints of a plain URDF move points of its links, before there is a hand description."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from ..spatial import Array
from .coupling import joint_coupling, joint_limits
from .urdf_file import UrdfFile


@dataclass(frozen=True)
class HandMotion:
    """The joints of a hand with their coupling and limits.

    Attributes:
        model: Pinocchio model with all joints free.
        collision_model: Its collision geometries.
        joints: Names of the independent joints.
        coupling: From independent to all joint values, of shape (nv, n_q).
        offset: Values of all joints at q = 0 [rad or m], of shape (nv,).
        lower: Lower limits of the independent joints [rad or m], of shape (n_q,).
        upper: Upper limits [rad or m], of shape (n_q,).
    """

    model: Any
    collision_model: Any
    joints: tuple[str, ...]
    coupling: Array
    offset: Array
    lower: Array
    upper: Array

    @classmethod
    def of(cls, urdf: UrdfFile) -> HandMotion:
        """Return the motion of a URDF, its independent joints in the order of the model.

        Raises:
            InvalidValueError: If limits of coupled joints leave one no range.
        """
        joints = tuple(name for name in tuple(urdf.model.names)[1:] if name not in urdf.mimics)
        coupling, offset = joint_coupling(urdf.model, joints, urdf.mimics)
        limits = joint_limits(urdf.model, joints, coupling, offset)
        return cls(urdf.model, urdf.collision_model, joints, coupling, offset, *limits)

    @property
    def open(self) -> Array:
        """Zero, or the limit nearest to it, of every independent joint [rad or m], of shape (n_q,)."""
        return np.clip(np.zeros(len(self.joints)), self.lower, self.upper)

    def poses(self, q: Array) -> list[pin.SE3]:
        """Return the poses of all joints in the root frame at q [rad or m] of shape (n_q,); the first is the root."""
        data = self.model.createData()
        pin.forwardKinematics(self.model, data, self.coupling @ q + self.offset)
        return [pin.SE3(pose) for pose in data.oMi]

    def axes(self, q: Array) -> Array:
        """Return the axes of all joints in the root frame, of shape (nv, 3); zero for those that slide."""
        data = self.model.createData()
        pin.computeJointJacobians(self.model, data, self.coupling @ q + self.offset)
        return np.array(data.J)[3:].T

    def slides(self) -> Array:
        """Return which joints of the model slide, of shape (nv,)."""
        return np.array([joint.shortname().startswith("JointModelP") for joint in self.model.joints[1:]])

    def points(self, q: Array, joints: list[int], local: Array) -> Array:
        """Return points fixed to joints in the root frame.

        Args:
            q: Independent joint values [rad or m], of shape (n_q,).
            joints: Joint of each point.
            local: The points in the frames of their joints [m], of shape (n, 3).

        Returns:
            The points [m], of shape (n, 3).
        """
        data = self.model.createData()
        pin.forwardKinematics(self.model, data, self.coupling @ q + self.offset)
        return np.array([data.oMi[joint].act(point) for joint, point in zip(joints, local, strict=True)])

    def chain(self, joint: int) -> list[int]:
        """Return the joints of the model from the root to a joint, the root left out."""
        return [k for k in self.model.supports[joint].tolist() if k > 0]

    def drives(self, joint: int) -> Array:
        """Return the independent joints that move a joint's link, as a mask of shape (n_q,)."""
        return np.abs(self.coupling[[k - 1 for k in self.chain(joint)]]).sum(axis=0) > 0.0
