"""Phase one by least squares: from any start to a point that meets every constraint, or close to one.

First the geometry alone (gaps, clearances, order of the fingers) with contact normals that oppose each other, then
internal forces, then everything. Also the last polish of a solution that is feasible but for the solver's accuracy.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from scipy.optimize import nnls

from ..evaluation.state import GraspState
from ..problem.term import Constraint, Unit
from ..spatial import Array, skew
from ..terms.registry import stacked
from .least_squares import restore_feasibility
from .program import GraspProgram

OPPOSITION_WEIGHT = 3.0
"""Weight of the balance of contact normals."""
SYNERGY_WEIGHT = 10.0
"""Weight of joint angles that only bending under load can give [1/rad]."""
LEAST_SHARE = 0.4
"""Every contact carries at least this part of an equal share in the balance of normals."""
SQUEEZE = 2.0
"""Normal force the internal forces start from [N]."""
GEOMETRY_EVALUATIONS, ALL_EVALUATIONS, SETTLE_EVALUATIONS, POLISH_EVALUATIONS = 40, 100, 40, 25

ResidualAndJacobian = Callable[[Array], tuple[Array, Array]]
Stage = Literal["geometry", "all", "polish"]
Margin = Callable[[Unit], float]


def no_margin(unit: Unit) -> float:
    """Return the margin of equalities: none."""
    return 0.0


def wide_margin(unit: Unit) -> float:
    """Return how far inside inequalities phase one ends."""
    return unit.margin


def polish_margin(unit: Unit) -> float:
    """Return how far inside inequalities the polish ends."""
    return unit.polish_margin


def reach_feasibility(program: GraspProgram, z: Array, check: Callable[[], None]) -> Array:
    """Return a point near a start that meets every constraint as well as possible.

    Args:
        program: The program.
        z: Start in scaled variables, of shape (n,).
        check: Called at every evaluation; may raise to stop.

    Returns:
        The point, of shape (n,).
    """
    z = _restore(program, z, "geometry", GEOMETRY_EVALUATIONS, check)
    z = pressing(program, z)
    return _restore(program, z, "all", ALL_EVALUATIONS, check)


def settle(program: GraspProgram, z: Array, check: Callable[[], None]) -> Array:
    """Return the point near one that nearly meets every constraint, with exact clearances, if there is one."""
    return _restore(program, z, "all", SETTLE_EVALUATIONS, check)


def polish(program: GraspProgram, z: Array, check: Callable[[], None]) -> Array:
    """Return the point near a solution that meets every constraint to rounding, if there is one."""
    return _restore(program, z, "polish", POLISH_EVALUATIONS, check)


def pressing(program: GraspProgram, z: Array) -> Array:
    """Return the variables with the δσ, or forces, that come closest to pressing with 2 N at every contact."""
    state, layout = program.state(z), program.evaluator.layout
    moved = layout.forces if layout.n_forces else layout.displacement
    by_moved = state.d_intensities[:, moved] * program.scale[moved]
    wanted = SQUEEZE * state.geometry.covectors.ravel() - (state.intensities.ravel() - by_moved @ z[moved])
    result = np.array(z)
    gram = by_moved.T @ by_moved + 1e-3 * np.eye(by_moved.shape[1])
    result[moved] = np.linalg.solve(gram, by_moved.T @ wanted)
    return result


def opposition(state: GraspState, length: float) -> tuple[Array, Array]:
    """Return how far the contact normals are from balancing each other, and its derivatives.

    The residual is Σ a_i (n_i, c_i × n_i / L) for the shares a_i ≥ 0.4/n_c that make it least, Σ a_i = 1; its
    derivative is taken at fixed shares.

    Args:
        state: The state.
        length: Characteristic length L [m].

    Returns:
        Residual, dimensionless, of shape (6,), and its derivatives by x, of shape (6, n_x).
    """
    geometry = state.geometry
    normals, points = geometry.normals, geometry.points
    count = len(normals)
    wrenches = np.vstack([normals.T, (skew(points) @ normals[:, :, None])[:, :, 0].T / length])
    least = np.full(count, LEAST_SHARE / count)
    system = np.vstack([wrenches, np.full((1, count), 10.0)])
    extra, _ = nnls(system, np.append(np.zeros(6), 10.0) - system @ least)
    shares = extra + least
    derivative = np.zeros((6, state.x.size))
    size = geometry.d_points.shape[2]
    derivative[:3, :size] = np.einsum("i,ijk->jk", shares, geometry.d_normals)
    turning = skew(points) @ geometry.d_normals - skew(normals) @ geometry.d_points
    derivative[3:, :size] = np.einsum("i,ijk->jk", shares, turning) / length
    return wrenches @ shares, derivative


def _restore(program: GraspProgram, z: Array, stage: Stage, evaluations: int, check: Callable[[], None]) -> Array:
    """Run one stage."""
    margin = polish_margin if stage == "polish" else wide_margin
    terms = [term for term in program.constraints if stage != "geometry" or term.geometric]
    length = program.problem.grasp_object.length_scale

    def equality(z: Array) -> tuple[Array, Array]:
        check()
        value, slope = weighted_residuals(program, z, [term for term in terms if term.equality], no_margin)
        if stage != "geometry":
            return value, slope
        state = program.state(z)
        balance, derivative = opposition(state, length)
        bent, bending = program.evaluator.synergy_distance(state.x)
        value = np.concatenate([value, OPPOSITION_WEIGHT * balance, SYNERGY_WEIGHT * bent])
        rows = np.vstack([OPPOSITION_WEIGHT * derivative, SYNERGY_WEIGHT * bending])
        return value, np.vstack([slope, rows * program.scale])

    def inequality(z: Array) -> tuple[Array, Array]:
        return weighted_residuals(program, z, [term for term in terms if not term.equality], margin)

    lower, upper = program.bounds()
    return restore_feasibility(
        equality,
        inequality,
        z,
        lower,
        upper,
        max_evaluations=evaluations,
        tolerance=1e-12 if stage == "polish" else 1e-6,
        regularisation=1e-6 if stage == "polish" else 1e-3,
    )


def weighted_residuals(program: GraspProgram, z: Array, terms: list[Constraint], margin: Margin) -> tuple[Array, Array]:
    """Return residuals of terms less margins, weighted by their units, and their Jacobian.

    Args:
        program: The program.
        z: Scaled variables, of shape (n,).
        terms: The terms.
        margin: What is taken off the residuals, by unit.

    Returns:
        Residuals of shape (m,) and their derivatives by z, of shape (m, n); not finite far from any grasp, which
        least squares answers with a shorter step.
    """
    state = program.state(z)
    with np.errstate(over="ignore", invalid="ignore"):
        value, slope = stacked(
            terms, program.problem, state, lambda term: term.unit.weight, lambda term: margin(term.unit)
        )
        return value, slope * program.scale
