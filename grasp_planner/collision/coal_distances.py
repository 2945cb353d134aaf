"""Signed distances with witness points by coal, for shapes that are no spheres or capsules, and for checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import coal
import numpy as np

from ..objects import GraspObject
from ..spatial import Array
from .link_shapes import LinkShape, bounding_box

TOLERANCE = 1e-12
"""GJK and EPA tolerance; with coal's default of 1e-6 normals of curved shapes are rough."""
DEEP_TOLERANCE = 1e-6
"""The same for overlaps deeper than 1 mm: with the fine one EPA often misses the nearest face there (measured on a
capsule within a cylinder: every fifth depth too large, by up to 10 cm; none with this one)."""
DEEP = -1e-3
"""Distance below which an overlap is deep [m]."""
CONTACTS = 100
"""Most contacts of two meshes that overlap of which the deepest is taken."""
MAX_ITERATIONS = 1000
"""Most GJK and EPA iterations."""


@dataclass(frozen=True)
class PairDistances:
    """Distances of m pairs of solids.

    Attributes:
        distance: Signed distances; lower bounds for far pairs [m], of shape (m,).
        normals: Unit normals from the first to the second solid, of shape (m, 3); zero for far pairs.
        points_a: Witness points on the first solids [m], of shape (m, 3).
        points_b: Witness points on the second solids [m], of shape (m, 3).
        joints_a: Joints that carry the first solids, of shape (m,).
        joints_b: Joints that carry the second ones, of shape (m,).
    """

    distance: Array
    normals: Array
    points_a: Array
    points_b: Array
    joints_a: Array
    joints_b: Array


class HandPose(Protocol):
    """Placements of all joints in the root frame, of shape (n, 4, 4), and pose of the root in O, of shape (4, 4)."""

    placements: Array
    root: Array


class ExactDistance:
    """Asks coal for exact signed distances with witness points; keeps its requests and its last result.

    Attributes:
        result: The last result.
    """

    def __init__(self) -> None:
        self.result = coal.DistanceResult()
        self._fine, self._deep = _request(TOLERANCE), _request(DEEP_TOLERANCE)

    def __call__(self, first: Any, pose_first: Any, second: Any, pose_second: Any) -> float:
        """Return the signed distance of two geometries at their poses [m]."""
        value = self._ask(self._fine, first, pose_first, second, pose_second)
        return self._ask(self._deep, first, pose_first, second, pose_second) if value < DEEP else value

    def nearest(self, first: Any, pose_first: Any, second: Any, pose_second: Any) -> tuple[float, Array, Array]:
        """Return the signed distance of two geometries at their poses and, till asked again, the nearest points [m]."""
        value = self(first, pose_first, second, pose_second)
        return value, self.result.getNearestPoint1(), self.result.getNearestPoint2()

    def _ask(self, wanted: Any, first: Any, pose_first: Any, second: Any, pose_second: Any) -> float:
        """Return the answer to one request."""
        self.result.clear()
        if isinstance(first, coal.BVHModelBase) or isinstance(second, coal.BVHModelBase):
            return _mesh_distance(wanted, first, pose_first, second, pose_second, self.result)
        return float(coal.distance(first, pose_first, second, pose_second, wanted, self.result))


def _request(tolerance: float) -> Any:
    """Return a request for signed distances."""
    wanted = coal.DistanceRequest()
    wanted.enable_signed_distance = True
    wanted.gjk_tolerance = wanted.epa_tolerance = tolerance
    wanted.gjk_max_iterations = wanted.epa_max_iterations = MAX_ITERATIONS
    return wanted


def _mesh_distance(wanted: Any, first: Any, pose_first: Any, second: Any, pose_second: Any, result: Any) -> float:
    """Return the signed distance where one geometry is a mesh.

    coal has none of a mesh from a swept solid, so that the core's is taken and the radius off it; of two meshes that
    overlap it has only that they do, and the deepest of its contacts is taken.
    """
    (first, rim_a), (second, rim_b) = _core(first), _core(second)
    value = float(coal.distance(first, pose_first, second, pose_second, wanted, result))
    if value <= 0.0 and isinstance(first, coal.BVHModelBase) and isinstance(second, coal.BVHModelBase):
        request, found = coal.CollisionRequest(coal.CONTACT, CONTACTS), coal.CollisionResult()
        coal.collide(first, pose_first, second, pose_second, request, found)
        value = -max((abs(contact.penetration_depth) for contact in found.getContacts()), default=0.0)
    return value - rim_a - rim_b


def _core(geometry: Any) -> tuple[Any, float]:
    """Return a solid without the ball that sweeps it, and the radius of that ball [m]."""
    rim = 0.0 if isinstance(geometry, coal.BVHModelBase) else float(geometry.getSweptSphereRadius())
    if rim == 0.0:
        return geometry, 0.0
    core = geometry.clone()
    core.setSweptSphereRadius(0.0)
    return core, rim


class CoalPairs:
    """Pairs of solids whose distances coal computes; the second may be the object."""

    def __init__(self, pairs: Sequence[tuple[LinkShape, LinkShape]]) -> None:
        self._set([pair[0] for pair in pairs])
        second = [pair[1] for pair in pairs]
        self.joints_b = np.array([shape.joint for shape in second], dtype=int)
        self._second = [_geometry(shape) for shape in second]
        self._mount_b = _mounts(second)
        middles = [shape.placement.actInv((shape.start + shape.end) / 2) for shape in second]
        self._centres = np.array([[*middle, 1.0] for middle in middles])[:, :, None]
        self._balls = np.array([s.radius + float(np.linalg.norm(s.end - s.start)) / 2 for s in second])

    @classmethod
    def with_object(cls, shapes: Sequence[LinkShape], grasp_object: GraspObject) -> CoalPairs:
        """Return the pairs of solids with an object."""
        pairs = cls.__new__(cls)
        pairs._set(shapes)
        count = len(shapes)
        pairs.joints_b = np.full(count, -1)
        pairs._second = [grasp_object.coal_geometry()] * count
        pairs._mount_b = np.tile(np.eye(4), (count, 1, 1))
        pairs._centres = np.tile([[0.0], [0.0], [0.0], [1.0]], (count, 1, 1))
        pairs._balls = np.full(count, float(np.linalg.norm(grasp_object.half_extents)))
        return pairs

    def _set(self, first: Sequence[LinkShape]) -> None:
        """Store the first solids and, for the broad phase, boxes around them."""
        self._exact = ExactDistance()
        self.joints_a = np.array([shape.joint for shape in first], dtype=int)
        self._first = [_geometry(shape) for shape in first]
        self._mount_a = _mounts(first)
        bounds = [bounding_box(_geometry(shape)) for shape in first]
        self._low, self._high = np.array([b[0] for b in bounds]), np.array([b[1] for b in bounds])

    def distances(self, pose: HandPose, limit: float, *, in_object: bool = False) -> PairDistances:
        """Return the distances at one posture.

        Args:
            pose: Placements of the joints.
            limit: Pairs farther apart than this need no exact distance [m].
            in_object: Whether the second solids are the object; results are then in O, otherwise in the root frame.

        Returns:
            The distances.
        """
        frames_a = pose.placements[self.joints_a] @ self._mount_a
        if in_object:
            frames_a = pose.root @ frames_a
            frames_b = self._mount_b
        else:
            frames_b = pose.placements[self.joints_b] @ self._mount_b
        rotation_a, position_a = frames_a[:, :3, :3], frames_a[:, :3, 3]
        rotation_b, position_b = frames_b[:, :3, :3], frames_b[:, :3, 3]
        local = ((frames_b @ self._centres)[:, None, :3, 0] - position_a[:, None]) @ rotation_a
        local = local[:, 0]
        gap = local - np.minimum(np.maximum(local, self._low), self._high)
        distance = np.sqrt(np.einsum("ij,ij->i", gap, gap)) - self._balls
        normals, points_a, points_b = np.zeros((3, len(distance), 3))
        result = self._exact.result
        for k in np.flatnonzero(distance < limit):
            pose_a = coal.Transform3s(rotation_a[k], position_a[k])
            pose_b = coal.Transform3s(rotation_b[k], position_b[k])
            distance[k] = self._exact(self._first[k], pose_a, self._second[k], pose_b)
            normals[k] = result.normal
            points_a[k], points_b[k] = result.getNearestPoint1(), result.getNearestPoint2()
        return PairDistances(distance, normals, points_a, points_b, self.joints_a, self.joints_b)


def _mounts(shapes: Sequence[LinkShape]) -> Array:
    """Return poses of coal geometries in the frames of their joints [m], of shape (m, 4, 4)."""
    return np.array([shape.placement.homogeneous for shape in shapes])


def _geometry(shape: LinkShape) -> Any:
    """Return the coal geometry of a solid, in the frame of its placement."""
    if shape.geometry is not None:
        return shape.geometry
    length = float(np.linalg.norm(shape.end - shape.start))
    return coal.Capsule(shape.radius, length) if length else coal.Sphere(shape.radius)
