"""The hand in the scene: a tree of joint frames with matte collision shapes, so that moving it is cheap."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import trimesh
import viser

from ...drawing import look
from ...drawing.meshes import drawn_mesh, link_meshes
from ...hand.configuration import HandConfiguration
from ...hand.hand import Hand
from ...spatial import Array, Pose


class HandDrawing:
    """One hand, opaque with a mesh for each geometry, or a ghost with one for each joint.

    To be used from one thread: it keeps a Pinocchio workspace.

    Attributes:
        meshes: Handles of the geometries by name; empty for a ghost.
        links: Link of each geometry.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        hand: Hand,
        *,
        ghost: look.Colour | None = None,
        whole: bool = True,
        visible: bool = True,
    ) -> None:
        """Add a hand to the scene.

        Args:
            scene: The scene.
            name: Name of its root node.
            hand: The hand.
            ghost: Colour of a ghost; None for the hand itself.
            whole: Whether a ghost has a palm, or fingers only.
            visible: Whether it is shown at once.
        """
        self.hand, self._whole = hand, whole
        self.meshes: dict[str, viser.MeshHandle] = {}
        self.links: dict[str, str] = {}
        self._colours: dict[str, look.Colour] = {}
        self._usual: dict[str, look.Colour] = {}
        # Of the standard contacts only: those of power grasps are on every link.
        self._tips = {frame.joint_id for frame in hand.contact_frames(None)}
        self._root = scene.add_frame(name, show_axes=False, visible=visible)
        self._placements = (Pose.identity(),) * hand.model.njoints
        self._joints = self._add_joints(scene, name)
        if ghost is None:
            self._add_links(scene)
        else:
            self._add_ghost(scene, ghost)

    @property
    def visible(self) -> bool:
        """Whether it is shown."""
        return bool(self._root.visible)

    @visible.setter
    def visible(self, shown: bool) -> None:
        if self._root.visible != shown:
            self._root.visible = shown

    def move(self, configuration: HandConfiguration, frame: Pose) -> None:
        """Show the hand where it is.

        Args:
            configuration: Posture and place of the hand in a frame.
            frame: Pose of that frame in the world.
        """
        placements = frame * configuration.root_pose, *configuration.joint_poses_in_parents[1:]
        for node, before, now in zip((self._root, *self._joints.values()), self._placements, placements, strict=True):
            if not np.array_equal(now.rotation, before.rotation):
                node.wxyz = quaternion_wxyz(now)
            if not np.array_equal(now.translation, before.translation):  # joints that turn stay where they are
                node.position = now.translation
        self._placements = placements

    def paint(self, special: dict[str, look.Colour]) -> None:
        """Colour the geometries of some links and give the others their usual colour.

        Args:
            special: Colour by link name.
        """
        for name, mesh in self.meshes.items():
            colour = special.get(self.links[name], self._usual[name])
            if colour != self._colours[name]:
                self._colours[name] = colour
                mesh.color = colour

    def remove(self) -> None:
        """Take it out of the scene."""
        self._root.remove()

    def _add_joints(self, scene: viser.SceneApi, name: str) -> dict[int, viser.FrameHandle]:
        """Add a frame for every joint below that of its parent."""
        model = self.hand.model
        self._paths = {0: name}
        frames = {}
        for joint in range(1, model.njoints):
            self._paths[joint] = f"{self._paths[model.parents[joint]]}/joint_{joint}"
            frames[joint] = scene.add_frame(self._paths[joint], show_axes=False)
        return frames

    def _add_links(self, scene: viser.SceneApi) -> None:
        """Add a mesh for every geometry."""
        geometries = self.hand.collision_model.geometryObjects
        for entry in link_meshes(self.hand):
            geometry = geometries[entry.geometry_id]
            self.links[entry.name] = entry.link
            self._colours[entry.name] = self._usual[entry.name] = self._usual_colour(entry.link)
            mesh = entry.mesh
            handle = scene.add_mesh_simple(
                f"{self._paths[geometry.parentJoint]}/link_{entry.geometry_id}",
                np.array(mesh.vertices),
                np.array(mesh.faces),
                color=self._colours[entry.name],
            )
            place(handle, geometry.placement)
            self.meshes[entry.name] = handle

    def _add_ghost(self, scene: viser.SceneApi, colour: look.Colour) -> None:
        """Add one translucent mesh for all geometries of a joint."""
        parts: dict[int, list[trimesh.Trimesh]] = {}
        for geometry in self.hand.collision_model.geometryObjects:
            if geometry.parentJoint == 0 and not self._whole:
                continue
            mesh = drawn_mesh(geometry.geometry)
            mesh.apply_transform(geometry.placement.homogeneous)
            parts.setdefault(geometry.parentJoint, []).append(mesh)
        for joint, meshes in parts.items():
            whole = trimesh.util.concatenate(meshes)
            scene.add_mesh_simple(
                f"{self._paths[joint]}/ghost",
                np.array(whole.vertices),
                np.array(whole.faces),
                color=colour,
                opacity=look.GHOST_OPACITY,
                scale=look.GHOST_SCALE,
                cast_shadow=False,
                receive_shadow=False,
            )

    def _usual_colour(self, link: str) -> look.Colour:
        """Return the colour of a link when nothing is special about it."""
        if link == self.hand.description.palm.link:
            return look.PALM
        joint = self.hand.model.frames[self.hand.model.getFrameId(link, pin.FrameType.BODY)].parentJoint
        return look.PAD if joint in self._tips else look.HAND


def place(handle: Any, pose: Pose) -> None:
    """Put a scene node at a pose in the frame of its parent."""
    handle.position = np.array(pose.translation)
    handle.wxyz = quaternion_wxyz(pose)


def quaternion_wxyz(pose: Pose) -> Array:
    """Return the orientation of a pose in viser's order (w, x, y, z)."""
    x, y, z, w = pin.Quaternion(np.array(pose.rotation)).coeffs()
    return np.array([w, x, y, z])


def pose_of(handle: Any) -> Pose:
    """Return the pose of a scene node in the frame of its parent."""
    w, x, y, z = np.asarray(handle.wxyz, dtype=float)
    rotation = pin.Quaternion(np.array([x, y, z, w])).normalized().matrix()
    return Pose(rotation, np.array(handle.position, dtype=float))
