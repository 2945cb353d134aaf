"""The Lagrangian of a nonlinear program: its gradient, and its Hessian by differences or by what steps show of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..spatial import Array

Indices = npt.NDArray[np.intp]

HESSIAN_STEP = 1e-5
"""Step of the central differences of gradients, in scaled variables of order one."""


@dataclass(frozen=True)
class NlpPoint:
    """A program at one point; n variables, m constraints, equalities first.

    Attributes:
        objective: f.
        gradient: ∇f, of shape (n,).
        residuals: c, of shape (m,).
        jacobian: ∇c, of shape (m, n).
        n_equalities: How many of the constraints are equalities.
    """

    objective: float
    gradient: Array
    residuals: Array
    jacobian: Array
    n_equalities: int

    @property
    def steepness(self) -> float:
        """What gradients are measured against: ∇f's largest component, or 1 where f, of order one, is flat."""
        return max(1.0, float(np.abs(self.gradient).max(initial=0.0)))

    @property
    def violation(self) -> Array:
        """How far each constraint is from being met, of shape (m,)."""
        equal = np.arange(len(self.residuals)) < self.n_equalities
        return np.where(equal, np.abs(self.residuals), np.maximum(0.0, -self.residuals))


Evaluate = Callable[[Array], NlpPoint]


def lagrangian_gradient(point: NlpPoint, active: Indices, multipliers: Array) -> Array:
    """Return ∇f − Σ λ_k ∇c_k, of shape (n,)."""
    return point.gradient - point.jacobian[active].T @ multipliers


def lagrangian_hessian(
    evaluate: Evaluate, z: Array, multipliers: Array, at: NlpPoint | None = None, along: Array | None = None
) -> Array:
    """Return the Hessian of f − λ·c by central differences of its gradient.

    Args:
        evaluate: The program.
        z: The point, of shape (n,).
        multipliers: λ of all constraints, of shape (m,).
        at: The program there; if it is given the differences are forward ones, of half the cost.
        along: Directions in which it is wanted, as columns of shape (n, k); the variables' own if left out.

    Returns:
        The Hessian in these directions, of shape (k, k).
    """
    used = np.flatnonzero(multipliers)
    here = None if at is None else lagrangian_gradient(at, used, multipliers[used])
    directions = np.eye(len(z)) if along is None else along
    columns = []
    for step in HESSIAN_STEP * directions.T:
        up = lagrangian_gradient(evaluate(z + step), used, multipliers[used])
        if here is None:
            down = lagrangian_gradient(evaluate(z - step), used, multipliers[used])
            columns.append((up - down) / (2.0 * HESSIAN_STEP))
        else:
            columns.append((up - here) / HESSIAN_STEP)
    hessian = np.array(columns).reshape(-1, len(z)) @ directions
    return 0.5 * (hessian + hessian.T)


def secant_hessian(hessian: Array, step: Array, turned: Array) -> Array:
    """Return a Hessian that turns a gradient as was seen along a step, changed by a matrix of rank one.

    Symmetric rank one, [Nocedal2006] section 6.2.

    Args:
        hessian: The Hessian before, of shape (n, n).
        step: The step, of shape (n,).
        turned: How the gradient changed along it, of shape (n,).
    """
    missing = turned - hessian @ step
    share = float(missing @ step)
    if abs(share) <= 1e-8 * float(np.linalg.norm(missing) * np.linalg.norm(step)):
        return hessian
    return np.asarray(hessian + np.outer(missing, missing) / share)
