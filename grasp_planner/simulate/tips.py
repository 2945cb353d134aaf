"""The fingertips that touch, spheres through the planned contacts, and what else of the hand collides.

A spherical fingertip is its sphere. A point fingertip (radius 0) is a tiny sphere behind the planned point, tangent
there to the object. Its physical link overlaps the object by about the finger's radius, as in the plan, and does
not collide with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import coal
import numpy as np
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from ..collision.link_shapes import LinkShape, link_shapes
from ..grasp.grasp import Grasp
from ..hand.hull_fit import hull_of
from ..spatial import Array

POINT_RADIUS = 5e-4
"""Radius of the sphere that stands for a point fingertip [m]."""
COMPRESSION = 1e-7
"""How far fingertips reach into the object at the plan [m]: contacts then carry their load from the first step on."""
ROUNDING = 1e-5
"""Gaps of the plan up to this are taken for the planner's tolerance and closed [m]."""
PATCH_INSET = 2e-4
"""How much thinner a solid around a spherical fingertip is made, so that the sphere touches first [m]."""


@dataclass(frozen=True)
class Tip:
    """A fingertip as a sphere.

    Attributes:
        name: Name of the contact.
        link: Link whose name counts for pairs that are ignored.
        joint: Joint that carries it.
        centre: Centre in the frame of the joint [m], of shape (3,).
        radius: Radius [m].
        is_point: Whether it stands for a point fingertip.
    """

    name: str
    link: str
    joint: int
    centre: Array
    radius: float
    is_point: bool


def fingertips(grasp: Grasp) -> tuple[Tip, ...]:
    """Return the fingertip of every contact of a grasp, in the order of its contacts."""
    tips = []
    joints, contacts = grasp.configuration.joint_poses, grasp.contacts
    for frame, normal, gap in zip(grasp.problem.frames, contacts.normals, contacts.gaps, strict=True):
        centre = np.array(frame.centre)
        if frame.radius == 0.0:
            centre = centre - POINT_RADIUS * (joints[frame.joint_id].rotation.T @ normal)
        radius = (frame.radius or POINT_RADIUS) + COMPRESSION + (float(gap) if abs(gap) < ROUNDING else 0.0)
        tips.append(Tip(frame.name, frame.frame, frame.joint_id, centre, radius, frame.radius == 0.0))
    return tuple(tips)


def colliding_solids(grasp: Grasp, tips: tuple[Tip, ...]) -> tuple[LinkShape, ...]:
    """Return the solids of a hand that collide besides its fingertips.

    A ball inside a fingertip is left out; a solid that holds one, or the hull of a mesh whose surface one is, is made
    thinner by :data:`PATCH_INSET`.
    """
    kept = []
    patches = {frame.joint_id for frame in grasp.problem.frames if frame.patch is not None}
    for shape in link_shapes(grasp.problem.hand):
        mine = [tip for tip in tips if tip.joint == shape.joint and not tip.is_point]
        if any(_lies_in(shape, tip) for tip in mine):
            continue
        if any(shape.holds(tip.centre, tip.radius - COMPRESSION - ROUNDING) for tip in mine):
            shape = replace(shape, radius=shape.radius - PATCH_INSET)
        if shape.joint in patches and isinstance(shape.geometry, coal.ConvexBase):
            shape = _thinner(shape)
        kept.append(shape)
    return tuple(kept)


def _thinner(shape: LinkShape) -> LinkShape:
    """Return a hull with every face moved inwards by :data:`PATCH_INSET`; a hull too thin for that as it is."""
    points = np.array(shape.geometry.points(), dtype=float)
    walls = ConvexHull(points).equations + np.array([0.0, 0.0, 0.0, PATCH_INSET])
    try:
        inner = HalfspaceIntersection(walls, points.mean(axis=0)).intersections
    except QhullError:
        return shape
    return replace(shape, geometry=hull_of(inner).geometry())


def _lies_in(shape: LinkShape, tip: Tip) -> bool:
    """Return whether a solid is a ball inside a fingertip."""
    if shape.geometry is not None or not np.array_equal(shape.start, shape.end):
        return False
    return float(np.linalg.norm(shape.start - tip.centre)) + shape.radius <= tip.radius + ROUNDING
