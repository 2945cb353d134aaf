"""How far contacts are from edges: what the smooth normals around them differ, with derivatives."""

from __future__ import annotations

import numpy as np

from ..objects import GraspObject, SurfaceSample
from ..problem.problem import GraspProblem
from ..spatial import Array, namespace

REACH = 1e-3
"""How far around a contact normals count [m]; the search adds the width over which its distance rounds edges."""
SHARP = 3e-3
"""Radius of edges from which a finger can rest on them [m]: a footprint of 1 mm then holds normals within 40°."""
LIMIT = float(np.radians(35.0))
"""Widest angle between two normals that the search allows; what it sees of an edge is a few degrees less [rad]."""


def edges_count(problem: GraspProblem) -> bool:
    """Return whether contacts have to keep from edges: the object has sharp ones, and real geometry counts."""
    return problem.grasp_object.edge_radius < SHARP and problem.clearance.link_object == "geometry"


def edge_reserve(grasp_object: GraspObject, points: Array, normals: Array) -> Array:
    """Return the angles left between the normals on both sides of contacts, along three directions of their planes.

    Both sides are compared with each other: the normal in the middle of an edge is half its angle from both.

    Args:
        grasp_object: The object.
        points: Contact points in O [m], of shape (..., 3).
        normals: Unit normals there into the object, of shape (..., 3).

    Returns:
        (cos of the angle − cos LIMIT) / sin LIMIT, the angle left [rad] to first order at the limit, of shape (..., 3).
    """
    return _left(_outward(_around(grasp_object, points, normals).gradient)[0])


def edge_reserve_and_slope(
    grasp_object: GraspObject, points: Array, normals: Array, d_points: Array, d_normals: Array
) -> tuple[Array, Array]:
    """Return :func:`edge_reserve` and its derivatives.

    Args:
        grasp_object: The object.
        points: Contact points in O [m], of shape (..., 3).
        normals: Unit normals there into the object, of shape (..., 3).
        d_points: Derivatives of the points by n_g variables, of shape (..., n_g, 3).
        d_normals: Derivatives of the normals, of shape (..., n_g, 3).

    Returns:
        The angles left, of shape (..., 3), and their derivatives, of shape (..., 3, n_g).
    """
    xp, found = namespace(points), _around(grasp_object, points, normals)
    # u = r (e − n nᵀe) for the three axes e; the points on both sides are c ± u.
    d_offsets = normals[..., :, None, None] * d_normals[..., None, :, :]
    d_offsets += d_normals.swapaxes(-1, -2)[..., None] * normals[..., None, None, :]
    d_offsets *= -_reach(grasp_object)
    d_around = d_points[..., None, None, :, :] + xp.stack([d_offsets, -d_offsets], axis=-4)
    outward, length = _outward(found.gradient)
    others = outward[..., ::-1, :, :]
    cosine = (outward * others).sum(axis=-1, keepdims=True)
    turn = (found.hessian @ ((others - cosine * outward) / length)[..., None])[..., 0]
    slope = (d_around @ turn[..., None])[..., 0].sum(axis=-3)
    return _left(outward), slope / np.sin(LIMIT)


def _around(grasp_object: GraspObject, points: Array, normals: Array) -> SurfaceSample:
    """Return the object's field on both sides of contacts, of shapes (..., 2, 3) and more."""
    offsets = _reach(grasp_object) * (np.eye(3) - normals[..., :, None] * normals[..., None, :])
    return grasp_object.field(points[..., None, None, :] + namespace(points).stack([offsets, -offsets], axis=-3))


def _outward(gradient: Array) -> tuple[Array, Array]:
    """Return unit normals and the lengths they were divided by."""
    length = namespace(gradient).linalg.norm(gradient, axis=-1, keepdims=True)
    return gradient / length, length


def _left(outward: Array) -> Array:
    """Return the angles left between normals on both sides, of shape (..., 2, 3, 3)."""
    cosine = (outward[..., 0, :, :] * outward[..., 1, :, :]).sum(axis=-1)
    return (cosine - np.cos(LIMIT)) / np.sin(LIMIT)


def _reach(grasp_object: GraspObject) -> float:
    """Return how far around a contact normals are compared [m]."""
    return REACH + grasp_object.blur
