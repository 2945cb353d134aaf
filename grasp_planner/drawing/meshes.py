"""Triangle meshes of a hand's collision geometry and of objects, for pictures; no display code here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..hand.configuration import HandConfiguration
from ..hand.geometry_mesh import geometry_mesh
from ..hand.hand import Hand
from ..objects import GraspObject
from ..spatial import Array, Pose

if TYPE_CHECKING:
    import trimesh


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


def object_mesh(grasp_object: GraspObject) -> trimesh.Trimesh:
    """Return the mesh of an object in O [m]."""
    return grasp_object.mesh
