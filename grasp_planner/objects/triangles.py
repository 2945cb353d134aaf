"""Exact answers of a triangle mesh: signed distance, nearest points and the normals under a footprint.

Inside and outside follow from the generalized winding number, which is right where normals at edges are not (Barill et
al., Fast winding numbers for soups and clouds, 2018).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ..spatial import Array, Indices

if TYPE_CHECKING:
    import trimesh

CHUNK = 400_000
"""Points whose exact distance is computed at once."""
FEW, CELL_SIZES = 1000, 6
"""Points up to which each has a winding number of its own, and how many sizes of cells share one otherwise."""
TOUCHING = 1e-4
"""Distance below which the direction to the nearest point says nothing and the triangle's normal is taken [m]."""
EVEN = float(np.radians(10.0))
"""Spread of normals up to which it does not matter whether triangles lie inside the solid [rad]."""
BESIDE = 0.02
"""How far beside a triangle the solid is looked for, in shares of the footprint."""
SLIVER = 1e-3
"""Triangles of less area than this share of the footprint's square have no normal to speak of."""


@dataclass(frozen=True)
class NearestPoints:
    """The points of a surface nearest to n points.

    Attributes:
        distance: Signed distance, negative inside [m], of shape (n,).
        points: Nearest points of the surface [m], of shape (n, 3).
        normals: Unit outward normals there, of shape (n, 3).
    """

    distance: Array
    points: Array
    normals: Array


def winding_number(mesh: trimesh.Trimesh, points: Array) -> Array:
    """Return the generalized winding number of a mesh around points, of shape (n,)."""
    import igl

    vertices, faces = _arrays(mesh)
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2  # single precision inside: far from 0 it fails
    return np.asarray(igl.fast_winding_number(vertices - middle, faces, np.ascontiguousarray(points - middle)))


def exact_distance(mesh: trimesh.Trimesh, points: Array) -> Array:
    """Return the exact signed distance to a solid, negative inside [m], of shape (n,)."""
    parts = (np.ascontiguousarray(points[k : k + CHUNK]) for k in range(0, len(points), CHUNK))
    return np.concatenate([_signed(mesh, part)[0] for part in parts])


def nearest_points(mesh: trimesh.Trimesh, points: Array) -> NearestPoints:
    """Return distances to a solid, the nearest points of its surface and its normals there.

    Args:
        mesh: The solid, normals outward [m].
        points: Points [m], of shape (n, 3).

    Returns:
        The nearest points; normals are those of the triangles for points on the surface, otherwise the direction to
        the nearest point, which at an edge is between those of its triangles.
    """
    distance, faces, closest = _signed(mesh, np.ascontiguousarray(points))
    normals = np.array(mesh.face_normals[faces])
    off = np.abs(distance) > TOUCHING
    normals[off] = (points - closest)[off] / distance[off, None]
    return NearestPoints(distance, closest, normals)


def normal_spread(mesh: trimesh.Trimesh, points: Array, radius: float) -> Array:
    """Return the widest angle between normals of the surface around points of it.

    Args:
        mesh: The solid [m].
        points: Points on its surface [m], of shape (n, 3).
        radius: Distance up to which triangles count, if they hang together with the nearest one [m].

    Returns:
        The largest angle between two normals around each point [rad], of shape (n,); NaN where a point is none.
    """
    triangles = np.asarray(mesh.triangles)
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    sized = np.asarray(mesh.area_faces) > SLIVER * radius**2
    spread = np.full(len(points), np.nan)
    known = np.flatnonzero(np.isfinite(points).all(axis=1))
    boxes = [((low <= point + radius) & (high >= point - radius)).all(axis=1) & sized for point in points[known]]
    patches = _near(mesh, [np.flatnonzero(box) for box in boxes], points[known], radius)
    for k, near in zip(known, patches, strict=True):
        spread[k] = _widest_angle(mesh.face_normals[near])
        if spread[k] > EVEN:
            sides = _sides(mesh, near, points[k], radius)
            (outer,) = _near(mesh, [near[sides != 0]], points[k : k + 1], radius)
            spread[k] = _widest_angle(mesh.face_normals[outer] * sides[np.searchsorted(near, outer), None])
    return spread


def _widest_angle(normals: Array) -> float:
    """Return the widest angle between unit normals, of shape (n, 3) [rad]."""
    return float(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0).min(initial=1.0)))


def _sides(mesh: trimesh.Trimesh, faces: Indices, point: Array, radius: float) -> Indices:
    """Return for each face whether its normal points out of the solid near a point, 1, into it, −1, or neither, 0.

    Where a solid folds over itself, triangles inside have it on both sides: no finger meets them. Where folds lie on
    each other in one plane, some of those that make the surface are turned the other way.
    """
    import trimesh

    closest = trimesh.triangles.closest_point(mesh.triangles[faces], np.tile(point, (len(faces), 1)))
    inwards = mesh.triangles_center[faces] - closest  # off the border, where others begin
    length = np.linalg.norm(inwards, axis=1, keepdims=True)
    looked = closest + inwards * np.minimum(1.0, 0.1 * radius / np.maximum(length, 1e-12))
    step = BESIDE * radius * mesh.face_normals[faces]
    inside = winding_number(mesh, np.vstack([looked + step, looked - step])).reshape(2, -1) > 0.5
    return inside[1].astype(np.intp) - inside[0]


def _near(mesh: trimesh.Trimesh, faces: Sequence[Indices], points: Array, radius: float) -> list[Indices]:
    """Return for each point those of its faces within a radius that hang together with the nearest one."""
    import trimesh
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    of = np.repeat(np.arange(len(faces)), [len(each) for each in faces])
    if not of.size:
        return list(faces)
    every = np.concatenate(faces)
    closest = trimesh.triangles.closest_point(mesh.triangles[every], points[of])
    distance = np.linalg.norm(closest - points[of], axis=1)
    within = distance <= radius
    every, of, distance = every[within], of[within], distance[within]
    # Corners are nodes too, each point with its own: of different points nothing hangs together.
    corners = np.unique((mesh.faces[every] + of[:, None] * len(mesh.vertices)).ravel(), return_inverse=True)[1]
    rows, count = np.repeat(np.arange(len(every)), 3), len(every) + corners.max(initial=-1) + 1
    links = coo_array((np.ones(len(rows)), (rows, len(every) + corners)), shape=(count, count))
    labels = connected_components(links, directed=False)[1][: len(every)]
    result = []
    for k in range(len(faces)):
        mine = np.flatnonzero(of == k)
        nearest = labels[mine[np.argmin(distance[mine])]] if mine.size else 0
        result.append(every[mine[labels[mine] == nearest]])
    return result


def _signed(mesh: trimesh.Trimesh, points: Array) -> tuple[Array, Indices, Array]:
    """Return signed distances, nearest triangles and nearest points."""
    import igl

    vertices, faces = _arrays(mesh)
    square, nearest, closest = igl.point_mesh_squared_distance(points, vertices, faces)
    inside = _inside(mesh, points, np.sqrt(square))
    return np.where(inside, -1.0, 1.0) * np.sqrt(square), np.asarray(nearest), np.asarray(closest)


def _inside(mesh: trimesh.Trimesh, points: Array, distance: Array) -> npt.NDArray[np.bool_]:
    """Return which points are inside, by few winding numbers: within a ball without surface all are on one side.

    In cells of falling size the point farthest from the surface speaks for those that its ball covers.
    """
    inside = np.zeros(len(points), dtype=bool)
    left, cell = np.arange(len(points)), float(mesh.extents.max()) / 4
    for _ in range(CELL_SIZES):
        if len(left) <= FEW:
            break
        cells = np.floor((points[left] - mesh.bounds[0]) / cell).astype(np.int64)
        codes = (cells - cells.min(axis=0)) @ [1 << 40, 1 << 20, 1]
        order = np.lexsort((-distance[left], codes))
        first = np.flatnonzero(np.diff(codes[order], prepend=-1))
        speaker = np.empty(len(left), dtype=np.intp)
        speaker[order] = np.repeat(np.arange(len(first)), np.diff(first, append=len(left)))
        leading = left[order[first]]
        said = winding_number(mesh, points[leading]) > 0.5
        centre = leading[speaker]
        covered = np.linalg.norm(points[left] - points[centre], axis=1) < distance[centre]
        covered[order[first]] = True
        inside[left[covered]] = said[speaker[covered]]
        left, cell = left[~covered], cell / 2
    inside[left] = winding_number(mesh, points[left]) > 0.5
    return inside


def _arrays(mesh: trimesh.Trimesh) -> tuple[Array, Indices]:
    """Return vertices and triangles as libigl takes them."""
    return np.array(mesh.vertices, dtype=float), np.array(mesh.faces, dtype=np.int64)
