"""Signed distances with witness points by coal, for shapes that are no spheres or capsules, and for checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import coal
import numpy as np

from .link_shapes import LinkShape
from .objects import GraspObject
from .spatial import Array

TOLERANCE = 1e-12
"""GJK and EPA tolerance; with coal's default of 1e-6 normals of curved shapes are rough."""
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


class RootPose(Protocol):
    """Pose of the hand's root in O."""

    root_rotation: Array
    root_translation: Array


def request() -> Any:
    """Return a request for exact signed distances with witness points."""
    wanted = coal.DistanceRequest()
    wanted.enable_signed_distance = True
    wanted.gjk_tolerance = wanted.epa_tolerance = TOLERANCE
    wanted.gjk_max_iterations = wanted.epa_max_iterations = MAX_ITERATIONS
    return wanted


def signed_distance(first: Any, pose_first: Any, second: Any, pose_second: Any) -> tuple[float, Array, Array, Array]:
    """Return the signed distance of two coal geometries with witness points and normal.

    Args:
        first: First geometry.
        pose_first: Its pose, coal.Transform3s.
        second: Second geometry.
        pose_second: Its pose.

    Returns:
        Distance [m], negative if they overlap; nearest points on both; unit normal from the first to the second.
    """
    result = coal.DistanceResult()
    value = coal.distance(first, pose_first, second, pose_second, request(), result)
    return float(value), result.getNearestPoint1(), result.getNearestPoint2(), np.array(result.normal)


class CoalPairs:
    """Pairs of solids whose distances coal computes; the second may be the object."""

    def __init__(self, pairs: Sequence[tuple[LinkShape, LinkShape]]) -> None:
        self._set([pair[0] for pair in pairs], [pair[1] for pair in pairs])

    @classmethod
    def with_object(cls, shapes: Sequence[LinkShape], grasp_object: GraspObject) -> CoalPairs:
        """Return the pairs of solids with an object."""
        pairs = cls.__new__(cls)
        pairs._set(list(shapes), None, grasp_object)
        return pairs

    def _set(
        self, first: list[LinkShape], second: list[LinkShape] | None, grasp_object: GraspObject | None = None
    ) -> None:
        """Store geometries and what the broad phase needs: a box around the first, a ball around the second."""
        self._request, self._result = request(), coal.DistanceResult()
        self.joints_a = np.array([shape.joint for shape in first], dtype=int)
        self._first = [_geometry(shape) for shape in first]
        bounds = [_local_bounds(shape) for shape in first]
        self._low, self._high = np.array([b[0] for b in bounds]), np.array([b[1] for b in bounds])
        self._pose_a = [(np.array(s.placement.rotation), np.array(s.placement.translation)) for s in first]
        if second is None:
            assert grasp_object is not None
            self.joints_b = np.full(len(first), -1)
            self._second = [grasp_object.coal_geometry()] * len(first)
            self._centres = np.zeros((len(first), 3))
            self._balls = np.full(len(first), float(np.linalg.norm(grasp_object.half_extents)))
            self._pose_b = [(np.eye(3), np.zeros(3))] * len(first)
        else:
            self.joints_b = np.array([shape.joint for shape in second], dtype=int)
            self._second = [_geometry(shape) for shape in second]
            self._centres = np.array([(shape.start + shape.end) / 2 for shape in second])
            self._balls = np.array([s.radius + float(np.linalg.norm(s.end - s.start)) / 2 for s in second])
            self._pose_b = [(np.array(s.placement.rotation), np.array(s.placement.translation)) for s in second]

    def distances(self, rotations: Array, translations: Array, root: RootPose | None, limit: float) -> PairDistances:
        """Return the distances at one posture.

        Args:
            rotations: Rotations of all joints in the root frame, of shape (njoints, 3, 3).
            translations: Their positions [m], of shape (njoints, 3).
            root: Pose of the root in O if the second solids are the object; then results are in O, otherwise in
                the root frame.
            limit: Pairs farther apart than this need no exact distance [m].

        Returns:
            The distances.
        """
        count = len(self._first)
        rotation_a = rotations[self.joints_a] @ np.array([pose[0] for pose in self._pose_a])
        offset_a = np.array([pose[1] for pose in self._pose_a])
        position_a = (rotations[self.joints_a] @ offset_a[:, :, None])[:, :, 0] + translations[self.joints_a]
        if root is not None:
            rotation_a = root.root_rotation @ rotation_a
            position_a = position_a @ root.root_rotation.T + root.root_translation
            rotation_b, position_b = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
            centres = self._centres
        else:
            turned = rotations[self.joints_b]
            rotation_b = turned @ np.array([pose[0] for pose in self._pose_b])
            offset_b = np.array([pose[1] for pose in self._pose_b])
            position_b = (turned @ offset_b[:, :, None])[:, :, 0] + translations[self.joints_b]
            centres = (turned @ self._centres[:, :, None])[:, :, 0] + translations[self.joints_b]
        local = ((centres - position_a)[:, None, :] @ rotation_a)[:, 0]
        gap = local - np.minimum(np.maximum(local, self._low), self._high)
        distance = np.sqrt(np.einsum("ij,ij->i", gap, gap)) - self._balls
        normals, points_a, points_b = np.zeros((3, count, 3))
        result, wanted = self._result, self._request
        for k in np.flatnonzero(distance < limit):
            pose_a = coal.Transform3s(rotation_a[k], position_a[k])
            pose_b = coal.Transform3s(rotation_b[k], position_b[k])
            result.clear()
            distance[k] = coal.distance(self._first[k], pose_a, self._second[k], pose_b, wanted, result)
            normals[k] = result.normal
            points_a[k], points_b[k] = result.getNearestPoint1(), result.getNearestPoint2()
        return PairDistances(distance, normals, points_a, points_b, self.joints_a, self.joints_b)


def _geometry(shape: LinkShape) -> Any:
    """Return the coal geometry of a solid, in the frame of its placement."""
    if shape.geometry is not None:
        return shape.geometry
    length = float(np.linalg.norm(shape.end - shape.start))
    return coal.Capsule(shape.radius, length) if length else coal.Sphere(shape.radius)


def _local_bounds(shape: LinkShape) -> tuple[Array, Array]:
    """Return the corners of the bounding box of a solid in the frame of its placement [m]."""
    geometry = _geometry(shape)
    geometry.computeLocalAABB()
    return np.array(geometry.aabb_local.min_), np.array(geometry.aabb_local.max_)
