"""Distances of segments from each other and from an object, vectorised; smooth aggregates of many distances."""

from __future__ import annotations

import numpy as np

from ..objects import GraspObject, SurfaceSample
from ..spatial import Array, Indices, namespace

SEARCH_STEPS = 40
"""Most steps of the search along a segment."""
PINCHED = 1e-6
"""Width of the bracket [m] at which φ has a kink in it, as on the medial axis of the object."""
SEARCH_TOLERANCE = 1e-7
"""Step along the segment [m] below which the rest is done by Taylor's formula, of second order in it."""


def segment_pairs(start_a: Array, end_a: Array, start_b: Array, end_b: Array) -> tuple[Array, Array]:
    """Return the closest points of pairs of segments (C. Ericson, Real-Time Collision Detection, 5.1.9).

    Args:
        start_a: Start of each first segment [m], of shape (m, 3).
        end_a: End of each first segment; a segment may be a point.
        start_b: Start of each second segment.
        end_b: End of each second segment.

    Returns:
        Closest points on the first and on the second segments, of shape (m, 3) each.
    """
    xp = namespace(start_a)
    along_a, along_b, apart = end_a - start_a, end_b - start_b, start_a - start_b
    a = xp.einsum("ij,ij->i", along_a, along_a)
    e = xp.einsum("ij,ij->i", along_b, along_b)
    b = xp.einsum("ij,ij->i", along_a, along_b)
    c = xp.einsum("ij,ij->i", along_a, apart)
    f = xp.einsum("ij,ij->i", along_b, apart)
    safe_a, safe_e = xp.maximum(a, 1e-18), xp.maximum(e, 1e-18)
    denominator = a * e - b * b
    regular = denominator > 1e-12 * a * e
    s = xp.where(regular, (b * f - c * e) / xp.where(regular, denominator, 1.0), 0.5)
    s = xp.minimum(xp.maximum(s, 0.0), 1.0)
    t = (b * s + f) / safe_e
    held = xp.minimum(xp.maximum(t, 0.0), 1.0)
    s = xp.where((t != held) | (e <= 1e-18) | ~regular, (b * held - c) / safe_a, s)
    s = xp.minimum(xp.maximum(s, 0.0), 1.0)
    held = xp.minimum(xp.maximum((b * s + f) / safe_e, 0.0), 1.0)
    return start_a + s[:, None] * along_a, start_b + held[:, None] * along_b


class SegmentSearch:
    """The point of least signed distance on each of m segments, t* = argmin φ(p(t)).

    φ is convex along a segment if the object is; then bisection on the sign of dφ/dt, with Newton steps where they
    stay inside, finds t*. By the envelope theorem the derivative of the least distance is ∇φ·∂p(t*)/∂x, inside the
    object as well as outside. The search starts from the last result, which changes it by rounding only.
    """

    def __init__(self, grasp_object: GraspObject, count: int) -> None:
        self.grasp_object = grasp_object
        self._last = np.full(count, 0.5)

    def least(self, start: Array, end: Array, reach: Array) -> tuple[Array, Array, Array]:
        """Find the least distances.

        Args:
            start: Starts in O [m], of shape (m, 3).
            end: Ends in O [m], of shape (m, 3); a segment may be a point.
            reach: Distance beyond which a segment need not be searched [m], of shape (m,).

        Returns:
            Least distances [m] (m,), points there (m, 3) and ∇φ (m, 3). Segments that stay beyond their reach get
            a lower bound of their distance.
        """
        along = end - start
        length = np.sqrt(np.einsum("ij,ij->i", along, along))
        t = self._first_guess(start, along)
        distance, gradient = np.empty(len(t)), np.empty((len(t), 3))
        bracket: _Bracket | None = None
        active = np.arange(len(t))
        for _ in range(SEARCH_STEPS):
            at, ahead = t[active], along[active]
            sample = self.grasp_object.sample(start[active] + at[:, None] * ahead)
            slope, move, value, normal = _newton(sample, ahead)
            settled = ((at <= 0.0) & (slope >= 0.0)) | ((at >= 1.0) & (slope <= 0.0))
            if bracket is None:  # the first step; φ is 1-Lipschitz: far segments need no search
                least = sample.distance - np.maximum(at, 1.0 - at) * length[active]
                far = ~settled & (least > reach)
                sample.distance[far] = least[far]
                settled |= far
            else:
                bracket.update(active, at, slope, sample)
                pinched = ~settled & (bracket.width(active) * length[active] < PINCHED) & (length[active] > 0.0)
                if pinched.any():
                    sample.distance[pinched], sample.gradient[pinched] = bracket.kink(active[pinched])
                settled |= pinched
            distance[active] = np.where(settled, sample.distance, value)
            gradient[active] = np.where(settled[:, None], sample.gradient, normal)
            done = settled | (np.abs(move) * length[active] < SEARCH_TOLERANCE)
            if done.all():
                t[active] = np.where(settled, at, np.minimum(np.maximum(at + move, 0.0), 1.0))
                break
            if bracket is None:  # most searches end before they need one
                bracket = _Bracket(len(t))
                bracket.update(active, at, slope, sample)
            t[active] = np.where(settled, at, bracket.inside(active, at + move))
            active = active[~done]
        self._last = t
        return distance, start + t[:, None] * along, gradient

    def _first_guess(self, start: Array, along: Array) -> Array:
        """Return where the search starts; for objects that are not convex the best of several points."""
        if self.grasp_object.convex:
            return self._last.copy()
        grid = np.linspace(0.0, 1.0, 5)
        points = start[:, None] + grid[None, :, None] * along[:, None]
        distance = self.grasp_object.sample(points.reshape(-1, 3)).distance
        return grid[np.argmin(distance.reshape(-1, grid.size), axis=1)]


class _Bracket:
    """Where the least φ of each segment is known to lie, and ∇φ at both ends; ends not tried lie beyond [0, 1]."""

    def __init__(self, count: int) -> None:
        self._low, self._high = np.full(count, -0.1), np.full(count, 1.1)
        self._by_low, self._by_high = np.zeros((count, 5)), np.zeros((count, 5))

    def update(self, active: Indices, t: Array, slope: Array, sample: SurfaceSample) -> None:
        """Take new points in: φ falls at ``t`` where the slope is negative, and rises where it is positive."""
        ends = np.empty((len(t), 5))  # slope, φ of the tangent at t = 0, ∇φ
        ends[:, 0], ends[:, 1], ends[:, 2:] = slope, sample.distance - slope * t, sample.gradient
        falls, rises = slope < 0.0, slope > 0.0
        self._low[active[falls]], self._by_low[active[falls]] = t[falls], ends[falls]
        self._high[active[rises]], self._by_high[active[rises]] = t[rises], ends[rises]

    def width(self, active: Indices) -> Array:
        """Return the widths in t."""
        return self._high[active] - self._low[active]

    def inside(self, active: Indices, proposed: Array) -> Array:
        """Return proposed points, or the middles of the brackets where these lead to a point already tried."""
        low, high = self._low[active], self._high[active]
        proposed = np.minimum(np.maximum(proposed, 0.0), 1.0)
        middle = 0.5 * (np.maximum(low, 0.0) + np.minimum(high, 1.0))
        return np.where((proposed <= low) | (proposed >= high), middle, proposed)

    def kink(self, active: Indices) -> tuple[Array, Array]:
        """Return φ and its derivative where the tangents at both ends meet: ∇φ there without its part along."""
        low, high = self._by_low[active], self._by_high[active]
        share = (high[:, 0] / np.maximum(high[:, 0] - low[:, 0], 1e-300))[:, None]
        both = share * low + (1.0 - share) * high
        return both[:, 1], both[:, 2:]


def _newton(sample: SurfaceSample, along: Array) -> tuple[Array, Array, Array, Array]:
    """Return dφ/dt, the Newton step in t, and φ and ∇φ after it by Taylor's formula."""
    slope = np.einsum("ij,ij->i", sample.gradient, along)
    bent = np.einsum("ijk,ik->ij", sample.hessian, along)
    curvature = np.einsum("ij,ij->i", bent, along)
    flat = curvature <= 1e-12
    move = np.where(flat, np.where(np.abs(slope) < 1e-12, 0.0, -np.sign(slope)), 0.0)
    move = move - np.where(flat, 0.0, slope / np.where(flat, 1.0, curvature))
    value = sample.distance + slope * move + 0.5 * curvature * move * move
    return slope, move, value, sample.gradient + bent * move[:, None]


def saturate(distance: Array, limit: float) -> tuple[Array, Array]:
    """Return distances cut off smoothly (C¹): unchanged up to half the limit, constant from 1.5 times the limit.

    Args:
        distance: Distances d [m], of shape (m,).
        limit: Largest value s [m].

    Returns:
        s(d) ≤ d [m] and ds/dd, of shape (m,) each.
    """
    over = np.minimum(np.maximum(distance - 0.5 * limit, 0.0), limit)
    return np.minimum(distance, 0.5 * limit) + over - over * over / (2.0 * limit), 1.0 - over / limit


def grouped_minimum(values: Array, groups: Indices, count: int, temperature: float) -> tuple[Array, Array]:
    """Return smooth minima of groups of values, never above the true ones.

    −T ln Σ exp(−v/T): below the minimum by at most T ln(size of the group).

    Args:
        values: Values, of shape (m,).
        groups: Group of each value, from 0, of shape (m,).
        count: Number of groups; each has at least one value.
        temperature: T, in the unit of the values.

    Returns:
        The minima, of shape (count,), and the derivative of each value's group minimum by it, of shape (m,).
    """
    least = np.full(count, np.inf)
    np.minimum.at(least, groups, values)
    weights = np.exp((least[groups] - values) / temperature)
    total = np.bincount(groups, weights, count)
    return least - temperature * np.log(total), weights / total[groups]
