"""Capsules of links as arrays: all their distances at once."""

from __future__ import annotations

import numpy as np

from ..collision.distances import segment_pairs
from ..collision.link_shapes import (
    LinkShape,
)
from ..hand.hand import Hand
from ..spatial import Array, Indices
from .contact_geometry import ContactGeometry


class Segments:
    """Axes and radii of solids as arrays, in the frames of their joints."""

    def __init__(self, shapes: list[LinkShape] | tuple[LinkShape, ...]) -> None:
        self.joints = np.array([shape.joint for shape in shapes], dtype=int)
        self._ends = np.array([(shape.start, shape.end) for shape in shapes]).reshape(-1, 2, 3).transpose(0, 2, 1)
        self.radii = np.array([shape.radius for shape in shapes])
        self._reach = self.radii + np.linalg.norm(self._ends[:, :, 1] - self._ends[:, :, 0], axis=1) / 2

    def place(self, pose: PosedJoints) -> Array:
        """Return starts and ends in the root frame, of shape (2, m, 3)."""
        placed = pose.rotations[self.joints] @ self._ends + pose.translations[self.joints][:, :, None]
        return np.ascontiguousarray(placed.transpose(2, 0, 1))

    def near(self, ends: Array, pairs: Indices, limit: float) -> tuple[Indices, Array, Array, Array]:
        """Return the pairs that are near, their distances, unit normals from a to b and points on the axes of a."""
        start, end = ends
        middle = 0.5 * (start + end)
        i, j = pairs.T
        apart = middle[j] - middle[i]
        bound = self._reach[i] + self._reach[j] + limit
        near = np.flatnonzero(np.einsum("ij,ij->i", apart, apart) < bound * bound)
        i, j = i[near], j[near]
        point_a, point_b = segment_pairs(start[i], end[i], start[j], end[j])
        normals = point_b - point_a
        length = np.sqrt(np.einsum("ij,ij->i", normals, normals))
        normals /= np.maximum(length, 1e-12)[:, None]
        return near, length - self.radii[i] - self.radii[j], normals, point_a


class PosedJoints:
    """Placements of all joints and the Jacobian columns at one posture, in the root frame, and the root in O."""

    def __init__(self, hand: Hand, geometry: ContactGeometry) -> None:
        self.placements = geometry.placements
        self.rotations, self.translations = self.placements[:, :3, :3], self.placements[:, :3, 3]
        self.linear, self.angular = geometry.twists[:3], geometry.twists[3:]
        root = hand.palm_in_root
        self.root: Array = np.eye(4)
        self.root_rotation, self.root_translation = self.root[:3, :3], self.root[:3, 3]
        self.root_rotation[:] = geometry.rotation @ np.array(root.rotation).T
        self.root_translation[:] = geometry.translation - self.root_rotation @ np.array(root.translation)
        self.palm = geometry.translation

    def place(self, joints: Indices, points: Array) -> Array:
        """Return points of links in the root frame, of shape (m, 3)."""
        return (self.rotations[joints] @ points[:, :, None])[:, :, 0] + self.translations[joints]

    def in_object(self, points: Array) -> Array:
        """Return points of the root frame in O."""
        return points @ self.root_rotation.T + self.root_translation
