"""Smooth patches of a surface that face away from each other, for a hand to close on."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ..spatial import Array, readonly
from .base import SurfaceSample

if TYPE_CHECKING:
    import trimesh

SAMPLES = 1500
"""Points of the surface that are looked at."""
PAIRS = 300
"""Most pairs that are kept."""
NARROWEST, WIDEST = 1e-3, 0.09
"""Distance between the patches of a pair [m]."""
PATCH, LEANING = 3e-3, float(np.cos(np.radians(25.0)))
"""How far around a point the surface is smooth [m]: its normals lean by less than 25°."""
ROOM, LEFT = 0.014, 0.010
"""This far outside a patch [m] the surface is at least so far away: a fingertip has room."""
OPPOSED = 0.9
"""Cosine by which normals lie along the line between the points."""


def opposed_patches(mesh: trimesh.Trimesh, field: Callable[[Array], SurfaceSample]) -> tuple[Array, Array]:
    """Return pairs of points on smooth patches that face away from each other.

    Args:
        mesh: The surface [m].
        field: Its smooth signed distance, by points of shape (..., 3).

    Returns:
        Points halfway between the two [m] and unit directions from one to the other, of shape (n, 3) each.
    """
    import trimesh

    points, faces = trimesh.sample.sample_surface(mesh, SAMPLES, seed=0)
    points, normals = np.asarray(points), np.asarray(mesh.face_normals)[faces]
    good = field(points + ROOM * normals).distance > LEFT
    points, normals = points[good], normals[good]
    sides = np.vstack([np.eye(3), -np.eye(3)])
    tangents = sides - (normals @ sides.T)[..., None] * normals[:, None]
    leaning = (field(points[:, None] + PATCH * tangents).gradient * normals[:, None]).sum(axis=-1)
    smooth = leaning.min(axis=1) > LEANING
    points, normals = points[smooth], normals[smooth]
    across = points[None] - points[:, None]
    width = np.linalg.norm(across, axis=-1)
    across /= np.maximum(width, 1e-12)[..., None]
    first, second = np.einsum("ijk,ik->ij", across, normals), np.einsum("ijk,jk->ij", across, normals)
    rows, columns = np.nonzero((width > NARROWEST) & (width < WIDEST) & (first < -OPPOSED) & (second > OPPOSED))
    chosen = np.random.default_rng(0).permutation(len(rows))[:PAIRS]
    rows, columns = rows[chosen], columns[chosen]
    return readonly((points[rows] + points[columns]) / 2), readonly(across[rows, columns])
