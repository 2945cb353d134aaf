"""What a picture is made from: meshes with colours, and a camera."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import trimesh

from ..spatial import Array
from .look import Colour

NEAR = 1e-3
"""Triangles nearer than this to the eye are left out [m]."""


FILLED = 0.93
"""Share of a picture that what is seen may fill."""


@dataclass(frozen=True)
class DrawnMesh:
    """A mesh with a colour, in the world.

    Attributes:
        mesh: The triangles [m].
        colour: Its colour.
        opacity: 1 for what hides what is behind it.
        smooth: Whether it is shaded as a curved surface.
        floor: Whether it shows nothing but shadows.
    """

    mesh: trimesh.Trimesh
    colour: Colour
    opacity: float = 1.0
    smooth: bool = True
    floor: bool = False

    @cached_property
    def corner_normals(self) -> Array:
        """Unit normals at the corners of all triangles, of shape (m, 3, 3)."""
        if self.smooth:
            return np.asarray(self.mesh.vertex_normals)[self.mesh.faces]
        return np.repeat(np.asarray(self.mesh.face_normals)[:, None], 3, axis=1)


@dataclass(frozen=True)
class View:
    """A camera.

    Attributes:
        eye: Where it stands [m].
        target: What it looks at [m].
        field_of_view: Vertical angle of view [rad]; 0 for parallel rays.
        width: Of the picture [pixels].
        height: Of the picture [pixels].
        reach: Half height that is seen with parallel rays [m].
    """

    eye: Array
    target: Array
    field_of_view: float
    width: int
    height: int
    reach: float = 0.0

    @cached_property
    def axes(self) -> Array:
        """Right, up and backward of the picture in the world, as rows, of shape (3, 3)."""
        back = (self.eye - self.target) / np.linalg.norm(self.eye - self.target)
        upright = np.array([0.0, 0.0, 1.0]) if abs(back[2]) < 0.999 else np.array([0.0, 1.0, 0.0])
        right = np.cross(upright, back)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back])

    def project(self, points: Array) -> Array:
        """Return pixel coordinates (from the upper left) and depths of points in the world [m], of shape (…, 3)."""
        seen = (points - self.eye) @ self.axes.T
        depth = -seen[..., 2]
        if self.field_of_view:
            half = np.tan(self.field_of_view / 2.0) * np.maximum(depth, NEAR)
        else:
            half = np.full(depth.shape, self.reach)
        scale = self.height / 2.0 / half
        across, down = self.width / 2.0 + seen[..., 0] * scale, self.height / 2.0 - seen[..., 1] * scale
        return np.stack([across, down, depth], axis=-1)


def fitted(points: Array, direction: Array, field_of_view: float, aspect: float) -> tuple[Array, Array]:
    """Return eye and target of a view along which points fill the picture and none is cut off.

    Args:
        points: What is to be seen [m], of shape (n, 3).
        direction: From what is seen towards the eye.
        field_of_view: Vertical angle of view [rad].
        aspect: Width of the picture by its height.

    Returns:
        Both [m], of shape (3,).
    """
    target = (points.min(axis=0) + points.max(axis=0)) / 2.0
    unit = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    axes = View(unit, np.zeros(3), field_of_view, 1, 1).axes
    tangents = FILLED * np.tan(field_of_view / 2.0) * np.array([aspect, 1.0])
    distance = 0.0
    for _ in range(5):
        seen = (points - target) @ axes.T
        distance = float((seen[:, 2] + (np.abs(seen[:, :2]) / tangents).max(axis=1)).max())
        relative = seen[:, :2] / (distance - seen[:, 2])[:, None]
        middle = (relative.min(axis=0) + relative.max(axis=0)) / 2.0
        target = target + distance * middle @ axes[:2]
    seen = (points - target) @ axes.T
    distance = float((seen[:, 2] + (np.abs(seen[:, :2]) / tangents).max(axis=1)).max())
    return target + distance * unit, target
