"""The convex hull of a mesh with few corners: it holds the mesh, its distances are cheap and its error is known."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import coal
import numpy as np
from scipy.spatial import ConvexHull

from ..spatial import Array, readonly

DIRECTIONS = 100
"""Directions whose farthest points are corners to begin with."""
FINE, ROUNDS = 3e-4, 4
"""Height of a point above a face from which on it becomes a corner too [m], and how often that is done."""
SAMPLES = 400
"""Points of the hull whose distance from the mesh is its error."""


@dataclass(frozen=True)
class FittedHull:
    """A convex polytope, inflated by a rim, that holds a mesh, in its frame.

    Attributes:
        corners: Corners [m], of shape (k, 3).
        faces: Corners of each triangle, counter-clockwise from outside, of shape (m, 3).
        rim: Radius of the ball that sweeps it [m].
        error: How far its surface stands away from that of the mesh at most: rim and hollows of the mesh [m].
    """

    corners: Array
    faces: Array
    rim: float
    error: float

    def geometry(self) -> Any:
        """Return it as a coal geometry."""
        points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        for corner in self.corners:
            points.append(corner)
        for face in self.faces:
            triangles.append(coal.Triangle(*(int(k) for k in face)))
        solid = coal.Convex(points, triangles)
        solid.setSweptSphereRadius(self.rim)
        return solid


def fit_hull(mesh: Any) -> FittedHull:
    """Return a convex polytope that holds a mesh.

    Args:
        mesh: coal mesh.

    Returns:
        The polytope: the mesh's farthest points in many directions, and the rim that the other points need.
    """
    points = np.array(mesh.vertices(), dtype=float)
    picked = np.unique(np.argmax(points @ directions(DIRECTIONS).T, axis=0))
    for _ in range(ROUNDS):
        hull = ConvexHull(points[picked])
        heights = points @ hull.equations[:, :3].T + hull.equations[:, 3]
        far = np.unique(heights.argmax(axis=0)[heights.max(axis=0) > FINE])
        if far.size == 0:
            break
        picked = np.union1d(picked, far)
    corners, hull = points[picked], ConvexHull(points[picked])
    bare = hull_of(corners).geometry()
    above = (points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1) > 0.0
    rim = max((point_distance(bare, point) for point in np.unique(points[above], axis=0)), default=0.0)
    found = hull_of(corners, max(0.0, rim))
    hollow = max(point_distance(mesh, point) for point in _samples(found.corners, found.faces))
    return replace(found, error=found.rim + hollow)


def hull_of(points: Array, rim: float = 0.0) -> FittedHull:
    """Return the convex hull of points of shape (n, 3) with a rim [m]; its error is not known: NaN."""
    hull = ConvexHull(points)
    order = {int(k): number for number, k in enumerate(hull.vertices)}
    corners = points[hull.vertices]
    faces = np.array([[order[int(k)] for k in face] for face in _outward(points, hull)])
    return FittedHull(readonly(corners), faces, rim, float("nan"))


@cache
def directions(number: int) -> Array:
    """Return unit vectors spread evenly over the sphere by the golden angle, of shape (number, 3)."""
    k = np.arange(number)
    height = 1.0 - 2.0 * (k + 0.5) / number
    turn = k * np.pi * (3.0 - np.sqrt(5.0))
    ring = np.sqrt(1.0 - height**2)
    return readonly(np.column_stack([ring * np.cos(turn), ring * np.sin(turn), height]))


def point_distance(geometry: Any, point: Array) -> float:
    """Return the distance of a point from a geometry in its frame; of a mesh from its surface, inside too [m]."""
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.enable_signed_distance = True
    ball, place = coal.Sphere(POINT), coal.Transform3s(np.eye(3), np.asarray(point, dtype=float))
    return float(coal.distance(geometry, coal.Transform3s(), ball, place, request, result)) + POINT


def surface_distance(geometries: Iterable[Any], point: Array) -> float:
    """Return how far a point is from the nearest surface of geometries [m].

    Args:
        geometries: Entries of a Pinocchio geometry model that one joint carries, at least one.
        point: The point in the frame of the joint [m].
    """
    return min(abs(point_distance(entry.geometry, entry.placement.actInv(point))) for entry in geometries)


POINT = 1e-9
"""Radius of a ball that stands for a point [m]."""


def _outward(corners: Array, hull: ConvexHull) -> Array:
    """Return the triangles of a hull, counter-clockwise from outside."""
    faces = np.array(hull.simplices)
    a, b, c = (corners[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    faces[inward] = faces[inward][:, [0, 2, 1]]
    return faces


def hull_points(hull: FittedHull, spacing: float) -> Array:
    """Return points of a hull without its rim that are so far apart at most [m], of shape (n, 3)."""
    import trimesh

    found, _ = trimesh.remesh.subdivide_to_size(hull.corners, hull.faces, spacing, max_iter=20)
    return np.unique(np.round(np.asarray(found, dtype=float), 7), axis=0)


def _samples(corners: Array, faces: Array) -> Array:
    """Return points spread over the triangles by their areas, of shape (about SAMPLES, 3)."""
    a, b, c = (corners[faces[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    share = (np.cumsum(areas) - 0.5 * areas) / areas.sum()
    numbers = np.maximum(1, np.round(SAMPLES * areas / areas.sum())).astype(int)
    found = []
    for k in range(len(share)):
        i = np.arange(numbers[k])
        u, v = (i + 0.5) / numbers[k], np.mod(0.5 + i * 0.618034, 1.0)
        root = np.sqrt(u)[:, None]
        found.append((1.0 - root) * a[k] + root * (1.0 - v[:, None]) * b[k] + root * v[:, None] * c[k])
    return np.vstack(found)
