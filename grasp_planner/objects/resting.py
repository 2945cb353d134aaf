"""How an object stands on a table: on a side of its convex hull over which its centre of mass is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..exceptions import InvalidValueError
from ..spatial import Array, Indices, readonly
from ..values import Value
from .base import GraspObject

if TYPE_CHECKING:
    import trimesh

FLAT = 1e-3
"""Triangles of a hull that lean by less than this are one side [rad]."""
UPRIGHT = float(np.cos(np.radians(5.0)))
"""An object stands as it was drawn, z up, if it can within 5°."""
STEADY = 0.02
"""How far the centre of mass has to be within a side, as a share of its height above it."""


@dataclass(frozen=True, eq=False, repr=False)
class RestingPose(Value):
    """How an object rests on a table.

    Attributes:
        up: Unit direction away from the table, in O, of shape (3,).
        height: Height of the centre of mass above the table [m].
    """

    up: Array
    height: float

    def gravity(self, like: Array) -> Array:
        """Return a gravity towards the table as strong as another one [m/s²], both of shape (3,)."""
        return -float(np.linalg.norm(like)) * self.up


def resting_poses(thing: GraspObject) -> tuple[RestingPose, ...]:
    """Return the poses in which an object stands on one of the flat sides of its hull, the lowest first.

    An object tips over an edge of a side if its centre of mass, the origin of O, is not above the side; of round ones,
    each strip of the triangles is a side.

    Args:
        thing: The object.
    """
    hull = thing.mesh.convex_hull
    found = []
    for side in _sides(hull):
        normal = np.asarray(hull.area_faces[side] @ hull.face_normals[side])
        normal /= np.linalg.norm(normal)
        height = float((np.asarray(hull.vertices[hull.faces[side]]) @ normal).max())
        if height > 0.0 and _room(hull, side, normal) >= STEADY * height:
            found.append(RestingPose(readonly(-normal), height))
    return tuple(sorted(found, key=lambda pose: pose.height))


def resting_pose(thing: GraspObject) -> RestingPose:
    """Return how an object rests: with z up, as it was drawn, if it stands so; otherwise as low as it can.

    Args:
        thing: The object.

    Raises:
        InvalidValueError: If it stands on no side of its hull.
    """
    poses = resting_poses(thing)
    if not poses:
        raise InvalidValueError("table", thing.text, "an object that stands on a side of its hull")
    upright = max(poses, key=lambda pose: float(pose.up[2]))
    return upright if upright.up[2] >= UPRIGHT else poses[0]


def _sides(hull: trimesh.Trimesh) -> list[Indices]:
    """Return the triangles of each flat side of a hull."""
    import trimesh

    flat = hull.face_adjacency[hull.face_adjacency_angles < FLAT]
    return [np.asarray(group) for group in trimesh.graph.connected_components(flat, nodes=np.arange(len(hull.faces)))]


def _room(hull: trimesh.Trimesh, side: Indices, normal: Array) -> float:
    """Return how far inside a side the point below the origin is, negative outside [m]."""
    edges = np.asarray(hull.faces[side])[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    _, place, count = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True, return_counts=True)
    start, end = np.asarray(hull.vertices)[edges[count[place.reshape(-1)] == 1]].swapaxes(0, 1)
    inward = np.cross(normal, end - start)
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    return float((-(start * inward).sum(axis=1)).min())
