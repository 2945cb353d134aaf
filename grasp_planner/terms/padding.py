"""Derivatives by some of the variables as derivatives by all."""

from __future__ import annotations

import numpy as np

from ..spatial import Array


def padded(derivative: Array, size: int) -> Array:
    """Append zero columns for variables that move nothing.

    Args:
        derivative: Derivatives by the first variables, of shape (m, n).
        size: Number of all variables.

    Returns:
        Derivatives by all, of shape (m, size).
    """
    whole = np.zeros((len(derivative), size))
    whole[:, : derivative.shape[1]] = derivative
    return whole
