"""A nonlinear program and its solution by sequential quadratic programming (SciPy's SLSQP). No robotics here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from ..spatial import Array
from .lagrangian import NlpPoint

ValueAndGradient = Callable[[Array], tuple[float, Array]]
ResidualAndJacobian = Callable[[Array], tuple[Array, Array]]


@dataclass(frozen=True)
class NonlinearProgram:
    """min f(z) subject to h(z) = 0, g(z) ≥ 0, lower ≤ z ≤ upper; everything scaled to order one.

    Attributes:
        objective: f and its gradient.
        equality: h and its Jacobian.
        inequality: g and its Jacobian.
        lower: Lower bounds, −∞ where there is none, of shape (n,).
        upper: Upper bounds, of shape (n,).
    """

    objective: ValueAndGradient
    equality: ResidualAndJacobian
    inequality: ResidualAndJacobian
    lower: Array
    upper: Array

    def point(self, z: Array) -> NlpPoint:
        """Return the program at a point, bounds apart."""
        (value, gradient), (zero, d_zero), (spare, d_spare) = self.objective(z), self.equality(z), self.inequality(z)
        return NlpPoint(value, gradient, np.append(zero, spare), np.vstack([d_zero, d_spare]), len(zero))


@dataclass(frozen=True)
class NlpSolution:
    """What the solver returned.

    Attributes:
        z: The last point, of shape (n,).
        converged: Whether the solver says it met its tolerance.
        message: Its own words.
        iterations: Major iterations.
        evaluations: Function evaluations.
    """

    z: Array
    converged: bool
    message: str
    iterations: int
    evaluations: int


def solve_nlp(
    program: NonlinearProgram,
    z0: Array,
    *,
    max_iterations: int = 200,
    tolerance: float = 1e-8,
    callback: Callable[[Array], None] | None = None,
) -> NlpSolution:
    """Solve a nonlinear program from one point.

    Args:
        program: The program.
        z0: Start, clipped to the bounds, of shape (n,).
        max_iterations: Most major iterations.
        tolerance: Accuracy of objective and constraints at which the solver stops.
        callback: Called with z after every major iteration; may raise to stop.

    Returns:
        The last point and what the solver says of it.
    """
    constraints = [
        {"type": kind, "fun": lambda z, f=function: f(z)[0], "jac": lambda z, f=function: f(z)[1]}
        for kind, function in (("eq", program.equality), ("ineq", program.inequality))
    ]
    result = minimize(
        program.objective,
        np.clip(z0, program.lower, program.upper),
        jac=True,
        method="SLSQP",
        bounds=np.column_stack([program.lower, program.upper]),
        constraints=constraints,
        callback=callback,
        options={"maxiter": max_iterations, "ftol": tolerance},
    )
    return NlpSolution(
        z=np.array(result.x, dtype=float),
        converged=bool(result.success),
        message=str(result.message),
        iterations=int(result.nit),
        evaluations=int(result.nfev),
    )
