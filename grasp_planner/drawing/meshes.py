"""Triangle meshes of a hand's collision geometry and of objects, for pictures; no display code here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import trimesh

from ..exceptions import InvalidValueError
from ..hand.configuration import HandConfiguration
from ..hand.hand import Hand
from ..objects import GraspObject
from ..spatial import Array, Pose


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
        LinkMesh(entry.name, hand.model.frames[entry.parentFrame].name, geometry_mesh(entry.geometry), index)
        for index, entry in enumerate(model.geometryObjects)
    )


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


def geometry_mesh(geometry: Any) -> trimesh.Trimesh:
    """Return the mesh of a coal geometry [m].

    Raises:
        InvalidValueError: If its kind is not supported.
    """
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


def object_mesh(grasp_object: GraspObject) -> trimesh.Trimesh:
    """Return the mesh of an object in O [m]."""
    return grasp_object.mesh
