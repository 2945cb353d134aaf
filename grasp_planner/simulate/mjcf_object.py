"""An object as MJCF: exact primitives, unions of primitives for rounded boxes, convex pieces for meshes.

A cylinder is there twice: fingertips touch its exact side, links a hull with the rounded rims they keep clear of.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any, Literal

import numpy as np

from ..exceptions import InvalidValueError
from ..objects import Box, Capsule, Cylinder, EllipsoidObject, GraspObject, Sphere
from ..spatial import Array
from .convex_pieces import convex_pieces
from .xml_text import Element, add

RIM_POINTS, RIM_SECTIONS = 7, 96
"""Points of a rounded rim: across its quarter circle, and around the cylinder."""


@dataclass(frozen=True)
class ObjectSolid:
    """One convex solid of an object, in O.

    Attributes:
        kind: MuJoCo's name of its type.
        size: MuJoCo's sizes [m].
        fromto: Ends of its axis [m], for capsules of a box's edges.
        vertices: Corners whose convex hull it is [m], of shape (n, 3), for ``mesh``.
        touched_by: What of the hand collides with it: the fingertips (``tips``), the other ``links``, or ``all``.
    """

    kind: str
    size: tuple[float, ...] = ()
    fromto: tuple[float, ...] = ()
    vertices: Array | None = None
    touched_by: Literal["tips", "links", "all"] = "all"


def object_solids(grasp_object: GraspObject) -> tuple[tuple[ObjectSolid, ...], str]:
    """Return the convex solids whose union stands for an object, and a note on how exact it is.

    Args:
        grasp_object: The object.

    Returns:
        The solids and the note.

    Raises:
        InvalidValueError: If there is no way to simulate such an object.
    """
    if isinstance(grasp_object, Sphere):
        return (ObjectSolid("sphere", (grasp_object.radius,)),), "exact sphere"
    if isinstance(grasp_object, Cylinder):
        note = "exact cylinder; its rims are sharp for fingertips" if grasp_object.caps else "exact cylinder"
        return _cylinder(grasp_object), note
    if isinstance(grasp_object, Capsule):
        return (ObjectSolid("capsule", (grasp_object.radius, grasp_object.height / 2)),), "exact capsule"
    if isinstance(grasp_object, EllipsoidObject):
        return (ObjectSolid("ellipsoid", (grasp_object.x, grasp_object.y, grasp_object.z)),), "exact ellipsoid"
    if isinstance(grasp_object, Box):
        return _rounded_box(grasp_object), "exact box: its rounded edges are capsules"
    return _mesh(grasp_object)


def add_object(world: Element, grasp_object: GraspObject, mass: float, solids: tuple[ObjectSolid, ...]) -> list[str]:
    """Add an object as a free body at the origin, its centre of mass.

    Args:
        world: The world body.
        grasp_object: The object.
        mass: Its mass in the simulation [kg]; the inertia is that of the same density distribution.
        solids: Its solids.

    Returns:
        Names of the geometries.
    """
    body = add(world, "body", name="object")
    add(body, "freejoint", name="object_free")
    moments = np.array(grasp_object.inertia) * (mass / grasp_object.mass)
    full = [moments[0, 0], moments[1, 1], moments[2, 2], moments[0, 1], moments[0, 2], moments[1, 2]]
    add(body, "inertial", pos=[0.0, 0.0, 0.0], mass=mass, fullinertia=full)
    names = []
    for number, solid in enumerate(solids):
        attributes: dict[str, Any] = {"size": solid.size} if solid.size else {}
        if solid.fromto:
            attributes["fromto"] = solid.fromto
        if solid.vertices is not None:
            attributes["mesh"] = f"mesh_object_{number}"
        names.append(f"object_{number}")
        add(body, "geom", name=names[-1], type=solid.kind, **attributes)
    return names


def _cylinder(cylinder: Cylinder) -> tuple[ObjectSolid, ...]:
    """Return the exact cylinder for fingertips and a hull with rounded rims for the other links."""
    size = (cylinder.radius, cylinder.height / 2)
    if cylinder.edge == 0.0:
        return (ObjectSolid("cylinder", size),)
    bend = np.linspace(0.0, np.pi / 2, RIM_POINTS)
    around = np.arange(RIM_SECTIONS) * 2.0 * np.pi / RIM_SECTIONS
    radii = cylinder.radius - cylinder.edge * (1.0 - np.cos(bend))
    heights = cylinder.height / 2 - cylinder.edge * (1.0 - np.sin(bend))
    ring = np.array([(np.cos(a) * r, np.sin(a) * r, h) for a in around for r, h in zip(radii, heights, strict=True)])
    hull = np.vstack([ring, ring * [1.0, 1.0, -1.0]])
    return ObjectSolid("cylinder", size, touched_by="tips"), ObjectSolid("mesh", vertices=hull, touched_by="links")


def _rounded_box(box: Box) -> tuple[ObjectSolid, ...]:
    """Return three boxes, one for each pair of faces, and a capsule for each edge: together exactly the rounded box."""
    half, edge = box.half_extents, box.edge
    core = np.maximum(half - edge, 1e-6)  # MuJoCo has no boxes and capsules of size zero
    solids = []
    for axis in range(3):
        size = np.array(core)
        size[axis] = half[axis]
        solids.append(ObjectSolid("box", tuple(float(value) for value in size)))
    for axis in range(3):
        first, second = (other for other in range(3) if other != axis)
        for sign_1, sign_2 in product((-1.0, 1.0), repeat=2):
            start = np.zeros(3)
            start[first], start[second] = sign_1 * core[first], sign_2 * core[second]
            end = np.array(start)
            start[axis], end[axis] = -core[axis], core[axis]
            solids.append(ObjectSolid("capsule", (edge,), tuple(float(v) for v in (*start, *end))))
    return tuple(solids)


@lru_cache(maxsize=4)
def _mesh(grasp_object: GraspObject) -> tuple[tuple[ObjectSolid, ...], str]:
    """Return the convex pieces of a mesh; the same object is often simulated several times."""
    mesh = grasp_object.mesh
    if not len(mesh.vertices):
        raise InvalidValueError("object", grasp_object.text, "an object with a mesh")
    if mesh.is_convex:
        return (ObjectSolid("mesh", vertices=np.array(mesh.vertices)),), "convex mesh, exact"
    found = convex_pieces(mesh)
    what = f"{len(found.corners)} convex pieces" if len(found.corners) > 1 else "convex hull"
    note = f"{what} of the mesh, standing out of it by up to {1e3 * found.standing_out:.1f} mm where it is hollow"
    return tuple(ObjectSolid("mesh", vertices=corners) for corners in found.corners), note
