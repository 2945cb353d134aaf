"""Contact and friction as equations: projections of the forces, with generalised derivatives."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..spatial import Array

Flags = npt.NDArray[np.bool_]
PENALTY = 300.0
"""ρ of the projections [N/m]: a fifth of the stiffness of a fingertip; any positive number has the same solutions."""


def contact_rows(
    forces: Array, gaps: Array, slips: Array, friction: Array, allowed: Flags
) -> tuple[Array, Array, Array]:
    """Return the residuals of contact and friction laws and their generalised derivatives.

    Args:
        forces: Forces along normal and tangents [N], of shape (n_c, 3).
        gaps: Gaps [m], of shape (n_c,).
        slips: Slip of fingertips over the object along the tangents [m], of shape (n_c, 2).
        friction: μ of every contact, of shape (n_c,).
        allowed: Contacts that may touch, of shape (n_c,).

    Returns:
        Derivatives by the forces and by motions of the contact points along normal and tangents, of shape (n_c, 3, 3),
        and the residuals [N], of shape (n_c, 3).
    """
    n_c = len(gaps)
    by_force, by_motion, residual = np.tile(np.eye(3), (n_c, 1, 1)), np.zeros((n_c, 3, 3)), np.array(forces)
    for i in np.flatnonzero(allowed):
        pressed = forces[i, 0] - PENALTY * gaps[i]
        if pressed <= 0.0:
            continue
        residual[i, 0] = PENALTY * gaps[i]
        by_force[i, 0, 0], by_motion[i, 0, 0] = 0.0, -PENALTY  # moving along n, into the object, closes the gap
        trial = forces[i, 1:] + PENALTY * slips[i]
        size, bound = float(np.linalg.norm(trial)), friction[i] * pressed
        if size <= bound:
            residual[i, 1:] = -PENALTY * slips[i]
            by_force[i, 1:, 1:], by_motion[i, 1:, 1:] = 0.0, -PENALTY * np.eye(2)
            continue
        along = trial / size
        across = bound / size * (np.eye(2) - np.outer(along, along))
        residual[i, 1:] = forces[i, 1:] - bound * along
        by_force[i, 1:, 0], by_motion[i, 1:, 0] = -friction[i] * along, -friction[i] * PENALTY * along
        by_force[i, 1:, 1:] = np.eye(2) - across
        by_motion[i, 1:, 1:] = -PENALTY * across
    return by_force, by_motion, residual


def contact_axes(normals: Array) -> Array:
    """Return orthonormal frames with the normals as first rows, of shape (n_c, 3, 3)."""
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([normals, first, np.cross(normals, first)], axis=1)


def block_diagonal(blocks: Array) -> Array:
    """Return blocks of shape (n, 3, 3) as one matrix of shape (3 n, 3 n)."""
    n = len(blocks)
    matrix = np.zeros((n, 3, n, 3))
    matrix[np.arange(n), :, np.arange(n), :] = blocks
    return matrix.reshape(3 * n, 3 * n)
