"""A feasible point by nonlinear least squares on the violations alone: what brings a start into the solver's reach."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from ..spatial import Array

ResidualAndJacobian = Callable[[Array], tuple[Array, Array]]


def restore_feasibility(
    equality: ResidualAndJacobian,
    inequality: ResidualAndJacobian,
    z0: Array,
    lower: Array,
    upper: Array,
    *,
    max_evaluations: int = 60,
    tolerance: float = 1e-6,
    regularisation: float = 1e-3,
) -> Array:
    """Minimise the sum of squared violations of h(z) = 0 and g(z) ≥ 0 within bounds.

    Args:
        equality: h and its Jacobian.
        inequality: g and its Jacobian, both with the weights and margins wanted.
        z0: Start, of shape (n,).
        lower: Lower bounds, of shape (n,).
        upper: Upper bounds, of shape (n,).
        max_evaluations: Most evaluations.
        tolerance: Relative change of the sum at which the search ends.
        regularisation: Weight of the distance from the start: what no violation depends on stays where it is.

    Returns:
        The point, of shape (n,).
    """
    z0 = np.clip(z0, lower, upper)
    inside = np.where(np.isfinite(upper - lower), 1e-9 * (upper - lower), 0.0)
    start = np.clip(z0, lower + inside, upper - inside)

    def residuals(z: Array) -> Array:
        return np.concatenate([equality(z)[0], np.minimum(inequality(z)[0], 0.0), regularisation * (z - z0)])

    def jacobian(z: Array) -> Array:
        value, slope = inequality(z)
        return np.vstack([equality(z)[1], slope * (value < 0.0)[:, None], regularisation * np.eye(z.size)])

    found = least_squares(
        residuals,
        start,
        jac=jacobian,
        bounds=(lower, upper),
        method="trf",
        max_nfev=max_evaluations,
        ftol=tolerance,
        xtol=1e-12,
        gtol=1e-14,
    )
    return np.array(found.x, dtype=float)
