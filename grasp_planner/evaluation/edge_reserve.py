"""How far contacts are from edges: what the smooth normals around them differ, with derivatives."""

from __future__ import annotations

import numpy as np

from ..objects import GraspObject
from ..problem.problem import GraspProblem
from ..spatial import Array

REACH = 2e-3
"""How far around a contact the search compares normals [m]: the footprint and the width over which the smooth distance
rounds an edge."""
SHARP = 3e-3
"""Radius of edges from which a finger can rest on them [m]: a footprint of 1 mm then holds normals within 40°."""
LIMIT = float(np.radians(35.0))
"""Widest angle that the search allows there; on an edge of 90° the smooth normal is 45° from both sides [rad]."""
_SIDES = np.vstack([np.eye(3), -np.eye(3)])


def edges_count(problem: GraspProblem) -> bool:
    """Return whether contacts have to keep from edges: the object has sharp ones, and real geometry counts."""
    return problem.grasp_object.edge_radius < SHARP and problem.clearance.link_object == "geometry"


def edge_reserve(grasp_object: GraspObject, points: Array, normals: Array) -> Array:
    """Return the angles left between the normal at contacts and those at six points in their tangent planes.

    Args:
        grasp_object: The object.
        points: Contact points in O [m], of shape (..., 3).
        normals: Unit normals there into the object, of shape (..., 3).

    Returns:
        (cos of the angle − cos LIMIT) / sin LIMIT, the angle left [rad] to first order at the limit, of shape (..., 6).
    """
    slope = grasp_object.gradients(_around(points, normals))
    cosine = -(normals[..., None, :] * slope).sum(axis=-1) / np.linalg.norm(slope, axis=-1)
    return np.asarray((cosine - np.cos(LIMIT)) / np.sin(LIMIT))


def edge_reserve_slope(
    grasp_object: GraspObject, points: Array, normals: Array, d_points: Array, d_normals: Array
) -> Array:
    """Return the derivatives of :func:`edge_reserve`.

    Args:
        grasp_object: The object.
        points: Contact points in O [m], of shape (..., 3).
        normals: Unit normals there into the object, of shape (..., 3).
        d_points: Derivatives of the points by n_g variables, of shape (..., n_g, 3).
        d_normals: Derivatives of the normals, of shape (..., n_g, 3).

    Returns:
        Derivatives, of shape (..., 6, n_g).
    """
    found = grasp_object.field(_around(points, normals))
    # u = a (e − n nᵀe): its derivative, and that of the point c + u.
    along = normals @ _SIDES.T
    d_along = _SIDES @ np.swapaxes(d_normals, -1, -2)
    d_offset = along[..., None, None] * d_normals[..., None, :, :]
    d_offset += normals[..., None, None, :] * d_along[..., None]
    d_around = d_points[..., None, :, :] - REACH * d_offset
    length = np.linalg.norm(found.gradient, axis=-1, keepdims=True)
    outward = found.gradient / length
    cosine = -(normals[..., None, :] * outward).sum(axis=-1, keepdims=True)
    covector = -(normals[..., None, :] + cosine * outward) / length
    turn = (covector[..., None, :] @ found.hessian)[..., 0, :]
    slope = (d_around @ turn[..., None])[..., 0] - outward @ np.swapaxes(d_normals, -1, -2)
    return np.asarray(slope / np.sin(LIMIT))


def _around(points: Array, normals: Array) -> Array:
    """Return the points in the tangent planes, of shape (..., 6, 3)."""
    tangent = _SIDES - (normals @ _SIDES.T)[..., None] * normals[..., None, :]
    return points[..., None, :] + REACH * tangent
