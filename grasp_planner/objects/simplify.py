"""Fewer triangles within a tolerance, for meshes that have more than a distance needs."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import trimesh

ENOUGH = 20_000
"""Triangles that are not thought too many."""


def simplified(mesh: trimesh.Trimesh, tolerance: float) -> trimesh.Trimesh:
    """Return a mesh of the same surface within a tolerance [m], of fewer triangles if it has many.

    Surfaces that manifold3d does not take are returned as they are.
    """
    import manifold3d
    import trimesh

    if len(mesh.faces) <= ENOUGH:
        return mesh
    with contextlib.suppress(Exception):  # it has many of its own
        given = manifold3d.Mesh64(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.uint64))
        found = manifold3d.Manifold(given).simplify(tolerance).to_mesh64()
        faces = np.asarray(found.tri_verts, dtype=np.int64)
        if 0 < len(faces) < len(mesh.faces):
            return trimesh.Trimesh(np.asarray(found.vert_properties)[:, :3], faces, process=False)
    return mesh
