"""Open edges of triangles: the holes they go around, closed by a fan or by giving the surface a thickness."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING

import numpy as np

from ..spatial import Array, Indices

if TYPE_CHECKING:
    import trimesh

SMALL_HOLE, ALL_HOLES = 0.02, 0.05
"""Largest share of the surface that one hole, and all holes, may take to be closed unasked."""


def open_edges(mesh: trimesh.Trimesh) -> Indices:
    """Return the directed edges that are not walked back, each as often as it lacks that, of shape (n, 2)."""
    edges, count = np.asarray(mesh.edges), len(mesh.vertices)
    low, high = edges.min(axis=1), edges.max(axis=1)
    keys, place = np.unique(low * count + high, return_inverse=True)
    net = np.bincount(place, weights=np.where(edges[:, 0] == low, 1.0, -1.0), minlength=len(keys)).astype(int)
    left = np.flatnonzero(net)
    pairs = np.column_stack([keys[left] // count, keys[left] % count])
    forth = np.where((net[left] > 0)[:, None], pairs, pairs[:, ::-1])
    return np.repeat(forth, np.abs(net[left]), axis=0)


def filled(mesh: trimesh.Trimesh, done: list[str], *, everything: bool) -> trimesh.Trimesh:
    """Return the mesh with small holes, or all, closed by triangles that meet in the middle."""
    import trimesh

    vertices = np.asarray(mesh.vertices)
    total, closed, covered = float(mesh.area), 0, 0.0
    added: list[tuple[int, int, int]] = []
    centres: list[Array] = []
    loops = _loops(open_edges(mesh))
    caps = [np.linalg.norm(_fan_normals(vertices[loop]), axis=1).sum() / 2 for loop in loops]
    for cap, loop in sorted(zip(caps, loops, strict=True), key=lambda pair: float(pair[0])):
        if not everything and (cap > SMALL_HOLE * total or covered + cap > ALL_HOLES * total):
            break
        middle = len(vertices) + len(centres)
        centres.append(vertices[loop].mean(axis=0))
        added += [(after, before, middle) for before, after in zip(loop, np.roll(loop, -1), strict=True)]
        closed, covered = closed + 1, covered + float(cap)
    if not closed:
        return mesh
    done.append(f"closed {closed} hole{'s' if closed > 1 else ''}, {covered / total:.2%} of the surface")
    return trimesh.Trimesh(np.vstack([vertices, centres]), np.vstack([mesh.faces, added]), process=False)


def _fan_normals(loop: Array) -> Array:
    """Return twice the area vectors of the triangles between a loop and its middle, of shape (n, 3)."""
    arms = loop - loop.mean(axis=0)
    return np.cross(arms, np.roll(arms, -1, axis=0))


def _loops(edges: Indices) -> list[Indices]:
    """Return closed walks along directed edges, each edge once; what does not close is left out."""
    onward: dict[int, list[int]] = defaultdict(list)
    for start, end in edges.tolist():
        onward[start].append(end)
    loops = []
    for start in list(onward):
        while onward[start]:
            walk = [start]
            while onward[walk[-1]]:
                walk.append(onward[walk[-1]].pop())
                if walk[-1] in walk[:-1]:  # a closed piece of the walk is a hole of its own
                    first = walk.index(walk[-1])
                    loops.append(np.array(walk[first:-1]))
                    del walk[first + 1 :]
                    if len(walk) == 1:
                        break
            if len(walk) > 1:
                break
    return loops


def thickened(mesh: trimesh.Trimesh, thickness: float) -> trimesh.Trimesh:
    """Return the surface as a wall, half of its thickness on each side, closed along its open edges.

    Args:
        mesh: Triangles, of an open or a closed surface.
        thickness: Thickness of the wall, in the unit of the mesh.

    Returns:
        The wall's surface; where the surface is more tightly curved than it is thick, it folds over itself.
    """
    import igl
    import trimesh

    faces = np.array(igl.bfs_orient(np.asarray(mesh.faces, dtype=np.int64))[0])
    sheet = trimesh.Trimesh(mesh.vertices, faces, process=False)
    normals, count = np.asarray(sheet.vertex_normals), len(sheet.vertices)
    leaning = (normals[faces] * np.asarray(sheet.face_normals)[:, None]).sum(axis=2)
    steepest = np.ones(count)
    np.minimum.at(steepest, faces.ravel(), leaning.ravel())
    offset = (thickness / 2) * normals / np.maximum(steepest, 0.5)[:, None]
    start, end = open_edges(sheet).T
    rim = np.vstack([np.column_stack([end, start, start + count]), np.column_stack([end, start + count, end + count])])
    both = np.vstack([sheet.vertices + offset, sheet.vertices - offset])
    return trimesh.Trimesh(both, np.vstack([faces, faces[:, ::-1] + count, rim]), process=False)
