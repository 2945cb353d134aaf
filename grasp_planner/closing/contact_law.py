"""Contact and friction as equations: projections of the forces, with generalised derivatives."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..spatial import Array, cross_rows

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
    pressed = forces[:, 0] - PENALTY * gaps
    touching = np.flatnonzero(allowed & (pressed > 0.0))
    residual[touching, 0] = PENALTY * gaps[touching]
    # Moving along n, into the object, closes the gap.
    by_force[touching, 0, 0], by_motion[touching, 0, 0] = 0.0, -PENALTY
    trial = forces[touching, 1:] + PENALTY * slips[touching]
    size, bound = np.sqrt((trial * trial).sum(axis=1)), friction[touching] * pressed[touching]
    slipping = size > bound
    stuck = touching[~slipping]
    residual[stuck, 1:] = -PENALTY * slips[stuck]
    by_force[stuck, 1:, 1:], by_motion[stuck, 1:, 1:] = 0.0, -PENALTY * np.eye(2)
    slides = touching[slipping]
    if slides.size:
        along, share = trial[slipping] / size[slipping, None], bound[slipping] / size[slipping]
        across = share[:, None, None] * (np.eye(2) - along[:, :, None] * along[:, None])
        residual[slides, 1:] = forces[slides, 1:] - bound[slipping, None] * along
        rubbed = -friction[slides, None] * along
        by_force[slides, 1:, 0], by_motion[slides, 1:, 0] = rubbed, PENALTY * rubbed
        by_force[slides, 1:, 1:], by_motion[slides, 1:, 1:] = np.eye(2) - across, -PENALTY * across
    return by_force, by_motion, residual


def contact_axes(normals: Array) -> Array:
    """Return orthonormal frames with the normals as first rows, of shape (n_c, 3, 3)."""
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = cross_rows(normals, helper)
    first /= np.sqrt((first * first).sum(axis=1, keepdims=True))
    return np.stack([normals, first, cross_rows(normals, first)], axis=1)


def block_diagonal(blocks: Array) -> Array:
    """Return blocks of shape (…, n, 3, 3) as one matrix of shape (…, 3 n, 3 n)."""
    n, each = blocks.shape[-3], np.arange(blocks.shape[-3])
    matrix = np.zeros((*blocks.shape[:-3], n, 3, n, 3))
    matrix[..., each, :, each, :] = np.moveaxis(blocks, -3, 0)
    return matrix.reshape(*blocks.shape[:-3], 3 * n, 3 * n)
