"""Planning: from a problem to the best grasps found, over one standard and several random starts."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from ..checks import positive_whole
from ..grasp.grasp import FEASIBILITY_TOLERANCE, Grasp, IterationRecord
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from .attempt import Attempt, AttemptSolver
from .neighbours import NearGrasps
from .off_stops import off_stops
from .preparation import search_starts
from .program import GraspProgram
from .ranking import FoundGrasps, alike
from .side_contacts import moved_contacts
from .starts import GraspStart, standard_start

PATIENCE = 2
"""How many times as many different grasps as are enough are looked for while none of them closes with little force."""
MOST_GRASPS = 100
"""Most grasps of one call."""


class _Stop(Exception):
    """Raised inside the solver's callback to leave it: cancelled, or out of time."""


def plan_grasp(
    problem: GraspProblem,
    *,
    seed: int = 0,
    options: PlannerOptions | None = None,
    start: GraspStart | None = None,
    callback: Callable[[IterationRecord], None] | None = None,
    cancel: Callable[[], bool] | None = None,
    result_callback: Callable[[Grasp], None] | None = None,
) -> Grasp:
    """Plan a grasp: minimise the objective (29) subject to (10), (30)–(32), by SQP from several starts.

    Without weights, least force comes first: every start seeks little F, then the best C with at most
    ``force_factor`` times the least F found; at last joints are taken off their stops where that costs the task little
    (:func:`~grasp_planner.planning.off_stops.off_stops`). The same problem, seed and options give the same grasp.

    Args:
        problem: What is to be planned.
        seed: Seed of the random starts.
        options: How hard to search.
        start: First start; the standard start without contact if left out.
        callback: Called after every iteration.
        cancel: Polled at every iteration; True ends the search with the best grasp so far.
        result_callback: Called with what every start ended at, feasible or not; its ``search`` reports the search
            so far.

    Returns:
        The best feasible grasp found; if none was, the attempt closest to feasible. The grasp judges itself:
        see ``feasible``, ``verdict`` and ``violations``.
    """
    return plan_grasps(
        problem,
        1,
        seed=seed,
        options=options,
        start=start,
        callback=callback,
        cancel=cancel,
        result_callback=result_callback,
    )[0]


def plan_grasps(
    problem: GraspProblem,
    count: int,
    *,
    seed: int = 0,
    options: PlannerOptions | None = None,
    start: GraspStart | None = None,
    callback: Callable[[IterationRecord], None] | None = None,
    cancel: Callable[[], bool] | None = None,
    result_callback: Callable[[Grasp], None] | None = None,
) -> tuple[Grasp, ...]:
    """Plan several grasps that differ, the best first.

    Without a first start, contacts derived from a URDF are moved beside the pads of one motor's fingers where these
    hold nothing (:mod:`grasp_planner.planning.side_contacts`): the hand of the grasps' problem has other contact sets.

    Args:
        problem: What is to be planned.
        count: How many, 1 to 100; the search goes on until there are so many or its starts are used up.
        seed: As for :func:`plan_grasp`, like all that follow.
        options: How hard to search.
        start: First start.
        callback: Called after every iteration.
        cancel: Polled at every iteration.
        result_callback: Called with what every start ended at.

    Returns:
        Feasible grasps no two of which are alike (:func:`~grasp_planner.planning.ranking.alike`), at most ``count``;
        if there is none, the attempt closest to feasible.

    Raises:
        InvalidValueError: If the count is out of range.
    """
    positive_whole("count", count, MOST_GRASPS)
    search = _Search(problem, seed, options or PlannerOptions(), callback, cancel, result_callback, count)
    # The matrices are too small for threads to be of use; several per product make planning many times slower.
    with threadpool_limits(limits=1):
        search.run(start)
        return search.best()


class _Search:
    """Keeps the best grasps over the starts of one call."""

    def __init__(
        self,
        problem: GraspProblem,
        seed: int,
        options: PlannerOptions,
        callback: Callable[[IterationRecord], None] | None,
        cancel: Callable[[], bool] | None,
        result_callback: Callable[[Grasp], None] | None,
        count: int,
    ) -> None:
        self.problem, self.seed, self.options, self.count = problem, seed, options, count
        self.cancel, self.result_callback = cancel, result_callback
        solved = options.solver != "none"
        springs = problem.parameters.force_law == "springs"
        asked = springs and solved if options.closing is None else options.closing
        self.closing = asked and max(options.enough, count) > 1  # of one grasp there is nothing to choose
        self.callback = callback
        self.solver = AttemptSolver(problem, options, callback, self._check_stop)
        self.began = time.perf_counter()
        self.tried = self.evaluations = 0
        self.stopped = False
        self.cancelled = False
        self._nearest: tuple[float, Grasp] | None = None
        self._last_resort: Grasp | None = None
        self.found = FoundGrasps()
        self._near: NearGrasps | None = None
        self._program: GraspProgram | None = None
        self._worth_counting = count  # different grasps before which there can't be enough that are not alike

    @property
    def finished(self) -> bool:
        """Whether no further start is to be tried."""
        enough, found, most_force = max(self.options.enough, self.count), self.found, self.solver.most_force
        if self.stopped or found.count < enough:
            return self.stopped
        if self.closing and not found.closing(most_force):
            most = PATIENCE * enough
            return found.different >= most or found.count >= PATIENCE * most
        if self.count > 1 and found.different >= self._worth_counting:
            missing = self.count - len(found.best(self.count, closing=False, most_force=most_force))
            self._worth_counting = found.different + missing
        return self.count == 1 or self._worth_counting <= found.different

    def run(self, start: GraspStart | None) -> None:
        """Try starts, one that is given first, until enough grasps are found or the search has to end."""
        try:
            if start is None:
                self._move_contacts()
            if self.options.solver == "none":
                self._near = NearGrasps(self.problem)
            rng = np.random.default_rng(self.seed)
            starts = search_starts(self.problem, rng, start, self.while_preparing, self._near)
            for index in range(self.options.starts):
                self._try_start(index, next(starts))
                if self.finished:
                    return
        except _Stop:  # while contacts were moved or the next start was prepared
            if self._nearest is None and not self.found.count:
                self._keep(Attempt.at(0, self.problem, standard_start(self.problem)))

    def _move_contacts(self) -> None:
        """Go on with contacts beside the pads where these hold nothing."""
        moved = moved_contacts(self.problem, np.random.default_rng(self.seed), self._check_stop)
        if moved is not self.problem:
            self.problem = moved
            self.solver = AttemptSolver(moved, self.options, self.callback, self._check_stop)

    def while_preparing(self) -> None:
        """Count an evaluation spent on a start to come, and leave if the search has to end."""
        self.evaluations += 1
        self._check_stop()

    def _try_start(self, index: int, start: GraspStart) -> None:
        """Solve from one start and keep the result if it is the best so far."""
        attempt = Attempt.at(index, self.problem, start, self._program)
        self._program = attempt.program
        self.tried += 1
        try:
            self.solver.solve(attempt)
        except _Stop:
            self.stopped = True
        except (ValueError, FloatingPointError, np.linalg.LinAlgError) as error:
            # Far from any grasp G may lose rank and forces overflow: such a start has failed, not the search.
            attempt.message = str(error)
        self.evaluations += attempt.program.evaluations
        self._keep(attempt)
        wanted = not self.found.count and self._last_resort is None and not self.stopped
        if wanted and attempt.settled is not None:
            self._keep_settled(attempt)

    def _keep_settled(self, attempt: Attempt) -> None:
        """Keep where phase two began, if that is feasible: phase two may leave contacts that are not force-closed."""
        before = attempt.program.evaluations
        try:
            self.solver.go_back(attempt)
            grasp = attempt.grasp(self.seed, self.options)
            self._last_resort = grasp if grasp.is_feasible(FEASIBILITY_TOLERANCE) else None
        except _Stop:
            self.stopped = True
        except (ValueError, FloatingPointError, np.linalg.LinAlgError):
            pass  # no grasp there
        self.evaluations += attempt.program.evaluations - before

    def best(self) -> tuple[Grasp, ...]:
        """Return the best grasps with the report of the whole search."""
        if not self.found.count and self._last_resort is not None:
            self.found.keep(self._last_resort)
        found = self.found.best(self.count, closing=self.closing, most_force=self.solver.most_force)
        if not found:
            assert self._nearest is not None
            found = (self._nearest[1],)
        elif self.options.solver != "none" and not self.problem.parameters.weighted and not self.stopped:
            found = self._off_stops(found)
        return tuple(self._reported(grasp) for grasp in found)

    def _off_stops(self, found: tuple[Grasp, ...]) -> tuple[Grasp, ...]:
        """Return the grasps with their joints off their stops where that is cheap and no two become alike."""
        chosen: list[Grasp] = list(found)
        try:
            for index, grasp in enumerate(found):
                moved = off_stops(grasp, self.solver.most_force, self._check_stop, closing=self.closing)
                others = chosen[:index] + chosen[index + 1 :]
                if not any(alike(moved, other) for other in others):
                    chosen[index] = moved
        except _Stop:
            self.stopped = True
        return tuple(chosen)

    def _reported(self, grasp: Grasp) -> Grasp:
        """Return a grasp with the report of the search so far."""
        assert grasp.search is not None
        least = self.solver.least_force
        report = replace(
            grasp.search,
            evaluations=self.evaluations,
            starts_tried=self.tried,
            starts_feasible=self.found.count,
            least_force=least if np.isfinite(least) else None,
            time_s=time.perf_counter() - self.began,
            cancelled=self.cancelled,
        )
        return grasp.with_search(report)

    def _check_stop(self) -> None:
        """Leave the solver if cancelled or out of time."""
        if self.cancel is not None and self.cancel():
            self.cancelled = True
            raise _Stop
        limit = self.options.time_limit_s
        if limit is not None and time.perf_counter() - self.began > limit:
            raise _Stop

    def _keep(self, attempt: Attempt) -> None:
        """Turn an attempt into a grasp and keep it if it is feasible, or nearer to that than any before."""
        if not np.isfinite(attempt.z).all():
            return
        grasp = attempt.grasp(self.seed, self.options)
        if grasp.is_feasible(FEASIBILITY_TOLERANCE):
            self.found.keep(grasp, self.solver.most_force)
            if self._near is not None:
                self._near.add(grasp)
        elif self._nearest is None or attempt.merit < self._nearest[0]:
            self._nearest = attempt.merit, grasp
        if self.result_callback is not None:
            self.result_callback(self._reported(grasp))
