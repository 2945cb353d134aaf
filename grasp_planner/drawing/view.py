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
