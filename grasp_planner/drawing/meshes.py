"""Triangle meshes of hands and objects, for pictures: collision shapes, boxes with rounded edges."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import coal
import numpy as np

from ..hand.configuration import HandConfiguration
from ..hand.geometry_mesh import geometry_mesh
from ..hand.hand import Hand
from ..objects import GraspObject
from ..spatial import Array, Pose

if TYPE_CHECKING:
    import trimesh


FILLET, LARGEST_FILLET = 0.3, 0.008
"""Radius of the rounded edges of a box, as a share of its shortest half side, and at most [m]."""
ARC = 5
"""Points of a rounded edge."""


@dataclass(frozen=True)
class LinkMesh:
    """The mesh of one collision geometry.

    Attributes:
        name: Name of the geometry.
        link: Link it belongs to.
        mesh: Mesh in the frame of the geometry [m].
        geometry_id: Index in the hand's collision model.
    """

    name: str
    link: str
    mesh: trimesh.Trimesh
    geometry_id: int


def link_meshes(hand: Hand) -> tuple[LinkMesh, ...]:
    """Return meshes of all collision geometries of a hand."""
    model = hand.collision_model
    return tuple(
        LinkMesh(entry.name, hand.model.frames[entry.parentFrame].name, drawn_mesh(entry.geometry), index)
        for index, entry in enumerate(model.geometryObjects)
    )


def drawn_mesh(geometry: Any) -> trimesh.Trimesh:
    """Return a collision geometry as it is drawn [m]: corners shared for smooth shading, edges of boxes rounded."""
    if isinstance(geometry, coal.Box):
        x, y, z = (float(value) for value in geometry.halfSide)
        return rounded_box((x, y, z))
    mesh = geometry_mesh(geometry)
    mesh.merge_vertices()
    return mesh


@lru_cache(maxsize=64)
def _rounded_box(half: tuple[float, float, float]) -> trimesh.Trimesh:
    """Return a box with rounded edges; see :func:`rounded_box`."""
    import trimesh

    sides = np.array(half)
    radius = min(FILLET * float(sides.min()), LARGEST_FILLET)
    inner = sides - radius
    # Where a grid on the box is pulled onto the sphere around the nearest point of the inner box.
    turns = np.tan(np.linspace(0.0, np.pi / 4.0, ARC))
    vertices: list[Array] = []
    faces: list[Array] = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            others = [k for k in range(3) if k != axis]
            lines = [np.concatenate([-inner[k] - radius * turns[::-1], inner[k] + radius * turns]) for k in others]
            grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
            points = np.full((*grid.shape[:2], 3), sign * sides[axis])
            points[..., others] = grid
            rows, columns = grid.shape[:2]
            corner = np.arange(rows * columns).reshape(rows, columns)[:-1, :-1].ravel() + sum(
                len(each) for each in vertices
            )
            a, b, c, d = corner, corner + columns, corner + columns + 1, corner + 1
            quads = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
            # Counter-clockwise from outside.
            faces.append(quads if (sign > 0.0) == (axis != 1) else quads[:, ::-1])
            vertices.append(points.reshape(-1, 3))
    points = np.concatenate(vertices)
    nearest = np.clip(points, -inner, inner)
    away = points - nearest
    points = nearest + radius * away / np.linalg.norm(away, axis=1, keepdims=True)
    mesh = trimesh.Trimesh(points, np.concatenate(faces), process=False)
    mesh.merge_vertices()
    return mesh


def rounded_box(half: tuple[float, float, float]) -> trimesh.Trimesh:
    """Return a box with rounded edges, inside the box itself and touching all its sides.

    Args:
        half: Its half sides [m].
    """
    return _rounded_box(half).copy()


def link_placements(hand: Hand, q: Array, palm_in_object: Pose) -> tuple[Pose, ...]:
    """Return the poses of all collision geometries in O.

    Args:
        hand: The hand.
        q: Independent joint angles [rad], of shape (n_q,).
        palm_in_object: Pose of the palm frame in O.

    Returns:
        One pose for each geometry of the collision model, in its order.
    """
    return HandConfiguration(hand, q, palm_in_object).geometry_poses


def object_mesh(grasp_object: GraspObject) -> trimesh.Trimesh:
    """Return the mesh of an object in O [m]."""
    return grasp_object.mesh
