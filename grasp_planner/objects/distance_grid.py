"""A C² signed distance of a mesh: a tricubic B-spline of exact distances at the nodes of a graded grid.

Around the bounding box the nodes are one resolution apart; outside they spread as sinh, so that a fingertip far
away still sees a smooth field. The spline interpolates: on smooth faces its error is some micrometres, at sharp
edges a fraction of the resolution; the error is measured when the grid is built.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..spatial import Array
from .base import SurfaceSample
from .simplify import simplified
from .triangles import Triangles

if TYPE_CHECKING:
    import trimesh

SPREAD = 10.0
"""Outside the box the spacing is resolution · √(1 + (s / L)²) at the distance s, L = 10 resolutions."""
REACH = 1.2
"""How far the grid reaches around the box, in largest extents."""
RIM = 4
"""Outermost cells that are not used: the ends of the spline ring there."""
STRIDE = 4
"""Far from the surface only every fourth node is exact; the rest is interpolated."""
BAND_OUTSIDE, BAND_INSIDE = 0.016, 4.0
"""Nodes are exact up to 16 mm outside the surface, where SPACING is kept, and 4 resolutions inside."""
SPACING = 1.1e-3
"""Exact nodes farther than 4 resolutions from the surface may be this far apart [m]."""
FLATNESS = 0.02
"""How far a mesh of many triangles is simplified for the nodes, in resolutions; the error is measured on all of it."""
MAX_NODES = 10_000_000
"""Most nodes of a grid; the resolution follows if it has to."""
REFINEMENT = 0.85
"""The error falls with the resolution; how much finer than that the next attempt is."""
ATTEMPTS = 3
"""Most attempts at an error."""
PROBES = 4000
"""Points at which the error is measured …"""
EDGE_PROBES, SHARP = 4000, np.radians(20.0)
"""… and points on edges between triangles that lean by more than this angle; as many at their ends, near and around."""
AROUND = 0.012
"""How far outside the surface the error is measured: where fingertip centres are [m]."""
SAFETY = 1.2
"""What the largest error of a sample is multiplied by to state the error."""

# Values, first and second derivatives of the four cubic B-splines of a cell, as polynomials of t in [0, 1).
_B = np.array([[1, -3, 3, -1], [4, 0, -6, 3], [1, 3, 3, -3], [0, 0, 0, 1]]) / 6.0
_BASIS = np.zeros((3, 4, 4))
_BASIS[0] = _B
_BASIS[1, :, :3] = _B[:, 1:] * [1, 2, 3]
_BASIS[2, :, :2] = _B[:, 2:] * [2, 6]
_NEIGHBOURS = np.arange(-1, 3)
_FIRST = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]])


@dataclass(frozen=True)
class GridAxes:
    """Nodes of a graded grid: u = 0, 1, … along each axis, uniform between ``low`` and ``high``.

    Attributes:
        low: Lower corner of the uniform part [m], of shape (3,).
        high: Upper corner [m], of shape (3,).
        resolution: Node spacing in the uniform part [m].
        margin: Nodes outside the uniform part at each end.
        counts: Nodes along each axis.
    """

    low: Array
    high: Array
    resolution: float
    margin: int
    counts: tuple[int, int, int]

    @classmethod
    def around(cls, bounds: Array, resolution: float) -> GridAxes:
        """Return the axes around a bounding box [m], of shape (2, 3), with a multiple of STRIDE cells."""
        extents = bounds[1] - bounds[0]
        reach = REACH * extents.max() / (SPREAD * resolution)
        margin = int(np.ceil(SPREAD * np.arcsinh(reach))) + RIM
        cells = np.ceil(extents / resolution).astype(int) + 2
        cells += -(cells + 2 * margin) % STRIDE
        middle = bounds.mean(axis=0)
        half = cells * resolution / 2
        n_x, n_y, n_z = (cells + 2 * margin + 1).tolist()
        return cls(middle - half, middle + half, resolution, margin, (n_x, n_y, n_z))

    def nodes(self, axis: int) -> Array:
        """Return the coordinates of the nodes along an axis [m]."""
        index = np.arange(self.counts[axis])
        inner = np.clip(index, self.margin, self.counts[axis] - 1 - self.margin)
        outer = SPREAD * self.resolution * np.sinh((index - inner) / SPREAD)
        return self.low[axis] + (inner - self.margin) * self.resolution + outer

    def locate(self, points: Array) -> tuple[Array, Array, Array]:
        """Return grid coordinates u of points with du/dx [1/m] and d²u/dx² [1/m²], of shape (n, 3) each."""
        inner = np.minimum(np.maximum(points, self.low), self.high)
        over = (points - inner) / (SPREAD * self.resolution)
        stretch = 1.0 / (1.0 + over * over)
        slope = np.sqrt(stretch) / self.resolution
        bend = -over * stretch * slope / (SPREAD * self.resolution)
        return self.margin + (inner - self.low) / self.resolution + SPREAD * np.arcsinh(over), slope, bend


class DistanceGrid:
    """The spline on the grid.

    Attributes:
        axes: The grid.
        coefficients: B-spline coefficients [m], of the shape of the grid, single precision.
        error: Largest error on and up to 12 mm outside the surface against the exact distance [m].
    """

    def __init__(self, axes: GridAxes, coefficients: Array, error: float) -> None:
        self.axes = axes
        self.coefficients = coefficients
        self.error = error
        counts = np.array(axes.counts)
        self._flat = coefficients.reshape(-1)
        strides = np.array([counts[1] * counts[2], counts[2], 1])
        self._strides = strides
        x, y, z = (_NEIGHBOURS * stride for stride in strides)
        self._stencil = x[:, None, None] + y[None, :, None] + z[None, None, :]
        rim = np.array([[axes.nodes(k)[RIM], axes.nodes(k)[-1 - RIM]] for k in range(3)])
        self._low, self._high = rim[:, 0], rim[:, 1]

    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the spline with gradient and Hessian.

        Outside the grid the distance to the grid's box is added to the value at the closest point of the box.

        Args:
            points: Points [m], of shape (n, 3).

        Returns:
            Distance, gradient and Hessian.
        """
        held = np.minimum(np.maximum(points, self._low), self._high)
        u, slope, bend = self.axes.locate(held)
        cell = u.astype(np.intp)
        t = u - cell
        powers = np.stack([np.ones_like(t), t, t * t, t * t * t], axis=-1)
        weights = np.einsum("nap,dkp->andk", powers, _BASIS)
        patch = self._flat[(cell @ self._strides)[:, None, None, None] + self._stencil].astype(float)
        # Contract z, y, x in turn, keeping orders 0, 1, 2 of each: mixed[n, a, b, c] = ∂ˣᵃ ∂ʸᵇ ∂ᶻᶜ by u.
        n = len(points)
        mixed = patch.reshape(n, 16, 4) @ weights[2].transpose(0, 2, 1)
        mixed = weights[1][:, None] @ mixed.reshape(n, 4, 4, 3)
        mixed = (weights[0] @ mixed.reshape(n, 4, 9)).reshape(n, 3, 3, 3)
        gradient_u = mixed[:, _FIRST[:, 0], _FIRST[:, 1], _FIRST[:, 2]]
        order = _FIRST[:, None] + _FIRST[None, :]
        hessian = mixed[:, order[..., 0], order[..., 1], order[..., 2]] * slope[:, :, None] * slope[:, None, :]
        diagonal = np.arange(3)
        hessian[:, diagonal, diagonal] += gradient_u * bend
        sample = SurfaceSample(mixed[:, 0, 0, 0], gradient_u * slope, hessian)
        return sample if (held == points).all() else _extended(sample, points - held)


def _extended(sample: SurfaceSample, over: Array) -> SurfaceSample:
    """Return a sample continued outside the box by the distance to it."""
    inside = over == 0.0
    length = np.sqrt((over * over).sum(axis=1))
    safe = np.maximum(length, 1e-12)
    away = over / safe[:, None]
    kept = inside[:, :, None] & inside[:, None, :]
    ring = np.eye(3) * ~inside[:, :, None] - away[:, :, None] * away[:, None, :]
    return SurfaceSample(
        sample.distance + length,
        np.where(inside, sample.gradient, 0.0) + away,
        np.where(kept, sample.hessian, 0.0) + ring / safe[:, None, None],
    )


def build_distance_grid(mesh: trimesh.Trimesh, resolution: float, tolerance: float = np.inf) -> DistanceGrid:
    """Return the distance grid of a solid; takes seconds.

    Args:
        mesh: Watertight mesh with outward normals [m].
        resolution: Node spacing around the surface [m]; coarser if there would be more than MAX_NODES.
        tolerance: Error above which the grid is refined, as far as MAX_NODES allows [m].

    Returns:
        The grid with its measured error.
    """
    grid = _built(mesh, resolution)
    for _ in range(ATTEMPTS - 1):
        if grid.error <= tolerance:
            break
        finer = _built(mesh, max(REFINEMENT * tolerance / grid.error, 0.3) * grid.axes.resolution)
        if finer.axes.resolution > 0.95 * grid.axes.resolution:
            break
        grid = finer
    return grid


def _built(mesh: trimesh.Trimesh, resolution: float) -> DistanceGrid:
    """Return the grid of one resolution, or of the finest that is allowed."""
    import scipy.ndimage

    axes = GridAxes.around(mesh.bounds, resolution)
    while np.prod(axes.counts, dtype=float) > MAX_NODES:
        resolution *= 1.05
        axes = GridAxes.around(mesh.bounds, resolution)
    values = _distances(simplified(mesh, FLATNESS * resolution), axes)
    coefficients = scipy.ndimage.spline_filter(values, order=3, output=np.float64, mode="mirror")
    grid = DistanceGrid(axes, coefficients.astype(np.float32), 0.0)
    return DistanceGrid(axes, grid.coefficients, measured_error(mesh, grid))


def measured_error(mesh: trimesh.Trimesh, grid: DistanceGrid) -> float:
    """Return the largest error of a grid at random points on and up to 12 mm outside the surface and its edges [m].

    A sample misses the very worst point: a fifth is added.
    """
    import trimesh

    rng = np.random.default_rng(0)
    points, faces = trimesh.sample.sample_surface(mesh, PROBES, seed=0)
    lift = rng.uniform(0.0, AROUND, PROBES)
    lift[: PROBES // 2] = 0.0
    points = np.asarray(points) + lift[:, None] * mesh.face_normals[faces]
    triangles = Triangles.of(mesh)
    on, around = _edge_points(mesh, triangles, grid.axes.resolution, rng)
    points = np.vstack([points, on, around])
    exact = triangles.signed_distance(points)
    counts = np.append(np.full(len(points) - len(around), True), exact[-len(around) :] >= 0.0)
    return SAFETY * float(np.abs(grid.sample(points[counts]).distance - exact[counts]).max())


def _edge_points(
    mesh: trimesh.Trimesh, triangles: Triangles, resolution: float, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return where a grid is worst: on sharp edges and beside corners, and up to 12 mm around both.

    Returns:
        Points on the surface and points around, of which some are inside [m], of shape (n, 3) and (m, 3).
    """
    sharp = mesh.face_adjacency_edges[mesh.face_adjacency_angles > SHARP]
    vertices = np.asarray(mesh.vertices)
    weight = np.abs(np.asarray(mesh.vertex_defects)) + 1e-12  # half of the probes go to corners as they are pointed
    weight /= weight.sum()
    ends = np.unique(sharp)
    weight[ends] += 1.0 / max(len(ends), 1)
    corners = vertices[rng.choice(len(vertices), EDGE_PROBES, p=weight / weight.sum())]
    beside = corners + rng.uniform(-resolution, resolution, corners.shape)
    points = [corners, triangles.nearest(beside).points]
    if len(sharp):
        start, end = vertices[sharp[:, 0]], vertices[sharp[:, 1]]
        length = np.linalg.norm(end - start, axis=1)
        chosen = rng.choice(len(sharp), EDGE_PROBES, p=length / length.sum())
        points.append(start[chosen] + rng.uniform(size=(EDGE_PROBES, 1)) * (end - start)[chosen])
    middle = np.vstack([points[0], points[-1]])
    away = rng.normal(size=middle.shape)
    away *= AROUND * rng.uniform(size=(len(middle), 1)) ** 2 / np.linalg.norm(away, axis=1, keepdims=True)
    return np.vstack(points), middle + away


def _distances(mesh: trimesh.Trimesh, axes: GridAxes) -> Array:
    """Return distances at all nodes: every STRIDE-th is exact; between these, nodes are exact near the surface.

    Where fingertip centres are, BAND_OUTSIDE, exact nodes are no farther apart than SPACING.
    """
    nodes = [axes.nodes(axis) for axis in range(3)]
    coarse, triangles = [line[::STRIDE] for line in nodes], Triangles.of(mesh)
    values = triangles.signed_distance(_product(coarse)).reshape([len(line) for line in coarse])
    fine = 2 * axes.resolution <= SPACING
    inside = BAND_INSIDE * axes.resolution
    for stride, outside in ((2, BAND_OUTSIDE if fine else 0.0), (1, inside if fine else BAND_OUTSIDE)):
        values = _doubled(values)
        if outside == 0.0:
            continue
        slack = STRIDE * axes.resolution  # what interpolation between every fourth node may be wrong by
        near = (values < outside + slack) & (values > -(inside + slack))
        points = [line[::stride][index] for line, index in zip(nodes, np.nonzero(near), strict=True)]
        values[near] = triangles.signed_distance(np.column_stack(points))
    return values


def _doubled(values: Array) -> Array:
    """Return values at the nodes and between them, by cubic interpolation along each axis."""
    import scipy.interpolate

    for axis, count in enumerate(values.shape):
        index = np.arange(count)
        refine = scipy.interpolate.make_interp_spline(index, np.eye(count), k=3)(np.arange(2 * count - 1) / 2)
        values = np.moveaxis(np.tensordot(refine, values, axes=(1, axis)), 0, axis)
    return values


def _product(lines: list[Array]) -> Array:
    """Return all nodes of a grid, of shape (n, 3), last axis fastest."""
    return np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
