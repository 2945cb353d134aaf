"""Contacts of different kinds in one grasp, as a selection of what a rigid contact transmits: G = G̃ Hᵀ, J = H J̃.

A rigid contact transmits force and moment, six numbers. Which of them a contact has is the selection H;
[Prattichizzo2016] section 38.2.1. The rows come as SynGrasp has them: first the forces of all contacts, then the
moments that there are, [N] and [N m] as they are; :mod:`grasp_planner.model.contact_model` is for one kind of
contact, its intensities all in newtons, and :mod:`grasp_planner.model.mixed_contacts` for several.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from ..exceptions import InvalidValueError, NameNotFoundError
from ..spatial import Array
from .contacts import grasp_matrix

ContactKind = Literal["hard", "soft", "complete", "frictionless"]
"""Any force; also a moment about the normal; also any moment; the normal force alone."""


def complete_grasp_matrix(points: Array) -> Array:
    """Return G̃, forces of all contacts, then their moments, to the wrench on the object.

    Args:
        points: Contact points from the reference point of the wrench [m], of shape (n_c, 3).

    Returns:
        G̃, of shape (6, 6 n_c).
    """
    moments = np.vstack([np.zeros((3, 3 * len(points))), np.tile(np.eye(3), (1, len(points)))])
    return np.hstack([grasp_matrix(points), moments])


def complete_jacobian(twists: Array) -> Array:
    """Return J̃, joint velocities to the velocities of all contact points, then the angular ones of their links.

    Args:
        twists: Both by the joint velocities, of shape (n_c, 6, n_q), as ``HandConfiguration.contact_twists`` has them.

    Returns:
        J̃, of shape (6 n_c, n_q).
    """
    n_q = twists.shape[2]
    return np.vstack([twists[:, :3].reshape(-1, n_q), twists[:, 3:].reshape(-1, n_q)])


def contact_selection(normals: Array, kinds: Sequence[ContactKind]) -> Array:
    """Return H, which selects what each contact transmits.

    Args:
        normals: Unit normals into the object, of shape (n_c, 3).
        kinds: The kind of each contact.

    Returns:
        H, of shape (n, 6 n_c).

    Raises:
        NameNotFoundError: If there is no such kind.
        InvalidValueError: If there is not one kind for each contact.
    """
    if len(kinds) != len(normals):
        raise InvalidValueError("kinds", len(kinds), f"one for each of the {len(normals)} contacts")
    n_c, rows = len(normals), []
    for i, (kind, normal) in enumerate(zip(kinds, normals, strict=True)):
        if kind not in get_args(ContactKind):
            raise NameNotFoundError("contact kind", str(kind), get_args(ContactKind))
        rows.append(_placed(normal[None] if kind == "frictionless" else np.eye(3), i, 2 * n_c))
    for i, (kind, normal) in enumerate(zip(kinds, normals, strict=True)):
        moments = {"soft": normal[None], "complete": np.eye(3)}.get(kind, np.zeros((0, 3)))
        rows.append(_placed(moments, n_c + i, 2 * n_c))
    return np.vstack(rows)


def tangent_frames(normals: Array) -> Array:
    """Return a frame for each contact, columns t₁, t₂, n: t₁ is the axis along which n is least, made tangential.

    With R their block diagonal, G R and Rᵀ J are those of forces in the contacts' own frames.

    Args:
        normals: Unit normals into the object, of shape (n_c, 3).

    Returns:
        Rotations, of shape (n_c, 3, 3).
    """
    axes = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = axes - (axes * normals).sum(axis=1, keepdims=True) * normals
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normals, first), normals], axis=2)


def _placed(rows: Array, block: int, blocks: int) -> Array:
    """Return rows of three columns in the columns of a block, the others zero."""
    wide = np.zeros((len(rows), 3 * blocks))
    wide[:, 3 * block : 3 * block + 3] = rows
    return wide
