"""The solids of a hand as the clearance constraints see them: swept segments where possible, coal shapes otherwise.

A sphere is a point with a radius, a capsule a segment with a radius; a mesh is held by a few capsules where they fit
it, otherwise by its convex hull. Every other shape (box, cylinder) keeps its coal geometry. Solids that lie inside
another one of the same link are left out.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from ..hand.contact_frame import ContactFrame
from ..hand.hand import Hand
from ..hand.hull_fit import FittedHull, hull_of
from ..spatial import Array, rotation_between

SET_BACK = 5e-5
"""How much farther than the margin what stands for a touching mesh stays behind the plane of contact [m]."""
PATCH_SLACK = 1e-4
"""A solid closer than this to a contact patch belongs to it [m]."""


@dataclass(frozen=True, eq=False)
class LinkShape:
    """One solid, in the frame of the joint that carries it.

    Attributes:
        name: Name of the collision geometry.
        link: Link it belongs to.
        joint: Index of the carrying joint in the Pinocchio model; 0 is the palm.
        branch: Index of the first joint of its finger; 0 is the palm.
        start: One end of its axis [m], of shape (3,); for other shapes the centre of its bounding box.
        end: Other end [m], of shape (3,); equal to ``start`` for spheres and other shapes.
        radius: Radius around the axis [m]; for other shapes that of the sphere around its bounding box.
        corners: Corners whose convex hull, inflated by ``rim``, holds the solid [m], of shape (k, 3).
        rim: See ``corners`` [m].
        geometry: coal geometry; None for spheres and capsules.
        placement: Pose of the coal geometry in the frame of the joint, pin.SE3.
        fitted: Whether it stands for a mesh, which it holds.
    """

    name: str
    link: str
    joint: int
    branch: int
    start: Array
    end: Array
    radius: float
    corners: Array
    rim: float
    geometry: Any
    placement: Any
    fitted: bool = False

    def holds(self, point: Array, radius: float) -> bool:
        """Return whether a ball in the frame of the joint lies inside the solid (spheres and capsules only)."""
        return self.geometry is None and self.axis_distance(point) + radius <= self.radius + 1e-9

    def axis_distance(self, point: Array) -> float:
        """Return the distance of a point in the frame of the joint from the axis [m]."""
        along = self.end - self.start
        fraction = np.clip((point - self.start) @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
        return float(np.linalg.norm(point - self.start - fraction * along))

    def meets(self, point: Array, radius: float) -> bool:
        """Return whether a ball in the frame of the joint touches the solid."""
        if self.geometry is None:
            return self.axis_distance(point) < self.radius + radius + PATCH_SLACK
        inside = self.placement.inverse().act(point)
        low, high = bounding_box(self.geometry)
        return bool(np.linalg.norm(inside - np.clip(inside, low, high)) < radius + PATCH_SLACK)


def link_shapes(hand: Hand) -> tuple[LinkShape, ...]:
    """Return the solids of a hand, without those that lie inside another one."""
    shapes = [shape for entry in hand.collision_model.geometryObjects for shape in _shapes(hand, entry)]
    kept: list[LinkShape] = []
    for index, shape in enumerate(shapes):
        others = [other for k, other in enumerate(shapes) if k != index and other.joint == shape.joint]
        ball = shape.geometry is None and np.array_equal(shape.start, shape.end)
        if not (ball and any(other.holds(shape.start, shape.radius) for other in others)):
            kept.append(shape)
    return tuple(kept)


def joint_centres(hand: Hand) -> tuple[LinkShape, ...]:
    """Return the joint centres as points without a radius, each once, for the paper's own form of Remark 2."""
    points = []
    for joint in range(1, hand.model.njoints):
        placement = hand.model.jointPlacements[joint]
        parent = hand.model.parents[joint]
        if parent > 0 and np.allclose(placement.translation, 0.0, atol=1e-6):
            continue  # same centre as the joint before
        link, zero = hand.model.names[joint], np.zeros(3)
        branch = int(hand.model.supports[joint].tolist()[1])
        identity = placement.Identity()
        points.append(LinkShape(link, link, joint, branch, zero, zero, 0.0, zero[None], 0.0, None, identity))
    return tuple(points)


def shape_pairs(hand: Hand, shapes: tuple[LinkShape, ...]) -> tuple[tuple[int, int], ...]:
    """Return the pairs of solids that must not meet: of different links, and not ignored by the description.

    What stands for meshes and overlaps with the hand at rest is left to the judge, who has the meshes.
    """
    ignored = {frozenset(pair) for pair in hand.description.collision.ignore}
    placed = _at_rest(hand, shapes) if any(shape.fitted for shape in shapes) else ()
    return tuple(
        (i, j)
        for j, second in enumerate(shapes)
        for i, first in enumerate(shapes[:j])
        if first.link != second.link
        and first.joint != second.joint
        and frozenset((first.link, second.link)) not in ignored
        and not ((first.fitted or second.fitted) and _overlap(placed[i], placed[j]))
    )


def _at_rest(hand: Hand, shapes: tuple[LinkShape, ...]) -> tuple[Any, ...]:
    """Return coal geometry and pose of each solid with every joint at zero or the limit nearest to it."""
    data, q = hand.model.createData(), np.clip(np.zeros(hand.n_joints), hand.lower, hand.upper)
    pin.forwardKinematics(hand.model, data, hand.full_configuration(q))
    placed = []
    for shape in shapes:
        pose = data.oMi[shape.joint] * shape.placement
        geometry = shape.geometry or coal.Capsule(shape.radius, float(np.linalg.norm(shape.end - shape.start)))
        placed.append((geometry, coal.Transform3s(np.array(pose.rotation), np.array(pose.translation))))
    return tuple(placed)


def _overlap(first: Any, second: Any) -> bool:
    """Return whether two placed solids overlap: capsules around neighbours can where the links themselves do not."""
    return bool(coal.collide(*first, *second, coal.CollisionRequest(), coal.CollisionResult()))


def contact_shapes(hand: Hand, shapes: Iterable[LinkShape], frames: Iterable[ContactFrame]) -> frozenset[str]:
    """Return the names of the solids that carry a contact patch, which is meant to touch the object.

    Where a ball or a capsule carries it, other shapes around it do not, and keep clear.
    """
    touching: set[str] = set()
    for frame in frames:
        centre = np.array(frame.centre)
        near = [shape for shape in shapes if shape.joint == frame.joint_id and shape.meets(centre, frame.radius)]
        round_ones = [shape for shape in near if shape.geometry is None]
        touching |= {shape.name for shape in round_ones or near}
    return frozenset(touching)


def guarded_shapes(
    hand: Hand, shapes: tuple[LinkShape, ...], frames: Iterable[ContactFrame], margin: float, *, convex: bool = False
) -> tuple[LinkShape, ...]:
    """Return the solids that keep clear of the object.

    Those that carry a contact patch are left out. What stands for a mesh that touches with a known normal stays, set
    back behind the plane of contact: the mesh itself does not reach beyond it, what stands for it would. A link that
    touches a convex object within its patch lies behind the plane of contact as a whole and is left out too.

    Args:
        hand: The hand.
        shapes: Its solids.
        frames: The contact frames.
        margin: Distance kept by everything that must not touch [m].
        convex: Whether the object is convex.

    Returns:
        The solids.
    """
    frames = tuple(frames)
    planes = [frame for frame in frames if frame.normal is not None]
    behind = {frame.joint_id for frame in frames if frame.patch is not None} if convex else set()
    touching = contact_shapes(hand, shapes, frames)
    kept = []
    for shape in shapes:
        mine = [frame for frame in planes if shape.fitted and frame.joint_id == shape.joint]
        if shape.joint in behind or (not mine and shape.name in touching):
            continue
        for frame in mine:
            shape = _set_back(shape, frame, margin + SET_BACK)
        kept.append(shape)
    return tuple(kept)


def _set_back(shape: LinkShape, frame: ContactFrame, margin: float) -> LinkShape:
    """Return a shape around a mesh with what is less than a margin behind the plane of a contact pushed back."""
    normal = np.array(frame.normal)
    level = float(normal @ np.array(frame.centre)) + frame.radius - margin
    if shape.geometry is None:
        ends = (shape.start, shape.end)
        start, end = (p - max(0.0, float(normal @ p) + shape.radius - level) * normal for p in ends)
        return replace(shape, start=start, end=end)
    over = np.maximum(shape.corners @ normal + shape.rim - level, 0.0)
    corners = shape.corners - over[:, None] * normal
    back = shape.placement.inverse()
    hull = hull_of(np.array([back.act(corner) for corner in corners]), shape.rim)
    return replace(shape, corners=corners, geometry=hull.geometry())


def tip_axes(hand: Hand, frames: Iterable[ContactFrame]) -> tuple[tuple[int, int, Array, float], ...]:
    """Return what bounds the normals with which links may touch: n·a + b ≥ 0, n into the object.

    For a contact with a patch these are its walls; otherwise a is the axis of a last link towards its tip and b is 0.

    Args:
        hand: The hand.
        frames: The contact frames.

    Returns:
        Index of the contact, carrying joint, a in its frame, and b. Contacts on inner links without a patch have
        none.
    """
    inner = set(hand.model.parents.tolist()[1:])
    axes = []
    for index, frame in enumerate(frames):
        centre = np.array(frame.centre)
        length = float(np.linalg.norm(centre))
        if frame.patch is not None:
            walls = zip(*frame.patch.walls(), strict=True)
            axes += [(index, frame.joint_id, wall, float(room)) for wall, room in walls]
        elif frame.joint_id not in inner and length > 1e-6:
            axes.append((index, frame.joint_id, centre / length, 0.0))
    return tuple(axes)


def inner_axes(
    hand: Hand, shapes: Iterable[LinkShape], frames: Iterable[ContactFrame]
) -> tuple[tuple[int, int, Array], ...]:
    """Return the axes of the capsules that touch with their side: of contacts with a radius on inner links.

    Args:
        hand: The hand.
        shapes: Its solids.
        frames: The contact frames.

    Returns:
        For each such contact: its index, carrying joint and unit axis in the joint's frame.
    """
    inner, solids = set(hand.model.parents.tolist()[1:]), tuple(shapes)
    axes = []
    for index, frame in enumerate(frames):
        centre = np.array(frame.centre)
        around = (s for s in solids if s.joint == frame.joint_id and s.holds(centre, frame.radius - 1e-6))
        shape = next(around, None) if frame.joint_id in inner and frame.radius > 0.0 else None
        if shape is not None and not np.array_equal(shape.start, shape.end):
            along = shape.end - shape.start
            axes.append((index, frame.joint_id, along / np.linalg.norm(along)))
    return tuple(axes)


def _shapes(hand: Hand, entry: Any) -> list[LinkShape]:
    """Return the solids of a geometry of the collision model: of a mesh the capsules or the hull that hold it."""
    fitted = hand.fitted_meshes.get(entry.name)
    if fitted is None:
        return [_shape(hand, entry)]
    if isinstance(fitted, FittedHull):
        corners = np.array([entry.placement.act(corner) for corner in fitted.corners])
        solid = _shape(hand, entry, fitted.geometry())
        return [replace(solid, corners=corners, rim=fitted.rim, fitted=True)]
    link, joint = hand.model.frames[entry.parentFrame].name, int(entry.parentJoint)
    branch = int(hand.model.supports[joint].tolist()[1]) if joint else 0
    found, pose = [], entry.placement
    for number, (first, last, radius) in enumerate(zip(fitted.starts, fitted.ends, fitted.radii, strict=True)):
        start, end, r = pose.act(first), pose.act(last), float(radius)
        length = float(np.linalg.norm(end - start))
        turn = rotation_between(np.array([0.0, 0.0, 1.0]), (end - start) / length) if length else np.eye(3)
        turned, corners = pin.SE3(turn, 0.5 * (start + end)), np.array([start, end])
        name = f"{entry.name}_{number}"
        found.append(LinkShape(name, link, joint, branch, start, end, r, corners, r, None, turned, True))
    return found


def _shape(hand: Hand, entry: Any, stands: Any = None) -> LinkShape:
    """Return the solid of a geometry of the collision model, or of what stands for it."""
    link = hand.model.frames[entry.parentFrame].name
    joint = int(entry.parentJoint)
    branch = int(hand.model.supports[joint].tolist()[1]) if joint else 0
    geometry, pose = stands or entry.geometry, entry.placement
    half = {coal.Sphere: 0.0}.get(type(geometry), getattr(geometry, "halfLength", 0.0))
    if isinstance(geometry, coal.Sphere | coal.Capsule):
        start, end = (np.array(pose.act(np.array([0.0, 0.0, sign * half]))) for sign in (-1.0, 1.0))
        corners = np.array([start, end]) if half else start[None]
        radius = float(geometry.radius)
        return LinkShape(entry.name, link, joint, branch, start, end, radius, corners, radius, None, pose)
    low, high = bounding_box(geometry)
    corners = np.array([pose.act(np.where(pick, high, low)) for pick in product((False, True), repeat=3)])
    centre, radius = corners.mean(axis=0), float(np.linalg.norm(high - low)) / 2
    return LinkShape(entry.name, link, joint, branch, centre, centre, radius, corners, 0.0, geometry, pose)


def bounding_box(geometry: Any) -> tuple[Array, Array]:
    """Return the corners of a coal geometry's bounding box in its own frame [m]."""
    geometry.computeLocalAABB()
    return np.array(geometry.aabb_local.min_), np.array(geometry.aabb_local.max_)
