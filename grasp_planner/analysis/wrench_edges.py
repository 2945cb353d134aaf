"""Wrench spaces of cones cut into pyramids: ε and volume as other tools have them, and the least weight of an edge."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, QhullError

from ..spatial import Array
from .wrench_space import WrenchSpace


def faceted_epsilon(space: WrenchSpace, edges: int = 8) -> float:
    """Return ε as GraspIt! has it: each cone cut into a pyramid, the hull of the edges' wrenches; ≤ the exact one.

    Args:
        space: The space, bounded ``L1``.
        edges: Edges of each pyramid.

    Returns:
        ε of the pyramids, 0 where the origin is not inside.
    """
    wrenches = edge_wrenches(space, edges)
    try:
        hull = ConvexHull(np.vstack([wrenches, np.zeros((1, 6))]))
    except QhullError:
        return 0.0
    return max(0.0, float((-hull.equations[:, -1]).min()))


def wrench_volume(space: WrenchSpace, edges: int = 8) -> float:
    """Return the volume of the pyramids' wrench space; [Miller1999]. Grows to the exact one with the edges."""
    return hull_volume(edge_wrenches(space, edges))[0]


def hull_volume(wrenches: Array) -> tuple[float, Array]:
    """Return the volume of the hull of wrenches and the origin, with its gradient by the wrenches.

    A facet moves outwards by the mean of what its six corners do, so each corner has a sixth of its area.

    Args:
        wrenches: Of shape (n, 6).

    Returns:
        The volume, 0 where the hull is flat, and the gradient, of shape (n, 6).
    """
    points = np.vstack([wrenches, np.zeros((1, 6))])
    gradient = np.zeros_like(points)
    try:
        hull = ConvexHull(points)
    except QhullError:
        return 0.0, gradient[:-1]
    sides = points[hull.simplices[:, 1:]] - points[hull.simplices[:, :1]]
    areas = np.sqrt(np.maximum(np.linalg.det(sides @ sides.transpose(0, 2, 1)), 0.0)) / math.factorial(5)
    shares = (areas[:, None] * hull.equations[:, :6] / 6.0)[:, None]
    np.add.at(gradient, hull.simplices, np.broadcast_to(shares, (len(areas), 6, 6)))
    return float(hull.volume), gradient[:-1]


def edge_wrenches(space: WrenchSpace, edges: int) -> Array:
    """Return the wrenches of the edges of each cone at unit normal force, of shape (n, 6).

    Args:
        space: The space.
        edges: Edges of a cone of forces; a soft finger's has so many at each of several shares of torque.

    Returns:
        The wrenches, contact by contact.
    """
    n_c, d = space.covectors.shape
    ring = _ring(d - 1, edges)
    # The rows of SVD's right factor but for the first are a basis of what is across a covector.
    across = np.linalg.svd(space.covectors[:, None, :])[2][:, 1:]
    forces = space.covectors[:, None] + space.friction[:, None, None] * (ring @ across)
    blocks = space.grasp.reshape(6, n_c, d)
    return np.asarray(np.einsum("aij,iej->iea", blocks, forces).reshape(-1, 6))


def _ring(dimension: int, edges: int) -> Array:
    """Return directions all around in one dimension less than a cone has, of shape (k, dimension)."""
    if dimension == 0:
        return np.zeros((1, 0))
    angles = 2.0 * np.pi * np.arange(edges) / edges
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    if dimension == 2:
        return circle
    heights = np.pi * np.arange(1, max(edges // 2, 2)) / max(edges // 2, 2)
    rings = [np.column_stack([np.sin(h) * circle, np.full(edges, np.cos(h))]) for h in heights]
    return np.vstack([*rings, [[0.0, 0.0, 1.0]], [[0.0, 0.0, -1.0]]])


def min_weight(wrenches: Array) -> tuple[float, Array]:
    """Return l* of [Li2023], n l* being in [0, 1], with its gradient by the wrenches.

    max l with Σ α_j w_j = 0, Σ α_j = 1, α_j ≥ l: positive only with force closure, and below ε times a constant.

    Args:
        wrenches: Edge wrenches w_j, of shape (n, 6).

    Returns:
        l*, −1 where the origin is not in their hull, and ∂l*/∂w, of shape (n, 6).
    """
    n = len(wrenches)
    cost = np.append(np.zeros(n), -1.0)
    equality = np.vstack([np.hstack([wrenches.T, np.zeros((6, 1))]), np.append(np.ones(n), 0.0)])
    above = np.hstack([-np.eye(n), np.ones((n, 1))])
    found = linprog(
        cost,
        A_ub=above,
        b_ub=np.zeros(n),
        A_eq=equality,
        b_eq=np.eye(7)[6],
        bounds=[(None, None)] * n + [(-1.0, None)],
        method="highs",
    )
    if not found.success:
        return -1.0, np.zeros((n, 6))
    return float(found.x[-1]), np.outer(found.x[:n], found.eqlin.marginals[:6])
