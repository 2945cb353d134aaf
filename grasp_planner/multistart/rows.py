"""Rows of residuals with their derivatives, for a batch of states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..spatial import Array, namespace


@dataclass(frozen=True)
class Rows:
    """The residuals of one requirement.

    Attributes:
        name: Name of the requirement.
        value: Residuals in its unit: zero (an equality) or not negative where it is met, of shape (B, m).
        derivative: Their derivatives by x, of shape (B, m, n_x).
        equality: Whether it is an equality.
    """

    name: str
    value: Array
    derivative: Array
    equality: bool = False


def side_by_side(parts: Sequence[Array], width: int) -> Array:
    """Return derivatives side by side with columns of zeros behind them.

    Args:
        parts: Derivatives by the first variables of x, by those that follow and so on, of shapes (B, m, …).
        width: n_x, the number of all columns.

    Returns:
        The derivatives by x, of shape (B, m, n_x).
    """
    xp = namespace(parts[0])
    left = width - sum(part.shape[2] for part in parts)
    return xp.concatenate([*parts, xp.zeros((*parts[0].shape[:2], left))], axis=2)


def own_columns(vectors: Array) -> Array:
    """Return vectors of every contact in the columns of its own force.

    Args:
        vectors: Vectors, of shape (B, n_c, …, 3).

    Returns:
        Matrices with zeros in the columns of other contacts, of shape (B, n_c, …, 3 n_c).
    """
    shape, n_c = vectors.shape, vectors.shape[1]
    own = np.eye(n_c).reshape(n_c, *(1 for _ in shape[2:-1]), n_c, 1)
    return (vectors[..., None, :] * own).reshape(*shape[:-1], 3 * n_c)
