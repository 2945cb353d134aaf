"""Sequential quadratic programming with second derivatives within a trust region. No robotics here.

The measure of a point is f + ν v with v its largest violation [Nocedal2006, section 18.5]; the model's constraints may
miss by as much as the weight ν allows, so that every subproblem has a solution. ν follows the multipliers up and down,
and is raised before a step is tried that would leave a violation which could have been taken off. Quasi-Newton steps,
which are far cheaper, go first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import clarabel
import numpy as np

from ..spatial import Array
from .lagrangian import NlpPoint, lagrangian_gradient, lagrangian_hessian
from .nlp import NlpSolution, NonlinearProgram, solve_nlp
from .quadratic import solve_quadratic

ROUGH = 1e-3
"""Tolerance of the quasi-Newton steps that go first."""
OPTIMAL = 1e-7
"""Gradient of the Lagrangian, relative to the objective's where that is large, and violation of an optimal point."""
FIRST_REACH, LEAST_REACH, MOST_REACH = 0.3, 1e-9, 2.0
"""Largest step of any scaled variable."""
WEIGHT_MARGIN, WEIGHT_SLACK, MOST_WEIGHT = 1.5, 15.0, 1e7
"""ν against the sum of the multipliers: at least and at most; and the most it may be."""
TAKEN_OFF = 0.1
"""Share of the violation that a step may leave where more could be taken off."""
ENOUGH, GOOD = 1e-4, 0.7
"""Share of the predicted decrease from which a step is taken, and from which the next one may be longer."""
STALLED, PATIENCE = 1e-9, 6
"""Relative decrease of the measure that counts for nothing, and how many such steps in a row end it."""
NO_MULTIPLIER = 1e-9
"""Multipliers below this, relative to the largest and to the gradient, count as zero."""
FLAT = 1e-6
"""Least curvature of the model, relative to the largest."""


@dataclass(frozen=True)
class _Step:
    """The solution of a subproblem: a step, the multipliers of all constraints, and the violation of the model."""

    step: Array
    multipliers: Array
    missed: float


class _Search:
    """Where a solve stands."""

    def __init__(self, program: NonlinearProgram, z: Array) -> None:
        self.program, self.z = program, z
        self.evaluations = 0
        self.reach, self.weight = FIRST_REACH, 1.0
        self.point = self.evaluate(z)
        self.multipliers: Array = np.zeros(len(self.point.residuals))

    def evaluate(self, z: Array) -> NlpPoint:
        """Return the program at a point."""
        self.evaluations += 1
        return self.program.point(z)

    def measure(self, point: NlpPoint) -> float:
        """Return f + ν v."""
        return point.objective + self.weight * float(point.violation.max(initial=0.0))

    def stationarity(self) -> float:
        """Return what the multipliers leave of the objective's gradient; what presses on a bound does not count."""
        used = np.flatnonzero(self.multipliers)
        left = lagrangian_gradient(self.point, used, self.multipliers[used])
        low, high = self.z - self.program.lower < OPTIMAL, self.program.upper - self.z < OPTIMAL
        held = (low & (left > 0.0)) | (high & (left < 0.0))
        return float(np.abs(left[~held]).max(initial=0.0)) / self.point.steepness

    def optimal(self) -> bool:
        """Return whether the first-order conditions hold."""
        return self.point.violation.max(initial=0.0) < OPTIMAL and self.stationarity() < OPTIMAL

    def advance(self) -> float | None:
        """Take one step, shorter and shorter until one helps; return by how much the measure fell, None without one."""
        hessian = self._model()
        while self.reach > LEAST_REACH:
            found = self._subproblem(hessian)
            if found is None:
                self.reach *= 0.25
                continue
            gain = self._try(found, hessian)
            if gain is not None:
                return gain
        return None

    def _model(self) -> Array:
        """Return the convex matrix of the model.

        Along the equalities' tangents it is the Hessian of the Lagrangian, by forward differences of its gradient,
        its negative curvature turned about; across active inequalities and equalities it does not count.
        """
        point, used = self.point, np.flatnonzero(self.multipliers)
        across = point.jacobian[: point.n_equalities]
        tangents = np.linalg.qr(across.T, mode="complete")[0][:, len(across) :]
        curved = lagrangian_hessian(self.evaluate, self.z, self.multipliers, at=point, along=tangents)
        size = float(np.abs(curved).max(initial=1e-12))
        active = point.jacobian[used[used >= point.n_equalities]] @ tangents
        values, vectors = np.linalg.eigh(curved + size * active.T @ active)
        convex = (vectors * np.maximum(np.abs(values), FLAT * size)) @ vectors.T
        return np.asarray(tangents @ convex @ tangents.T + FLAT * size * np.eye(len(self.z)))

    def _subproblem(self, hessian: Array) -> _Step | None:
        """Solve the model; raise ν as long as that takes off violation which the step would leave."""
        violation = float(self.point.violation.max(initial=0.0))
        found = self._quadratic_step(hessian)
        while found is not None and found.missed > TAKEN_OFF * violation and violation > OPTIMAL:
            if self.weight >= MOST_WEIGHT:
                break
            self.weight *= 10.0
            heavier = self._quadratic_step(hessian)
            if heavier is None or heavier.missed > (1.0 - TAKEN_OFF) * found.missed:
                break
            found = heavier
        return found

    def _quadratic_step(self, hessian: Array) -> _Step | None:
        """Solve min ½ dᵀ H d + ∇f·d + ν t: constraints made linear miss by at most t, within bounds and reach."""
        point, z, n = self.point, self.z, len(self.z)
        equal, spare = np.split(point.jacobian, [point.n_equalities])
        box = np.eye(n)
        blocks = np.vstack([equal, -equal, -spare, np.zeros((1, n)), box, -box])
        missing = np.zeros(len(blocks))
        missing[: len(blocks) - 2 * n] = -1.0
        residuals = point.residuals
        zero, room = residuals[: point.n_equalities], residuals[point.n_equalities :]
        high = np.minimum(self.program.upper - z, self.reach)
        low = np.minimum(z - self.program.lower, self.reach)
        right = np.concatenate([-zero, zero, room, [0.0], high, low])
        square = np.zeros((n + 1, n + 1))
        square[:n, :n] = hessian
        slope, rows = np.append(point.gradient, self.weight), np.column_stack([blocks, missing])
        cones = [clarabel.NonnegativeConeT(len(right))]
        solution = solve_quadratic(square, slope, rows, right, cones, tolerance=1e-12)
        if solution is None:
            return None
        (x, dual), n_e = solution, point.n_equalities
        multipliers = np.concatenate([dual[n_e : 2 * n_e] - dual[:n_e], dual[2 * n_e : 2 * n_e + len(room)]])
        multipliers[
            np.abs(multipliers) < NO_MULTIPLIER * max(point.steepness, np.abs(multipliers).max(initial=0.0))
        ] = 0.0
        step = np.clip(x[:n], -low, high)
        linear = NlpPoint(0.0, step, residuals + point.jacobian @ step, point.jacobian, n_e)
        return _Step(step, multipliers, float(linear.violation.max(initial=0.0)))

    def _try(self, found: _Step, hessian: Array) -> float | None:
        """Take a step if it helps, bent back to the constraints where that is needed, or shorten the reach.

        Returns:
            By how much the measure fell; None if the step was not taken.
        """
        point, step = self.point, found.step
        total = float(np.abs(found.multipliers).sum())
        self.weight = float(np.clip(self.weight, WEIGHT_MARGIN * total, max(WEIGHT_SLACK * total, 1e-3)))
        before = self.measure(point)
        model = point.objective + point.gradient @ step + 0.5 * step @ hessian @ step + self.weight * found.missed
        predicted = before - float(model)
        rounding = 1e-13 * (1.0 + abs(before))
        size = float(np.abs(step).max())

        def share(at: NlpPoint) -> float:
            return (before - self.measure(at) + rounding) / max(predicted, rounding)

        moved = self.evaluate(self.z + step)
        if share(moved) < GOOD:
            bent = self._bent(step, found.multipliers, moved)
            back = self.evaluate(self.z + bent)
            if share(back) > share(moved):
                step, moved = bent, back
        if not share(moved) > ENOUGH:
            self.reach = 0.3 * min(self.reach, size)
            return None
        if share(moved) > GOOD and size > 0.9 * self.reach:
            self.reach = min(2.0 * self.reach, MOST_REACH)
        self.z, self.point, self.multipliers = self.z + step, moved, found.multipliers
        return before - self.measure(moved)

    def _bent(self, step: Array, multipliers: Array, moved: NlpPoint) -> Array:
        """Return a step whose end is moved back to the constraints that count: second-order correction."""
        counts = np.arange(len(multipliers)) < moved.n_equalities
        counts |= multipliers > 0.0
        back = np.linalg.lstsq(self.point.jacobian[counts], moved.residuals[counts], rcond=1e-10)[0]
        return np.clip(step - back, self.program.lower - self.z, self.program.upper - self.z)


def solve_newton(
    program: NonlinearProgram,
    z0: Array,
    *,
    max_iterations: int = 200,
    callback: Callable[[Array], None] | None = None,
) -> NlpSolution:
    """Solve a nonlinear program from one point: roughly by SLSQP, then with second derivatives.

    Args:
        program: The program.
        z0: Start, clipped to the bounds, of shape (n,).
        max_iterations: Most steps of either kind.
        callback: Called with z after every step; may raise to stop.

    Returns:
        The last point; converged where the first-order conditions hold to 1e-7.
    """
    rough = solve_nlp(program, z0, max_iterations=max_iterations, tolerance=ROUGH, callback=callback)
    search = _Search(program, np.clip(rough.z, program.lower, program.upper))
    message, steps, idle = "Iteration limit reached", 0, 0
    while steps < max_iterations:
        if steps and search.optimal():
            message = "First-order conditions hold"
            break
        gain = search.advance()
        if gain is None:
            message = "No step helps"
            break
        steps += 1
        if callback is not None:
            callback(search.z)
        idle = idle + 1 if gain < STALLED * (1.0 + abs(search.point.objective)) else 0
        if idle == PATIENCE:
            message = "Nothing more is to be had"
            break
    return NlpSolution(
        z=search.z,
        converged=search.optimal(),
        message=message,
        iterations=rough.iterations + steps,
        evaluations=rough.evaluations + search.evaluations,
    )
