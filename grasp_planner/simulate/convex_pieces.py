"""A solid as convex pieces: cut by planes until the convex hulls of what is left stand out of it very little.

Wherever the solid bulges outwards its hulls are exact; they cover its hollows by at most what is measured.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from itertools import count, product
from typing import TYPE_CHECKING, Any

import numpy as np

from ..objects.triangles import Triangles
from ..spatial import Array

if TYPE_CHECKING:
    import trimesh

STANDING_OUT = 1e-3
"""How far a hull may stand out of the solid [m]."""
MOST_PIECES = 96
"""Most pieces, beyond which the hollows stay covered deeper than that."""
SAMPLES = 300
"""Points of a hull at which that is measured, beside those in the middle of its triangles."""
SHARES = (0.2, 0.4, 0.6, 0.8)
"""Where a piece may be cut, as shares of its width; and through the point that stands out farthest."""
SMALLEST = 1e-12
"""Pieces of less volume are slivers between two cuts [m³]."""
_CUTS = np.array([n for n in product((-1, 0, 1), repeat=3) if n > (0, 0, 0) and np.abs(n).sum() <= 2], dtype=float)


_Piece = tuple[float, int, Any, Array]
"""How far it stands out, negative; a number that tells ties apart; the piece; where it stands out farthest."""


@dataclass(frozen=True)
class ConvexPieces:
    """Convex hulls whose union holds a solid.

    Attributes:
        corners: Corners of every hull [m], of shape (n, 3) each.
        standing_out: How far they stand out of the solid at most, as measured [m].
    """

    corners: tuple[Array, ...]
    standing_out: float


def convex_pieces(mesh: trimesh.Trimesh, tolerance: float = STANDING_OUT, most: int = MOST_PIECES) -> ConvexPieces:
    """Cut a solid into convex pieces.

    The piece whose hull stands out farthest is cut next, by the plane that leaves the least hollow.

    Args:
        mesh: The solid [m].
        tolerance: How far a hull may stand out of it [m].
        most: Most pieces.

    Returns:
        The pieces; one, its convex hull, if its triangles bound no manifold that can be cut.
    """
    import manifold3d

    whole = manifold3d.Manifold(
        manifold3d.Mesh64(
            vert_properties=np.array(mesh.vertices, dtype=np.float64), tri_verts=np.array(mesh.faces, dtype=np.uint64)
        )
    )
    triangles = Triangles.of(mesh)
    if whole.is_empty():
        hull = mesh.convex_hull
        return ConvexPieces((np.array(hull.vertices),), _standing_out(hull, triangles)[0])
    waiting: list[_Piece] = []
    numbers = count()
    left = whole.decompose()
    while left or (len(waiting) < most and -waiting[0][0] > tolerance):
        if not left:
            _, _, piece, farthest = heapq.heappop(waiting)
            left = [part for half in _halves(piece, farthest) for part in half.decompose() if part.volume() > SMALLEST]
        for part in left:
            out, farthest = _standing_out(_hull(part), triangles)
            heapq.heappush(waiting, (-out, next(numbers), part, farthest))
        left = []
    corners = tuple(np.asarray(_hull(piece).vertices) for _, _, piece, _ in waiting)
    return ConvexPieces(corners, max(-waiting[0][0], 0.0))


def _halves(piece: Any, farthest: Array) -> tuple[Any, Any]:
    """Return a piece cut where least hollow is left; squares, so that both halves share what is."""
    corners = np.asarray(piece.to_mesh64().vert_properties)[:, :3]
    least, best = np.inf, (piece, piece)
    for normal in _CUTS / np.linalg.norm(_CUTS, axis=1, keepdims=True):
        low, high = np.quantile(corners @ normal, (0.0, 1.0))
        margin = 1e-3 * (high - low)
        for place in (*(low + share * (high - low) for share in SHARES), float(farthest @ normal)):
            if not low + margin < place < high - margin:
                continue
            halves = piece.split_by_plane(tuple(normal), float(place))
            hollow = sum((half.hull().volume() - half.volume()) ** 2 for half in halves)
            if hollow < least:
                least, best = hollow, halves
    return best


def _hull(piece: Any) -> trimesh.Trimesh:
    """Return the convex hull of a piece."""
    import trimesh

    found = piece.hull().to_mesh64()
    corners, faces = np.asarray(found.vert_properties)[:, :3], np.asarray(found.tri_verts, dtype=np.int64)
    return trimesh.Trimesh(corners, faces, process=False)


def _standing_out(hull: trimesh.Trimesh, solid: Triangles) -> tuple[float, Array]:
    """Return how far a hull stands out of a solid [m] and where, at points of its surface."""
    import trimesh

    points = np.vstack([trimesh.sample.sample_surface(hull, SAMPLES, seed=0)[0], hull.triangles_center])
    distance = solid.signed_distance(points)
    worst = int(np.argmax(distance))
    return float(distance[worst]), points[worst]
