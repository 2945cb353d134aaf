"""Phase one for many starts at once: Levenberg–Marquardt on stacked normal equations, in a pool that is refilled.

Only rows that are violated count; a start that does not come nearer is dropped, and others take its place, so that the
pool stays as wide as it computes well [Levenberg1944, Marquardt1963].
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..spatial import Array, Indices, namespace
from .problem_rows import UNITS, BatchedProblem
from .states import States, chosen

JOINT_SCALE, TRANSLATION_SCALE, ROTATION_SCALE, FORCE_SCALE = 0.3, 0.1, 1.0, 2.0
"""Unit steps of the scaled variables [rad, m, rad, N]."""
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-2, 1e-9, 1e8
EASIER, HARDER = 0.2, 6.0
"""Factors of the damping after a step that helped and after one that did not."""
WINDOW, STALLED, OLDEST = 12, 0.7, 80
"""Every so many iterations the cost has to have come down to this part; and the most iterations of a start."""
LONGEST_TURN = 0.5
"""Largest step of an angle [rad]."""
SOLVED = 1e-6
"""Largest weighted residual of equalities and violation of inequalities of a state that is found."""
REMEMBERED = 60
"""How many dropped states are remembered, those that came nearest to feasible."""
REFILL = 8
"""The pool is refilled when one part in so many of it is free."""
FIRST, MOST_BYTES, COPIES = 64, 2e9, 8
"""A wider pool begins with so many states, whose rows tell how many fit in so much memory [bytes], each Jacobian being
there so many times at most."""


@dataclass
class PoolCount:
    """What a pool did.

    Attributes:
        starts: Starts taken.
        found: Feasible states found.
        dropped: Starts that came no nearer.
        not_finite: Starts dropped because they were not finite.
        evaluations: States evaluated.
    """

    starts: int = 0
    found: int = 0
    dropped: int = 0
    not_finite: int = 0
    evaluations: int = 0


@dataclass
class _Rows:
    """The states in the pool with their weighted residuals and scaled Jacobians."""

    states: States
    residual: Array
    jacobian: Array
    damping: Array
    age: Indices
    marked: Array

    @property
    def cost(self) -> Array:
        """Sum of squares, of shape (B,)."""
        return namespace(self.residual).einsum("bi,bi->b", self.residual, self.residual)

    def take(self, rows: Indices) -> _Rows:
        """Return some of them."""
        return _Rows(
            self.states.take(rows),
            self.residual[rows],
            self.jacobian[rows],
            self.damping[rows],
            self.age[rows],
            self.marked[rows],
        )

    def joined(self, other: _Rows) -> _Rows:
        """Return these and others."""
        xp = namespace(self.residual)
        return _Rows(
            self.states.joined(other.states),
            xp.concatenate([self.residual, other.residual]),
            xp.concatenate([self.jacobian, other.jacobian]),
            xp.concatenate([self.damping, other.damping]),
            xp.concatenate([self.age, other.age]),
            xp.concatenate([self.marked, other.marked]),
        )


@dataclass
class Pool:
    """Brings starts of a problem to feasibility.

    Attributes:
        batched: The problem.
        width: Most states at a time; less once it is known that so many do not fit in memory.
        count: What was done so far.
        nearest: Dropped states that came nearest to feasible, with their costs, the nearest first.
    """

    batched: BatchedProblem
    width: int = 64
    count: PoolCount = field(default_factory=PoolCount)
    nearest: list[tuple[float, States]] = field(default_factory=list)

    def __post_init__(self) -> None:
        problem = self.batched.problem
        n_q, n = problem.hand.n_joints, self.batched.n_variables
        self._scale = np.full(n, FORCE_SCALE)
        self._scale[:n_q] = JOINT_SCALE
        self._scale[n_q : n_q + 3], self._scale[n_q + 3 : n_q + 6] = TRANSLATION_SCALE, ROTATION_SCALE
        self._n_q = n_q

    def search(self, make: Callable[[int], States], total: int, check: Callable[[], None]) -> Iterator[States]:
        """Yield feasible states as they are found, each a batch of one.

        Args:
            make: Makes a number of starts.
            total: Most starts.
            check: Called at every iteration; may raise to stop.
        """
        pool = self._filled(make, min(self.width, total, FIRST))
        each = 8 * COPIES * pool.jacobian.shape[1] * pool.jacobian.shape[2]
        self.width = min(self.width, max(1, int(MOST_BYTES / each)))
        while len(pool.states):
            check()
            pool = self._stepped(pool)
            done = np.asarray(self._solved(pool.residual))
            for row in np.flatnonzero(done):
                self.count.found += 1
                yield pool.states.take(np.array([row]))
            dropped = np.asarray(self._hopeless(pool)) & ~done
            keep = ~(done | dropped)
            self._remember(pool.take(np.flatnonzero(dropped)))
            room = min(self.width - int(keep.sum()), total - self.count.starts)
            pool = pool.take(np.flatnonzero(keep))
            if room * REFILL >= self.width or (room and not keep.any()):
                pool = pool.joined(self._filled(make, room))

    def _remember(self, dropped: _Rows) -> None:
        """Count dropped states, and keep those that came nearest to feasible."""
        self.count.dropped += len(dropped.states)
        cost = np.asarray(dropped.cost)
        near = [(float(cost[row]), dropped.states.take(np.array([row]))) for row in range(len(cost))]
        self.nearest = sorted([*self.nearest, *near], key=lambda each: each[0])[:REMEMBERED]

    def _filled(self, make: Callable[[int], States], number: int) -> _Rows:
        """Return fresh rows; starts that are not finite are dropped and counted."""
        self.count.starts += number
        states = make(number)
        residual, jacobian = self._evaluate(states)
        xp = namespace(residual)
        finite = xp.isfinite(residual).all(axis=1) & xp.isfinite(jacobian).all(axis=(1, 2))
        self.count.not_finite += int((~finite).sum())
        cost = xp.einsum("bi,bi->b", residual, residual)
        fresh = _Rows(states, residual, jacobian, xp.full(number, FIRST_DAMPING), xp.zeros(number, dtype=int), cost)
        return fresh.take(np.flatnonzero(finite))

    def _evaluate(self, states: States) -> tuple[Array, Array]:
        """Return weighted residuals, zero where an inequality is met, and their Jacobian by scaled variables."""
        self.count.evaluations += len(states)
        xp, values, slopes = namespace(states.joints), [], []
        for rows in self.batched.rows(states):
            unit = UNITS[rows.name]
            value = unit.weight * rows.value
            if not rows.equality:
                value = xp.minimum(value - unit.weight * unit.margin, 0.0)
            values.append(value)
            slopes.append((unit.weight * self._scale) * rows.derivative)
        return xp.concatenate(values, axis=1), xp.concatenate(slopes, axis=1)

    def _solved(self, residual: Array) -> npt.NDArray[np.bool_]:
        """Return which states are feasible: every weighted residual small, inequalities with their margins."""
        return namespace(residual).abs(residual).max(axis=1) < SOLVED

    def _stepped(self, pool: _Rows) -> _Rows:
        """Return the pool after one step of every state that a step brings nearer."""
        xp, hand = namespace(pool.residual), self.batched.problem.hand
        step = self._step(pool)
        states = pool.states.stepped(step, hand.lower, hand.upper)
        with np.errstate(all="ignore"):
            residual, jacobian = self._evaluate(states)
            cost = xp.einsum("bi,bi->b", residual, residual)
            better = cost < pool.cost  # false where it is not finite
        damping = xp.where(better, pool.damping * EASIER, pool.damping * HARDER)
        return _Rows(
            states=pool.states.replaced(better, states),
            residual=chosen(better, residual, pool.residual),
            jacobian=chosen(better, jacobian, pool.jacobian),
            damping=xp.clip(damping, LEAST_DAMPING, MOST_DAMPING),
            age=pool.age + 1,
            marked=pool.marked,
        )

    def _step(self, pool: _Rows) -> Array:
        """Return the damped Gauss–Newton steps, of shape (B, n_x), joints at a limit held where they press on it."""
        hand, n_q = self.batched.problem.hand, self._n_q
        xp, active = namespace(pool.residual), pool.residual != 0.0
        most = int(active.sum(axis=1).max())
        order = xp.argsort(~active, axis=1, stable=True)[:, :most]
        residual = xp.take_along_axis(pool.residual, order, axis=1)
        jacobian = xp.take_along_axis(pool.jacobian, order[:, :, None], axis=1)
        jacobian *= (residual != 0.0)[:, :, None]
        slope = (residual[:, None] @ jacobian)[:, 0]
        q = pool.states.joints
        held = ((q <= hand.lower) & (slope[:, :n_q] > 0.0)) | ((q >= hand.upper) & (slope[:, :n_q] < 0.0))
        free = xp.concatenate([~held, xp.ones_like(slope[:, n_q:], dtype=bool)], axis=1)
        jacobian *= free[:, None]
        normal = jacobian.transpose(0, 2, 1) @ jacobian
        normal += pool.damping[:, None, None] * np.eye(normal.shape[1])
        step = -xp.linalg.solve(normal, (slope * free)[..., None])[..., 0] * self._scale
        largest = xp.maximum(xp.abs(step[:, :n_q]).max(axis=1), xp.abs(step[:, n_q + 3 : n_q + 6]).max(axis=1))
        return step * xp.minimum(1.0, LONGEST_TURN / xp.maximum(largest, 1e-12))[:, None]

    def _hopeless(self, pool: _Rows) -> npt.NDArray[np.bool_]:
        """Return which states do not come nearer, and mark the others' costs."""
        due = pool.age % WINDOW == 0
        cost = pool.cost
        stalled = due & (cost > STALLED * pool.marked)
        pool.marked = namespace(cost).where(due, cost, pool.marked)
        return stalled | (pool.age >= OLDEST)
