"""Triangle meshes and surface points of coal geometries."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import coal
import numpy as np

from ..exceptions import InvalidValueError
from ..spatial import Array

if TYPE_CHECKING:
    import trimesh

FINEST = 1e-3
"""Spacing of surface points on small geometries [m]."""
POINTS_ALONG = 60
"""Largest number of surface points along the longest side of a geometry."""


def geometry_mesh(geometry: Any) -> trimesh.Trimesh:
    """Return the mesh of a coal geometry [m].

    Raises:
        InvalidValueError: If its kind is not supported.
    """
    import trimesh

    if isinstance(geometry, coal.Sphere):
        return trimesh.creation.icosphere(subdivisions=2, radius=geometry.radius)
    if isinstance(geometry, coal.Capsule):
        return trimesh.creation.capsule(height=2 * geometry.halfLength, radius=geometry.radius, count=[16, 16])
    if isinstance(geometry, coal.Cylinder):
        return trimesh.creation.cylinder(radius=geometry.radius, height=2 * geometry.halfLength, sections=32)
    if isinstance(geometry, coal.Box):
        return trimesh.creation.box(extents=2 * np.array(geometry.halfSide))
    if isinstance(geometry, coal.BVHModelBase):
        triangles = [[t[0], t[1], t[2]] for t in (geometry.tri_indices(i) for i in range(geometry.num_tris))]
        return trimesh.Trimesh(vertices=np.array(geometry.vertices()), faces=triangles, process=False)
    raise InvalidValueError("geometry", type(geometry).__name__, "Sphere, Capsule, Cylinder, Box or a mesh")


def collision_content(model: Any) -> tuple[Any, ...]:
    """Return what makes two collision models equal: names, joints, placements and shapes of their geometries.

    Not their pickles: coal keeps in a shape what it computed for an earlier question.
    """
    return tuple(
        (
            entry.name,
            entry.parentJoint,
            np.array(entry.placement.homogeneous).tobytes(),
            type(entry.geometry).__name__,
            _shape_content(entry.geometry),
        )
        for entry in model.geometryObjects
    )


def _shape_content(geometry: Any) -> tuple[Any, ...]:
    """Return the sizes of a shape, or the vertices and triangles of a mesh."""
    if isinstance(geometry, coal.BVHModelBase):
        mesh = geometry_mesh(geometry)
        return np.asarray(mesh.vertices).tobytes(), np.asarray(mesh.faces).tobytes()
    return tuple(np.array(getattr(geometry, name, 0.0)).tobytes() for name in ("radius", "halfLength", "halfSide"))


def surface_points(geometry: Any) -> Array:
    """Return points that cover the surface of a coal geometry about evenly, in its frame [m], of shape (n, 3).

    They are 1 mm apart at most, on large geometries a sixtieth of the longest side.
    """
    import trimesh

    mesh = geometry_mesh(geometry)
    spacing = max(FINEST, float(mesh.extents.max()) / POINTS_ALONG)
    points, _ = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, spacing, max_iter=20)
    return np.unique(np.round(np.asarray(points, dtype=float), 7), axis=0)


def link_points(geometries: list[Any]) -> Array:
    """Return surface points of the geometries of one joint, in the frame of the joint [m], of shape (n, 3).

    Args:
        geometries: Entries of a Pinocchio geometry model that one joint carries, at least one.
    """
    placed = [
        surface_points(entry.geometry) @ np.array(entry.placement.rotation).T + entry.placement.translation
        for entry in geometries
    ]
    return np.vstack(placed)
