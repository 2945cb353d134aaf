"""Capsules that hold a mesh, so that distances from it are cheap and smooth; how far they stand out of it is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..spatial import Array

MOST_CAPSULES = 4
"""Most capsules of one mesh."""
GOOD_ENOUGH = 1e-3
"""How far capsules may stand out of a mesh before it is split further [m]."""
WORTH = 0.9
"""Share of its capsule's volume below which the two of a piece that is split have to come."""
ROUNDS = 60
"""Rounds of the search for the smallest circle."""


@dataclass(frozen=True)
class FittedCapsules:
    """Capsules around a mesh, in its frame.

    Attributes:
        starts: One end of each axis [m], of shape (k, 3).
        ends: The other ends [m], of shape (k, 3); equal to the first for a ball.
        radii: Radii [m], of shape (k,).
        error: How far they stand out of the surface at most [m].
    """

    starts: Array
    ends: Array
    radii: Array
    error: float


def fit_capsules(points: Array, most: int = MOST_CAPSULES) -> FittedCapsules:
    """Return capsules that hold all points of a surface.

    Args:
        points: Points of the surface [m], of shape (n, 3).
        most: Most capsules; fewer if they stand out by a millimetre at most.

    Returns:
        The capsules; the largest piece is split first.
    """
    tree = cKDTree(points)
    pieces = [_piece(points)]
    while len(pieces) < most and _error(pieces, tree) > GOOD_ENOUGH:
        worst = max(range(len(pieces)), key=lambda k: _volume(*pieces[k][1:]))
        inside = pieces[worst][0]
        spread = inside - inside.mean(axis=0)
        along = spread @ _axes(spread)[0]
        first = along <= 0.5 * float(along.min() + along.max())
        parts = [_piece(inside[first]), _piece(inside[~first])]
        if sum(_volume(*part[1:]) for part in parts) > WORTH * _volume(*pieces[worst][1:]):
            break
        pieces[worst : worst + 1] = parts
    starts, ends = (np.array([piece[k] for piece in pieces]) for k in (1, 2))
    radii = np.array([piece[3] for piece in pieces])
    missing = max(0.0, float(_outside(points, starts, ends, radii).max()))
    return FittedCapsules(starts, ends, radii + missing, _error(pieces, tree) + missing)


def _error(pieces: list[tuple[Array, Array, Array, float]], tree: cKDTree) -> float:
    """Return how far the outer surface of capsules stands away from the points in a tree at most [m]."""
    worst = 0.0
    for k, (_, start, end, radius) in enumerate(pieces):
        shell = _surface(start, end, radius)
        others = [piece for i, piece in enumerate(pieces) if i != k]
        if others:
            starts, ends = (np.array([piece[i] for piece in others]) for i in (1, 2))
            shell = shell[_outside(shell, starts, ends, np.array([piece[3] for piece in others])) > 0.0]
        if len(shell):
            worst = max(worst, float(tree.query(shell)[0].max()))
    return worst


def _piece(points: Array) -> tuple[Array, Array, Array, float]:
    """Return points and the axis and radius of the smallest of three capsules around them."""
    middle = points.mean(axis=0)
    capsules = (_capsule(points, middle, axis) for axis in _axes(points - middle))
    return points, *min(capsules, key=lambda capsule: _volume(*capsule))


def _axes(spread: Array) -> Array:
    """Return the principal axes of centred points, the longest first, of shape (3, 3)."""
    return np.linalg.eigh(spread.T @ spread)[1].T[::-1]


def _capsule(points: Array, middle: Array, axis: Array) -> tuple[Array, Array, float]:
    """Return a capsule around points with a given direction of its axis."""
    along = (points - middle) @ axis
    across = points - middle - np.outer(along, axis)
    centre = 0.5 * (across.min(axis=0) + across.max(axis=0))
    for k in range(1, ROUNDS):
        far = across[int(np.argmax(((across - centre) ** 2).sum(axis=1)))]
        centre = centre + (far - centre) / (k + 1.0)
    lever = np.linalg.norm(across - centre, axis=1)
    radius = float(lever.max())
    reach = np.sqrt(np.maximum(radius**2 - lever**2, 0.0))
    low, high = float((along + reach).min()), float((along - reach).max())
    if low > high:  # a ball
        low = high = 0.5 * (float(along.min()) + float(along.max()))
        radius = float(np.sqrt((along - low) ** 2 + lever**2).max())
    return middle + centre + low * axis, middle + centre + high * axis, radius


def _volume(start: Array, end: Array, radius: float) -> float:
    """Return the volume of a capsule [m³]."""
    return float(np.pi * radius**2 * (np.linalg.norm(end - start) + 4.0 / 3.0 * radius))


def _surface(start: Array, end: Array, radius: float) -> Array:
    """Return points of the surface of a capsule [m], of shape (n, 3)."""
    k = np.arange(150)
    height = 1.0 - 2.0 * (k + 0.5) / len(k)
    turn = k * np.pi * (3.0 - np.sqrt(5.0))
    ball = np.column_stack([np.sqrt(1.0 - height**2) * f(turn) for f in (np.cos, np.sin)] + [height])
    along = end - start
    caps = np.where((ball @ along > 0.0)[:, None], end, start) + radius * ball
    length = float(np.linalg.norm(along))
    if length < 1e-9:
        return caps
    axis = along / length
    side = ball - np.outer(ball @ axis, axis)
    side = side / np.maximum(np.linalg.norm(side, axis=1), 1e-9)[:, None]
    return np.vstack([caps, start + np.outer((k + 0.5) / len(k), along) + radius * side])


def _outside(points: Array, starts: Array, ends: Array, radii: Array) -> Array:
    """Return how far points lie outside of all capsules, negative inside [m], of shape (n,)."""
    least = np.full(len(points), np.inf)
    for start, end, radius in zip(starts, ends, radii, strict=True):
        along = end - start
        share = np.clip((points - start) @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
        least = np.minimum(least, np.linalg.norm(points - start - share[:, None] * along, axis=1) - radius)
    return least
