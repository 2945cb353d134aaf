"""Spheres and capsules inside of the solids that are neither, for the search with many states at a time."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.spatial import ConvexHull

from ..collision.link_shapes import LinkShape
from ..spatial import Array

MOST_FILLING = 4
"""Most spheres along each edge of a box that is filled with them."""
SLIM = 0.4
"""Share of its largest radius below which a capsule within a hull is left out."""


class Piece:
    """A sphere or capsule of the search, fixed to a joint."""

    def __init__(self, name: str, joint: int, start: Array, end: Array, radius: float) -> None:
        self.name, self.joint, self.start, self.end, self.radius = name, joint, start, end, radius


def inner_pieces(shapes: Iterable[LinkShape]) -> list[Piece]:
    """Return shapes as spheres and capsules: others by spheres in a lattice of their bounding box, inside of it."""
    pieces = []
    for shape in shapes:
        if shape.geometry is None:
            pieces.append(Piece(shape.name, shape.joint, shape.start, shape.end, shape.radius))
            continue
        if shape.fitted:
            pieces += _inside(shape)
            continue
        shape.geometry.computeLocalAABB()
        low, high = np.array(shape.geometry.aabb_local.min_), np.array(shape.geometry.aabb_local.max_)
        radius = float((high - low).min()) / 2.0
        steps = [
            np.linspace(a + radius, b - radius, min(MOST_FILLING, int(np.ceil((b - a) / (2.0 * radius) - 1e-9))))
            for a, b in zip(low, high, strict=True)
        ]
        for centre in np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3):
            at = np.array(shape.placement.act(centre))
            pieces.append(Piece(shape.name, shape.joint, at, at, radius))
    return pieces


def _inside(shape: LinkShape) -> list[Piece]:
    """Return capsules within a convex hull, side by side along its longest axis."""
    points, hull = shape.corners, ConvexHull(shape.corners)
    normals, offsets = hull.equations[:, :3], hull.equations[:, 3]
    middle = points.mean(axis=0)
    axes = np.linalg.eigh((points - middle).T @ (points - middle))[1].T[::-1]
    along = (points - middle) @ axes.T
    low, high = along.min(axis=0), along.max(axis=0)
    thick = float((high - low)[1:].min())
    steps = [
        a + (b - a) * (np.arange(n) + 0.5) / n
        for a, b in zip(low[1:], high[1:], strict=True)
        for n in [int(np.clip(round((b - a) / thick), 1, MOST_FILLING))]
    ]
    pieces = []
    for place in np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 2):
        line = middle + place @ axes[1:]
        depth, slope = -(normals @ line + offsets), normals @ axes[0]
        tries = np.linspace(low[0], high[0], 21)
        deepest = float((depth[:, None] - slope[:, None] * tries).min(axis=0).max())
        radius = min(0.5 * thick, 0.95 * deepest)
        if radius < SLIM * 0.5 * thick:
            continue
        room = (depth - radius) / np.where(np.abs(slope) < 1e-12, 1e-12, slope)
        start = float(room[slope < 0.0].max(initial=low[0]))
        end = float(room[slope > 0.0].min(initial=high[0]))
        first, last = line + start * axes[0], line + max(start, end) * axes[0]
        pieces.append(Piece(shape.name, shape.joint, first, last, radius + shape.rim))
    return pieces
