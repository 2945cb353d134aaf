"""How much the normals of a triangle mesh differ under a footprint: edges, where no finger can rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..spatial import Array, Indices
from .triangles import Triangles

EVEN = float(np.radians(10.0))
"""Spread of normals up to which it does not matter whether triangles lie inside the solid [rad]."""
BESIDE = 0.02
"""How far beside a triangle the solid is looked for, in shares of the footprint."""
SLIVER = 1e-3
"""Triangles of less area than this share of the footprint's square have no normal to speak of."""


def normal_spread(triangles: Triangles, points: Array, radius: float) -> Array:
    """Return the widest angle between normals of the surface around points of it.

    Args:
        triangles: The solid [m].
        points: Points on its surface [m], of shape (n, 3).
        radius: Distance up to which triangles count, if they hang together with the nearest one [m].

    Returns:
        The largest angle between two normals around each point [rad], of shape (n,); NaN where a point is none.
    """
    spread, known = np.full(len(points), np.nan), np.flatnonzero(np.isfinite(points).all(axis=1))
    near = _Near.of(triangles, points, known, radius)
    near = near.take(_hanging_together(triangles, near))
    for k in known:
        spread[k] = _widest_angle(triangles.normals[near.faces[near.owners == k]])
    uneven = near.take(spread[near.owners] > EVEN)
    if len(uneven.faces):
        sides = _sides(triangles, uneven, radius)
        uneven, sides = uneven.take(sides != 0), sides[sides != 0]
        together = _hanging_together(triangles, uneven)
        outer, normals = uneven.take(together), (sides[:, None] * triangles.normals[uneven.faces])[together]
        for k in np.flatnonzero(spread > EVEN):
            spread[k] = _widest_angle(normals[outer.owners == k])
    return spread


@dataclass(frozen=True)
class _Near:
    """Triangles near points, a pair of both a row.

    Attributes:
        faces: Numbers of the triangles, of shape (m,).
        owners: Numbers of the points, of shape (m,).
        closest: Points of the triangles that are nearest to the points [m], of shape (m, 3).
        distance: Distances there [m], of shape (m,).
    """

    faces: Indices
    owners: Indices
    closest: Array
    distance: Array

    @classmethod
    def of(cls, triangles: Triangles, points: Array, known: Indices, radius: float) -> _Near:
        """Return the triangles within a radius of some of the points, without slivers."""
        import trimesh

        low, high = triangles.boxes
        sized = triangles.areas > SLIVER * radius**2
        boxes = [((low <= point + radius) & (high >= point - radius)).all(axis=1) & sized for point in points[known]]
        rows, faces = np.nonzero(np.reshape(boxes, (len(known), len(sized))))
        owners = known[rows]
        closest = np.asarray(trimesh.triangles.closest_point(triangles.corners(faces), points[owners]))
        found = cls(faces, owners, closest, np.linalg.norm(closest - points[owners], axis=1))
        return found.take(found.distance <= radius)

    def take(self, rows: npt.NDArray[np.bool_]) -> _Near:
        """Return some of them."""
        return _Near(self.faces[rows], self.owners[rows], self.closest[rows], self.distance[rows])


def _widest_angle(normals: Array) -> float:
    """Return the widest angle between unit normals, of shape (n, 3) [rad]."""
    return float(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0).min(initial=1.0)))


def _sides(triangles: Triangles, near: _Near, radius: float) -> Indices:
    """Return for each triangle whether its normal points out of the solid near its point, 1, into it, −1, or neither.

    Where a solid folds over itself, triangles inside have it on both sides: no finger meets them. Where folds lie on
    each other in one plane, some of those that make the surface are turned the other way.
    """
    inwards = triangles.corners(near.faces).mean(axis=1) - near.closest  # off the border, where others begin
    length = np.linalg.norm(inwards, axis=1, keepdims=True)
    looked = near.closest + inwards * np.minimum(1.0, 0.1 * radius / np.maximum(length, 1e-12))
    step = BESIDE * radius * triangles.normals[near.faces]
    inside = triangles.winding_number(np.vstack([looked + step, looked - step])).reshape(2, -1) > 0.5
    return inside[1].astype(np.intp) - inside[0]


def _hanging_together(triangles: Triangles, near: _Near) -> npt.NDArray[np.bool_]:
    """Return which triangles hang together, by shared corners, with the one that is nearest to their point."""
    if not len(near.faces):
        return np.zeros(0, dtype=bool)
    # Each point has corners of its own: of different points nothing hangs together.
    own = triangles.faces[near.faces] + near.owners[:, None] * len(triangles.vertices)
    corners = np.unique(own, return_inverse=True)[1].reshape(own.shape)
    reached = np.zeros(len(own), dtype=bool)
    nearest_first = np.lexsort((near.distance, near.owners))
    reached[nearest_first[np.flatnonzero(np.diff(near.owners[nearest_first], prepend=-1))]] = True
    while True:  # as often as the longest way has triangles: few, under a footprint
        at = np.zeros(corners.max() + 1, dtype=bool)
        at[corners[reached]] = True
        further = at[corners].any(axis=1)
        if np.array_equal(further, reached):
            return reached
        reached = further
