"""A hand at a posture and a palm pose: where its joints, frames, geometries and contacts are, and how they move.

The one place that asks Pinocchio for kinematics, once and when first needed; whoever wants to know where a part of
a hand is asks it. The search has its own fused form in :mod:`grasp_planner.hand.kinematics`, which the tests
compare with this one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin

from ..checks import finite_array
from ..spatial import Array, Pose, readonly, skew
from ..values import Value
from .contact_frame import ContactFrame
from .hand import Hand


@dataclass(frozen=True, eq=False, repr=False)
class HandConfiguration(Value):
    """A hand at a posture and a palm pose; everything in the object frame O unless said otherwise.

    Attributes:
        hand: The hand.
        q: Independent joint angles [rad], of shape (n_q,).
        palm_pose: Pose T_o_p of the palm frame P in O, a Pose or a pin.SE3; identity if left out.
    """

    hand: Hand
    q: Array
    palm_pose: Pose = field(default_factory=Pose.identity)

    def __post_init__(self) -> None:
        object.__setattr__(self, "q", finite_array("q", self.q, (self.hand.n_joints,)))
        object.__setattr__(self, "palm_pose", Pose.of(self.palm_pose))

    @cached_property
    def root_pose(self) -> Pose:
        """Pose of the root of the URDF."""
        return Pose.of_se3(self._root)

    @cached_property
    def joint_poses(self) -> tuple[Pose, ...]:
        """Poses of the joints in the order of the model; the first is that of the root."""
        return tuple(Pose.of_se3(self._root * placement) for placement in self._data.oMi)

    @cached_property
    def joint_poses_in_parents(self) -> tuple[Pose, ...]:
        """Poses of the joints in the frames of their parent joints, the root's first."""
        return tuple(Pose.of_se3(placement) for placement in self._data.liMi)

    def frame_pose(self, frame_id: int) -> Pose:
        """Return the pose of a frame of the model: a link, a joint or a contact frame, by its index."""
        return Pose.of_se3(self._root * self._data.oMf[frame_id])

    @cached_property
    def geometry_poses(self) -> tuple[Pose, ...]:
        """Poses of the collision geometries, in the order of the collision model."""
        return tuple(Pose.of_se3(placement) for placement in self.geometry_placements())

    def geometry_placements(self) -> list[Any]:
        """Return what :attr:`geometry_poses` holds as new pin.SE3, for coal."""
        model, geometry = self.hand.model, self.hand.collision_model
        data = geometry.createData()
        pin.updateGeometryPlacements(model, self._data, geometry, data)
        return [self._root * placement for placement in data.oMg]

    @cached_property
    def joint_centres(self) -> Array:
        """Origins of the joints without the root's [m], of shape (n_joints, 3)."""
        return readonly([pose.translation for pose in self.joint_poses[1:]])

    @cached_property
    def joint_axes(self) -> Array:
        """Unit axes of the joints, in the order of the model's velocities, of shape (nv, 3)."""
        return readonly(np.array([self.root_pose.rotation @ column for column in self._data.J[3:].T]))

    def contact_centres(self, frames: Sequence[ContactFrame]) -> Array:
        """Return the fingertips, or the centres of their spheres, of contact frames [m], of shape (n_c, 3)."""
        places = self._data.oMf
        return np.array([self._root.act(places[frame.frame_id].act(np.array(frame.offset))) for frame in frames])

    def contact_jacobian(self, frames: Sequence[ContactFrame], points: Array) -> Array:
        """Return J of points that are fixed to the links of contact frames, by the independent joints, palm held.

        Args:
            frames: Contact frames, n_c of them.
            points: The points, of shape (n_c, 3) [m].

        Returns:
            J [m/rad], of shape (3 n_c, n_q).
        """
        return self.contact_twists(frames, points)[:, :3].reshape(3 * len(frames), -1)

    def contact_twists(self, frames: Sequence[ContactFrame], points: Array) -> Array:
        """Return how such points and their links move: velocities, then angular velocities, by the joints.

        Args:
            frames: Contact frames, n_c of them.
            points: The points, of shape (n_c, 3) [m].

        Returns:
            Twists [m/rad; 1], of shape (n_c, 6, n_q).
        """
        turn = self._root.rotation
        found = []
        for frame, point in zip(frames, points, strict=True):
            jacobian = pin.getFrameJacobian(self.hand.model, self._data, frame.frame_id, pin.LOCAL_WORLD_ALIGNED)
            origin = self._root.act(self._data.oMf[frame.frame_id].translation)
            linear, angular = turn @ jacobian[:3], turn @ jacobian[3:]
            found.append(np.vstack([linear - skew(point - origin) @ angular, angular]) @ self.hand.coupling)
        return np.array(found)

    def last_link_vectors(self, frames: Sequence[ContactFrame]) -> Array:
        """Return the vectors from the joints that carry contact frames to their points [m], of shape (n_c, 3)."""
        found = []
        for frame in frames:
            tip = self._data.oMf[frame.frame_id].act(np.array(frame.offset))
            found.append(self._root.rotation @ (tip - self._data.oMi[frame.joint_id].translation))
        return np.array(found)

    @cached_property
    def _root(self) -> Any:
        """Pose of the root of the URDF, pin.SE3."""
        return (self.palm_pose * self.hand.palm_in_root.inverse()).se3()

    @cached_property
    def _data(self) -> Any:
        """Pinocchio's results: joints, frames and joint Jacobians in the root frame."""
        data = self.hand.model.createData()
        pin.computeJointJacobians(self.hand.model, data, self.hand.full_configuration(self.q))
        pin.updateFramePlacements(self.hand.model, data)
        return data
