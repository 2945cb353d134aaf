"""A small renderer in NumPy, for pictures on machines without display or graphics card: depth buffer, light, shadow.

Every pixel keeps the nearest triangle, is lit by a key light that casts a shadow, a fill light and the sky, and what is
transparent is laid over it, the far sides first. Pixels are computed four times as fine as the picture.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import maximum_filter, minimum_filter

from ..spatial import Array
from .look import Colour
from .view import NEAR, DrawnMesh, View

Pixels = npt.NDArray[np.uint8]
Indices = npt.NDArray[np.int64]

FINE = 2
"""Pixels computed for each pixel of the picture, along each side."""
CHUNK = 2_000_000
"""Most samples tested at once."""
KEY, FILL = np.array([0.45, 0.35, 0.82]), np.array([-0.6, -0.5, 0.3])
"""Directions towards the lights, in the world."""
SKY, KEY_SHARE, FILL_SHARE, SHADOW = 0.50, 0.52, 0.16, 0.55
"""What the sky, the two lights and a shadow give or take."""
SHADOW_PIXELS, SHADOW_BIAS = 1024, 2e-3
"""Side of the shadow's depth picture, and how far behind it counts as in shadow [m]."""
OFFSETS, SOFTENED = (-2.25, -0.75, 0.75, 2.25), 7
"""Where around a place the shadow is looked up [pixels], and the side of the square that holds all these places."""


@dataclass(frozen=True)
class _Triangles:
    """All triangles of some solids with what shading needs."""

    corners: Array
    normals: Array
    colours: Array
    floors: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, solids: Sequence[DrawnMesh]) -> _Triangles:
        """Collect them."""
        counts = [len(solid.mesh.faces) for solid in solids]
        return cls(
            np.concatenate([np.asarray(solid.mesh.triangles) for solid in solids] or [np.zeros((0, 3, 3))]),
            np.concatenate([solid.corner_normals for solid in solids] or [np.zeros((0, 3, 3))]),
            np.repeat(np.array([solid.colour for solid in solids], dtype=float).reshape(-1, 3), counts, axis=0),
            np.repeat(np.array([solid.floor for solid in solids], dtype=bool), counts),
        )


@dataclass(frozen=True)
class _Hits:
    """What is nearest in every pixel of some lines: depth, triangle (−1: none) and weights of two of its corners."""

    pixels: slice
    depth: Array
    triangle: Indices
    weights: Array


def render(solids: Sequence[DrawnMesh], view: View, background: Colour = (255, 255, 255)) -> Pixels:
    """Return a picture of solids.

    Args:
        solids: What is to be seen.
        view: The camera.
        background: Colour where nothing is.

    Returns:
        RGB, of shape (height, width, 3).
    """
    fine = View(view.eye, view.target, view.field_of_view, FINE * view.width, FINE * view.height, view.reach)
    opaque = [solid for solid in solids if solid.opacity >= 1.0]
    triangles = _Triangles.of(opaque)
    shadow = _ShadowMap([solid for solid in opaque if not solid.floor] + [s for s in solids if s.opacity < 1.0])
    hits = _rasterised(triangles.corners, fine)
    image = np.empty((fine.height * fine.width, 3))
    image[:] = background
    _paint(image, hits, triangles, fine, shadow, 1.0)
    clear = sorted(
        (solid for solid in solids if solid.opacity < 1.0),
        key=lambda solid: -float(np.linalg.norm(solid.mesh.bounds.mean(axis=0) - view.eye)),
    )
    for front in (False, True):
        for solid in clear:
            _lay_over(image, hits, solid, fine, shadow, front=front)
    small = image.reshape(view.height, FINE, view.width, FINE, 3).mean(axis=(1, 3))
    return np.clip(small + 0.5, 0, 255).astype(np.uint8)


def _lay_over(image: Array, behind: _Hits, solid: DrawnMesh, view: View, shadow: _ShadowMap, *, front: bool) -> None:
    """Lay the front or the back of a transparent solid over the picture, where nothing opaque hides it."""
    whole = _Triangles.of([solid])
    middle = whole.corners.mean(axis=1)
    outward = np.cross(whole.corners[:, 1] - whole.corners[:, 0], whole.corners[:, 2] - whole.corners[:, 0])
    chosen = (np.einsum("ij,ij->i", outward, view.eye - middle) > 0.0) == front
    side = _Triangles(whole.corners[chosen], whole.normals[chosen], whole.colours[chosen], whole.floors[chosen])
    hits = _rasterised(side.corners, view, cropped=True)
    hidden = hits.depth >= behind.depth[hits.pixels]
    seen = _Hits(hits.pixels, hits.depth, np.where(hidden, -1, hits.triangle), hits.weights)
    _paint(image[hits.pixels], seen, side, view, shadow, solid.opacity)


def _paint(image: Array, hits: _Hits, triangles: _Triangles, view: View, shadow: _ShadowMap, opacity: float) -> None:
    """Light what was hit and lay it over the picture."""
    pixels = np.flatnonzero(hits.triangle >= 0)
    if not pixels.size:
        return
    which, (first, second) = hits.triangle[pixels], hits.weights[:, pixels]
    weights = np.stack([1.0 - first - second, first, second], axis=1)
    points = np.einsum("ij,ijk->ik", weights, triangles.corners[which])
    dark, floor = shadow.darkness(points), triangles.floors[which]
    colours = triangles.colours[which]
    colours[floor] *= 1.0 - 0.2 * dark[floor, None]
    lit = np.flatnonzero(~floor)
    normals = np.einsum("ij,ijk->ik", weights[lit], triangles.normals[which[lit]])
    colours[lit] = _lit(colours[lit], normals, view.eye - points[lit], dark[lit], opacity)
    image[pixels] += opacity * (colours - image[pixels])


def _lit(colours: Array, normals: Array, towards: Array, dark: Array, opacity: float) -> Array:
    """Return colours in the light, given normals, the ways to the eye and how much of the key light is missing."""
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    facing = np.sign(np.einsum("ij,ij->i", normals, towards))
    normals *= np.where(facing == 0.0, 1.0, facing)[:, None]
    key = np.clip(normals @ (KEY / np.linalg.norm(KEY)), 0.0, None) * (1.0 - dark)
    fill = np.clip(normals @ (FILL / np.linalg.norm(FILL)), 0.0, None)
    light = SKY * (0.8 + 0.2 * normals[:, 2]) + KEY_SHARE * key + FILL_SHARE * fill
    # What is seen through is lit from behind too.
    light = 1.0 - opacity + opacity * light
    half = KEY / np.linalg.norm(KEY) + towards / np.linalg.norm(towards, axis=1, keepdims=True)
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    shine = np.clip(np.einsum("ij,ij->i", normals, half), 0.0, 1.0) ** 40 * (1.0 - dark)
    return np.minimum(colours * light[:, None] + 45.0 * shine[:, None], 255.0)


class _ShadowMap:
    """How far the key light reaches."""

    def __init__(self, solids: Sequence[DrawnMesh]) -> None:
        triangles = _Triangles.of(solids)
        points = triangles.corners.reshape(-1, 3)
        centre = points.mean(axis=0) if len(points) else np.zeros(3)
        reach = float(np.linalg.norm(points - centre, axis=1).max()) if len(points) else 1.0
        eye = centre + 2.0 * reach * KEY / np.linalg.norm(KEY)
        self._view = View(eye, centre, 0.0, SHADOW_PIXELS, SHADOW_PIXELS, 1.05 * reach)
        self._depth = _rasterised(triangles.corners, self._view).depth.reshape(SHADOW_PIXELS, SHADOW_PIXELS)
        self._nearest = minimum_filter(self._depth, SOFTENED, mode="nearest")
        self._farthest = maximum_filter(self._depth, SOFTENED, mode="nearest")

    def darkness(self, points: Array) -> Array:
        """Return how much of the key light points miss, softened at the edges, of shape (n,)."""
        across, down, depth = self._view.project(points).T
        depth -= SHADOW_BIAS
        x, y = (np.clip(place, 0, SHADOW_PIXELS - 1).astype(int) for place in (across, down))
        found = np.where(self._farthest[y, x] < depth, float(len(OFFSETS) ** 2), 0.0)
        # Only near the edge of a shadow do the places around differ.
        edge = np.flatnonzero((self._nearest[y, x] < depth) & (found == 0.0))
        across, down, depth = across[edge], down[edge], depth[edge]
        for i in OFFSETS:
            for j in OFFSETS:
                x = np.clip(across + i, 0, SHADOW_PIXELS - 1).astype(int)
                y = np.clip(down + j, 0, SHADOW_PIXELS - 1).astype(int)
                found[edge] += self._depth[y, x] < depth
        return SHADOW * found / len(OFFSETS) ** 2


def _rasterised(corners: Array, view: View, *, cropped: bool = False) -> _Hits:
    """Return the nearest triangle of every pixel; cropped, only of the lines of the picture that triangles reach."""
    screen, top, bottom = view.project(corners), 0, view.height
    if cropped and len(screen):
        top, bottom = (int(np.clip(edge, 0, view.height)) for edge in _lines(screen))
    pixels = slice(top * view.width, bottom * view.width)
    count = pixels.stop - pixels.start
    depth, triangle, weights = np.full(count, np.inf), np.full(count, -1), np.zeros((2, count))
    for which, place, shares in _samples(screen, view):
        place -= pixels.start
        # Over the screen the inverse of the depth is linear; with parallel rays the depth itself.
        if view.field_of_view:
            shares = shares / screen[which, :, 2].T
            near = 1.0 / shares.sum(axis=0)
            shares *= near
        else:
            near = (shares * screen[which, :, 2].T).sum(axis=0)
        np.minimum.at(depth, place, near)
        best = near <= depth[place]
        triangle[place[best]] = which[best]
        weights[:, place[best]] = shares[1:, best]
    return _Hits(pixels, depth, triangle, weights)


def _lines(screen: Array) -> tuple[float, float]:
    """Return before and behind which line of the picture there is nothing."""
    down = screen[screen[..., 2] > NEAR][:, 1]
    return (float(down.min()) - 1.0, float(down.max()) + 1.0) if len(down) else (0.0, 0.0)


def _samples(screen: Array, view: View) -> Iterator[tuple[Indices, Indices, Array]]:
    """Give the pixels inside triangles, in chunks: triangle, pixel, and weights of the corners, of shape (3, n)."""
    if not len(screen):
        return
    low, high = screen[..., :2].min(axis=1), screen[..., :2].max(axis=1)
    first = np.maximum(np.ceil(low[:, 1] - 0.5), 0).astype(int)
    last = np.minimum(np.floor(high[:, 1] - 0.5), view.height - 1).astype(int)
    seen = (screen[..., 2].min(axis=1) > NEAR) & (high[:, 0] > 0) & (low[:, 0] < view.width) & (last >= first)
    chosen = np.flatnonzero(seen)
    widths = np.minimum(high[chosen, 0], view.width) - np.maximum(low[chosen, 0], 0) + 1.0
    area = np.cumsum((last - first + 1)[chosen] * widths)
    for some in np.split(chosen, np.flatnonzero(np.diff(area // CHUNK)) + 1):
        triangles, rows = _spread(some, first[some], last[some])
        left, right = _spans(screen[triangles, :, :2], rows + 0.5)
        begin = np.maximum(np.ceil(left - 0.5), 0).astype(int)
        end = np.minimum(np.floor(right - 0.5), view.width - 1).astype(int)
        lines, columns = _spread(np.arange(len(rows)), begin, end)
        which, across = triangles[lines], rows[lines]
        yield which, columns + view.width * across, _shares(screen, which, columns + 0.5, across + 0.5)


def _spread(items: Indices, first: Indices, last: Indices) -> tuple[Indices, Indices]:
    """Return every item once for each whole number from its first to its last, with these numbers."""
    counts = np.maximum(last - first + 1, 0)
    begins = np.cumsum(counts) - counts
    return np.repeat(items, counts), np.arange(counts.sum()) - np.repeat(begins - first, counts)


def _spans(corners: Array, height: Array) -> tuple[Array, Array]:
    """Return from where to where triangles reach along horizontal lines, of shape (n,)."""
    left, right = np.full(len(height), np.inf), np.full(len(height), -np.inf)
    for i in range(3):
        one, other = corners[:, i], corners[:, (i + 1) % 3]
        rise = other[:, 1] - one[:, 1]
        share = (height - one[:, 1]) / np.where(rise == 0.0, np.nan, rise)
        crossing = np.where((share >= 0.0) & (share <= 1.0), one[:, 0] + share * (other[:, 0] - one[:, 0]), np.nan)
        left, right = np.fmin(left, crossing), np.fmax(right, crossing)
    empty = ~np.isfinite(left)
    return np.where(empty, 1.0, left), np.where(empty, 0.0, right)


def _shares(screen: Array, which: Indices, across: Array, down: Array) -> Array:
    """Return the weights of the corners of triangles at places of the screen, of shape (3, n)."""
    ax, ay = screen[:, 0, 0], screen[:, 0, 1]
    bx, by = screen[:, 1, 0] - ax, screen[:, 1, 1] - ay
    cx, cy = screen[:, 2, 0] - ax, screen[:, 2, 1] - ay
    area = bx * cy - by * cx
    inverse = 1.0 / np.where(area == 0.0, np.inf, area)
    x, y = across - ax[which], down - ay[which]
    second = (x * cy[which] - y * cx[which]) * inverse[which]
    third = (y * bx[which] - x * by[which]) * inverse[which]
    return np.clip(np.stack([1.0 - second - third, second, third]), 0.0, 1.0)
