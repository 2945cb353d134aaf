"""Optimality of a nonlinear program at a point: a refined KKT point, its multipliers, its sensitivity. No robotics.

min f(z) subject to c_E(z) = 0, c_I(z) ≥ 0; first derivatives are given, second ones are central differences of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import clarabel
import numpy as np
from scipy.optimize import lsq_linear

from ..spatial import Array
from .lagrangian import Evaluate, Indices, NlpPoint, lagrangian_gradient, lagrangian_hessian, secant_hessian
from .nlp import NonlinearProgram
from .quadratic import solve_quadratic

ACTIVE = 1e-6
"""Residual below which an inequality may be active."""
SETTLED_STEP, ROUNDING_STEP, SHRINKS = 1e-10, 1e-7, 0.3
"""Steps, in scaled variables, that end it: below the first; below the second where they no longer shrink so much."""
SAME_HESSIAN, OLD_HESSIAN = 0.1, 6
"""Steps shorter than the first bring the Hessian up to date by what they show of it, so many times in a row."""
KKT_ITERATIONS = 80
"""Most steps to a KKT point."""
ROUGH = 1e-3
"""Stationarity above which a point is no optimum."""
POSITIVE = 1e-9
"""Multipliers below this, relative to the gradient of the objective, count as zero."""
FLAT = 1e-10
"""Curvatures below this, relative to the largest, count as none: the optimum is not unique along them."""


@dataclass(frozen=True)
class KktPoint:
    """A point with its multipliers: ∇f = Σ λ_k ∇c_k over the active constraints.

    Attributes:
        z: The point, of shape (n,).
        point: The program there.
        active: Indices of equalities and of inequalities with positive multipliers, of shape (a,).
        multipliers: λ of these, of shape (a,).
        hessian: Hessian of the Lagrangian, of shape (n, n).
        stationarity: |∇f − Σ λ ∇c| / |∇f|.
        iterations: Steps that led there.
    """

    z: Array
    point: NlpPoint
    active: Indices
    multipliers: Array
    hessian: Array
    stationarity: float
    iterations: int


def kkt_point(evaluate: Evaluate, z: Array, *, iterations: int = KKT_ITERATIONS, tolerance: float = 1e-10) -> KktPoint:
    """Return the KKT point near a solution: Newton steps by convex quadratic programs within a trust region.

    Args:
        evaluate: The program.
        z: A point near a solution, of shape (n,).
        iterations: Most steps.
        tolerance: Gradient of the Lagrangian and violation, relative to ∇f, at which it ends.

    Returns:
        The point; look at its ``stationarity`` and violation.
    """
    z, reach, weight = np.array(z), 0.1, 1.0
    point = evaluate(z)
    everywhere: Array = np.zeros(len(point.residuals))
    active, values = _least_squares_multipliers(point, 1e-3)
    everywhere[active] = values
    hessian, age, last, steps = None, 0, math.inf, 0
    for _ in range(iterations):
        steps += 1
        if hessian is None:
            hessian, age = lagrangian_hessian(evaluate, z, everywhere, at=point), 0
        rows = point.jacobian[_working(point, everywhere)]
        found = _quadratic_step(_convex(hessian, rows), point, reach)
        if found is None:
            reach *= 4.0
            if reach > 10.0:
                break
            continue
        step, multipliers = found
        weight = max(weight, 2.0 * float(np.abs(multipliers).max(initial=0.0)))
        step, moved = _accepted(evaluate, z, point, step, multipliers, weight)
        size = float(np.abs(step).max())
        if moved is not None:
            before, z, point, everywhere = point, z + step, moved, multipliers
            reach = 2.0 * reach if size > 0.9 * reach else reach
            used = np.flatnonzero(multipliers)
            gradient = lagrangian_gradient(point, used, multipliers[used])
            slope = np.abs(gradient).max()
            left = max(slope, point.violation.max(initial=0.0)) / np.abs(point.gradient).max()
            if left < tolerance or size < SETTLED_STEP or SHRINKS * last < size < ROUNDING_STEP:
                break
            turned = gradient - lagrangian_gradient(before, used, multipliers[used])
            age, hessian, last = age + 1, secant_hessian(hessian, step, turned), size
            if age >= OLD_HESSIAN or size > SAME_HESSIAN:
                hessian = None
        else:
            hessian = None if age else hessian
            reach = 0.25 * min(reach, size)
            if reach < 1e-12:
                break
    active, values = _least_squares_multipliers(point, ACTIVE)
    everywhere = np.zeros(len(point.residuals))
    everywhere[active] = values
    size = max(float(np.linalg.norm(point.gradient)), 1e-300)
    left = point.gradient - point.jacobian[active].T @ values
    stationarity = float(np.linalg.norm(left)) / size
    # What follows from the Hessian is wanted to many digits only where this is an optimum.
    hessian = lagrangian_hessian(evaluate, z, everywhere, at=point if stationarity > ROUGH else None)
    return KktPoint(z, point, active, values, hessian, stationarity, steps)


def kkt_residual(program: NonlinearProgram, z: Array) -> float:
    """Return what the best multipliers leave of the objective's gradient at a point, against its size or 1.

    Args:
        program: The program.
        z: The point, of shape (n,).
    """
    point, box = program.point(z), np.eye(len(z))
    bounds = np.vstack([box[z - program.lower < ACTIVE], -box[program.upper - z < ACTIVE]])
    residuals = np.append(point.residuals, np.zeros(len(bounds)))
    whole = replace(point, residuals=residuals, jacobian=np.vstack([point.jacobian, bounds]))
    active, multipliers = _least_squares_multipliers(whole, ACTIVE)
    return float(np.abs(lagrangian_gradient(whole, active, multipliers)).max()) / point.steepness


@dataclass(frozen=True)
class KktChange:
    """First-order change of a KKT point by a parameter.

    Attributes:
        z: dz/dp, of shape (n,).
        multipliers: dλ/dp of the active constraints, of shape (a,).
        mismatch: How far active constraints cannot stay met to first order, relative; 0 where they can.
        flat: Number of directions along which the optimum is not unique; dz is least there.
        curvature: Smallest curvature of the Lagrangian along the active constraints but for the flat ones, relative
            to the largest; negative where the point is no minimum.
    """

    z: Array
    multipliers: Array
    mismatch: float
    flat: int
    curvature: float


def kkt_change(found: KktPoint, d_gradient: Array, d_residuals: Array, free: Indices | None = None) -> KktChange:
    """Return dz/dp and dλ/dp from the KKT system of the active constraints.

    Args:
        found: The KKT point.
        d_gradient: ∂/∂p of the Lagrangian's gradient at fixed (z, λ), of shape (n,).
        d_residuals: ∂c/∂p at fixed z, of shape (m,).
        free: Indices of the variables that may change; all if left out. The others stay.

    Returns:
        The change.
    """
    n = len(found.z)
    chosen = np.arange(n) if free is None else free
    rows = found.point.jacobian[np.ix_(found.active, chosen)]
    hessian = found.hessian[np.ix_(chosen, chosen)]
    right = -d_residuals[found.active]
    left_vectors, values, vectors = np.linalg.svd(rows)
    rank = int(np.count_nonzero(values > 1e-8 * max(float(values[0]), 1e-300))) if values.size else 0
    particular = vectors[:rank].T @ ((left_vectors[:, :rank].T @ right) / values[:rank])
    mismatch = float(np.linalg.norm(rows @ particular - right)) / max(float(np.linalg.norm(right)), 1e-300)
    null = vectors[rank:].T
    curvatures, axes = np.linalg.eigh(null.T @ hessian @ null)
    largest = max(float(np.abs(curvatures).max(initial=0.0)), 1e-300)
    stiff = np.abs(curvatures) > FLAT * largest
    slope = -(null.T @ (d_gradient[chosen] + hessian @ particular))
    along = axes[:, stiff] @ ((axes[:, stiff].T @ slope) / curvatures[stiff])
    change = np.zeros(n)
    change[chosen] = particular + null @ along
    multipliers = np.linalg.lstsq(rows.T, d_gradient[chosen] + hessian @ change[chosen], rcond=1e-10)[0]
    least = float(curvatures[stiff].min(initial=largest)) / largest
    return KktChange(change, multipliers, mismatch, int((~stiff).sum()), least)


def _accepted(
    evaluate: Evaluate, z: Array, point: NlpPoint, step: Array, multipliers: Array, weight: float
) -> tuple[Array, NlpPoint | None]:
    """Return the step, bent back to the constraints if that is needed, and where it leads; None if to nothing better.

    The measure is f plus the weighted violations. Close to the solution rounding hides any decrease; there the steps
    shrink quadratically by themselves.
    """

    def merit(at: NlpPoint) -> float:
        return at.objective + weight * float(at.violation.sum())

    before = merit(point)
    enough = before + 1e-12 * (1.0 + abs(before))
    moved = evaluate(z + step)
    if merit(moved) <= enough:
        return step, moved
    chosen = _working(point, multipliers)
    bent = step - np.linalg.lstsq(point.jacobian[chosen], moved.residuals[chosen], rcond=1e-10)[0]
    back = evaluate(z + bent)
    if merit(back) <= enough or float(np.abs(step).max()) < 1e-7:
        return bent, back
    return step, None


def _working(point: NlpPoint, multipliers: Array) -> Indices:
    """Return which constraints count as active: equalities and those with multipliers."""
    equal = np.arange(len(point.residuals)) < point.n_equalities
    return np.flatnonzero(equal | (multipliers > POSITIVE))


def _least_squares_multipliers(point: NlpPoint, near: float) -> tuple[Indices, Array]:
    """Return the active constraints and their multipliers, the inequalities' ≥ 0, that balance ∇f best."""
    equal = np.arange(len(point.residuals)) < point.n_equalities
    candidates = np.flatnonzero(equal | (point.residuals < near))
    rows = point.jacobian[candidates]
    lower = np.where(equal[candidates], -np.inf, 0.0)
    size = max(float(np.linalg.norm(point.gradient)), 1e-300)
    bounds = (lower, np.full(len(lower), np.inf))
    values = lsq_linear(rows.T, point.gradient / size, bounds, method="bvls", tol=1e-14).x * size
    keep = equal[candidates] | (values > POSITIVE * size)
    active = candidates[keep]
    # The bounded solver stops early; without the bounds the remaining system is an ordinary one.
    exact = np.linalg.lstsq(point.jacobian[active].T, point.gradient, rcond=1e-12)[0]
    if (exact[~equal[active]] >= 0.0).all():
        return active, exact
    return active, values[keep]


def _convex(hessian: Array, rows: Array) -> Array:
    """Return a positive definite matrix equal to the Hessian along constraints that keep their residual."""
    size = float(np.abs(hessian).max(initial=1e-12))
    lifted = hessian + size * rows.T @ rows
    values, vectors = np.linalg.eigh(lifted)
    return (vectors * np.maximum(np.abs(values), 1e-9 * size)) @ vectors.T


def _quadratic_step(hessian: Array, point: NlpPoint, reach: float) -> tuple[Array, Array] | None:
    """Solve min ½ dᵀ H d + ∇f·d with the constraints made linear and |d| ≤ reach; return d and the multipliers."""
    n, m, n_e = len(point.gradient), len(point.residuals), point.n_equalities
    box = np.eye(n)
    rows = np.vstack([-point.jacobian, box, -box])
    right = np.concatenate([point.residuals, np.full(2 * n, reach)])
    cones = [clarabel.ZeroConeT(n_e), clarabel.NonnegativeConeT(m - n_e + 2 * n)]
    found = solve_quadratic(hessian, point.gradient, rows, right, cones, tolerance=1e-13)
    return None if found is None else (found[0], found[1][:m])
