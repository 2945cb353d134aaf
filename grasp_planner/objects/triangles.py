"""Exact answers of a triangle mesh: winding numbers, signed distance and nearest points.

Inside and outside follow from the generalized winding number, which is right where normals at edges are not (Barill et
al., Fast winding numbers for soups and clouds, 2018).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..spatial import Array, Indices

if TYPE_CHECKING:
    import trimesh

CHUNK = 400_000
"""Points whose exact distance is computed at once."""
FEW, CELL_SIZES = 1000, 6
"""Points up to which each has a winding number of its own, and how many sizes of cells share one otherwise."""
LINE = 1e-9
"""Area up to which a triangle is a line, in shares of its sides' squares."""
TOUCHING = 1e-4
"""Distance below which the direction to the nearest point says nothing and the triangle's normal is taken [m]."""


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


@dataclass(frozen=True, eq=False)
class Triangles:
    """The triangles of a solid, with what is made once of them to answer questions soon.

    Attributes:
        vertices: Corners [m], of shape (n_v, 3).
        faces: Indices of the corners of each triangle, counterclockwise seen from outside, of shape (n_f, 3).
    """

    vertices: Array
    faces: Indices

    @classmethod
    def of(cls, mesh: trimesh.Trimesh) -> Triangles:
        """Return the triangles of a mesh as it is now."""
        return cls(np.array(mesh.vertices, dtype=float), np.array(mesh.faces, dtype=np.int64))

    def corners(self, faces: Indices) -> Array:
        """Return the corners of some triangles [m], of shape (n, 3, 3)."""
        return self.vertices[self.faces[faces]]

    @cached_property
    def boxes(self) -> tuple[Array, Array]:
        """Least and largest coordinates of each triangle [m], both of shape (n_f, 3)."""
        corners = self.vertices[self.faces]
        return corners.min(axis=1), corners.max(axis=1)

    @property
    def areas(self) -> Array:
        """Areas [m²], of shape (n_f,)."""
        return self._shapes[0]

    @property
    def normals(self) -> Array:
        """Unit outward normals, of shape (n_f, 3); zero of triangles that are lines but for rounding."""
        return self._shapes[1]

    @cached_property
    def _shapes(self) -> tuple[Array, Array]:
        """Areas and normals."""
        sides = self.vertices[self.faces[:, 1:]] - self.vertices[self.faces[:, :1]]
        crosses = np.cross(sides[:, 0], sides[:, 1])
        double = np.linalg.norm(crosses, axis=1)
        flat = double <= LINE * np.einsum("ijk,ijk->i", sides, sides)
        return double / 2, np.where(flat[:, None], 0.0, crosses / np.where(flat, 1.0, double)[:, None])

    def winding_number(self, points: Array) -> Array:
        """Return the generalized winding number around points, of shape (n,)."""
        middle, volumes = self._winding
        return np.asarray(volumes.winding_number(np.ascontiguousarray(points - middle)))

    def signed_distance(self, points: Array) -> Array:
        """Return the exact signed distance of points from the solid, negative inside [m], of shape (n,)."""
        return np.concatenate([self._signed(points[k : k + CHUNK])[0] for k in range(0, len(points), CHUNK)])

    def nearest(self, points: Array) -> NearestPoints:
        """Return distances from the solid, the nearest points of its surface and its normals there.

        Args:
            points: Points [m], of shape (n, 3).

        Returns:
            The nearest points; normals are those of the triangles for points on the surface, otherwise the direction
            to the nearest point, which at an edge is between those of its triangles.
        """
        distance, faces, closest = self._signed(points)
        normals = self.normals[faces]
        off = np.abs(distance) > TOUCHING
        normals[off] = (points - closest)[off] / distance[off, None]
        return NearestPoints(distance, closest, normals)

    def _signed(self, points: Array) -> tuple[Array, Indices, Array]:
        """Return signed distances, nearest triangles and nearest points."""
        square, nearest, closest = self._tree.squared_distance(self.vertices, self.faces, np.ascontiguousarray(points))
        distance = np.sqrt(square)
        sign = np.where(self._inside(points, distance), -1.0, 1.0)
        return sign * distance, np.asarray(nearest), np.asarray(closest)

    def _inside(self, points: Array, distance: Array) -> npt.NDArray[np.bool_]:
        """Return which points are inside, by few winding numbers: in a ball without surface all are on one side.

        In cells of falling size the point farthest from the surface speaks for those that its ball covers.
        """
        inside = np.zeros(len(points), dtype=bool)
        low, high = self.vertices.min(axis=0), self.vertices.max(axis=0)
        left, cell = np.arange(len(points)), float((high - low).max()) / 4
        for _ in range(CELL_SIZES):
            if len(left) <= FEW:
                break
            cells = np.floor((points[left] - low) / cell).astype(np.int64)
            codes = (cells - cells.min(axis=0)) @ [1 << 40, 1 << 20, 1]
            order = np.lexsort((-distance[left], codes))
            first = np.flatnonzero(np.diff(codes[order], prepend=-1))
            speaker = np.empty(len(left), dtype=np.intp)
            speaker[order] = np.repeat(np.arange(len(first)), np.diff(first, append=len(left)))
            leading = left[order[first]]
            said = self.winding_number(points[leading]) > 0.5
            centre = leading[speaker]
            covered = np.linalg.norm(points[left] - points[centre], axis=1) < distance[centre]
            covered[order[first]] = True
            inside[left[covered]] = said[speaker[covered]]
            left, cell = left[~covered], cell / 2
        inside[left] = self.winding_number(points[left]) > 0.5
        return inside

    @cached_property
    def _winding(self) -> tuple[Array, Any]:
        """The middle, and the volumes that winding numbers are summed over, about it: they are single precision."""
        import igl

        middle, volumes = (self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2, igl.FastWindingNumberBVH()
        volumes.init(self.vertices - middle, self.faces)
        return middle, volumes

    @cached_property
    def _tree(self) -> Any:
        """The triangles in a tree of bounding boxes."""
        import igl

        tree = igl.AABB()
        tree.init(self.vertices, self.faces)
        return tree
