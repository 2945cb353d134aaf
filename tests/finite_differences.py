"""Central differences, the yardstick of every analytic derivative."""

from __future__ import annotations

import numpy as np


def central_differences(function, x, steps):
    """Return the Jacobian of a vector function by central differences.

    Two step sizes are combined (Richardson), so that truncation falls to fourth order.
    """
    columns = []
    for k, step in enumerate(np.broadcast_to(steps, np.shape(x))):

        def slope(h, k=k):
            shift = np.zeros(len(x))
            shift[k] = h
            return (np.asarray(function(x + shift)) - np.asarray(function(x - shift))) / (2.0 * h)

        columns.append((4.0 * slope(step / 2.0) - slope(step)) / 3.0)
    return np.stack(columns, axis=-1)


def relative_error(analytic, numeric):
    """Return the largest difference over the largest entry, row by row."""
    rows = np.atleast_2d(analytic).reshape(-1, np.shape(analytic)[-1])
    other = np.atleast_2d(numeric).reshape(rows.shape)
    size = np.maximum(np.abs(other).max(axis=1), 1e-8 * max(np.abs(other).max(), 1e-12))
    return float((np.abs(rows - other).max(axis=1) / size).max())
