"""Planning: from a problem to the best grasp found, over one standard and several random starts."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from threadpoolctl import threadpool_limits

from ..grasp.grasp import FEASIBILITY_TOLERANCE, Grasp, IterationRecord, SearchReport
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from ..spatial import Array
from .nlp import solve_nlp
from .phase_one import polish, reach_feasibility, settle
from .preparation import FEW_SYNERGIES, search_starts
from .program import GraspProgram, Phase
from .ranking import FoundGrasps
from .starts import GraspStart, standard_start

PHASE_ONE_GOOD_ENOUGH = 0.1
"""Largest scaled violation after phase one from which phase two is worth trying."""
LEAST_SQUARES_GOOD_ENOUGH = 0.3
"""The same for phase one by least squares, which ends inside most of the constraints."""
WORTH_POLISHING = 0.05
"""Largest scaled violation after phase two that a last least-squares solve may remove."""
PATIENCE = 2
"""How many times as many different grasps as are enough are looked for while none of them closes."""


@dataclass
class _Attempt:
    """One start while and after it is solved."""

    index: int
    program: GraspProgram
    z: Array
    prepared: bool
    iterations: dict[str, int] = field(default_factory=lambda: {"one": 0, "two": 0})
    message: str = ""
    history: list[IterationRecord] = field(default_factory=list)


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
    """Plan a grasp: minimise z = w_F F + w_C C (29) subject to (10), (30)–(32), by SQP from several starts.

    The same problem, seed and options give the same grasp.

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
    options = options or PlannerOptions()
    search = _Search(problem, seed, options, callback, cancel, result_callback)
    # The matrices are too small for threads to be of use; several per product make planning many times slower.
    with threadpool_limits(limits=1):
        search.run(search_starts(problem, np.random.default_rng(seed), start, search.while_preparing))
        return search.best()


class _Search:
    """Keeps the best grasp over the starts of one call."""

    def __init__(
        self,
        problem: GraspProblem,
        seed: int,
        options: PlannerOptions,
        callback: Callable[[IterationRecord], None] | None,
        cancel: Callable[[], bool] | None,
        result_callback: Callable[[Grasp], None] | None,
    ) -> None:
        self.problem, self.seed, self.options = problem, seed, options
        self.callback, self.cancel, self.result_callback = callback, cancel, result_callback
        asked = problem.parameters.force_law == "springs" if options.closing is None else options.closing
        self.closing = asked and options.enough > 1  # of one grasp there is nothing to choose
        self.began = time.perf_counter()
        self.tried = self.evaluations = 0
        self.stopped = False
        self.cancelled = False
        self._nearest: tuple[float, Grasp] | None = None
        self.found = FoundGrasps()

    @property
    def finished(self) -> bool:
        """Whether no further start is to be tried."""
        enough, found = self.options.enough, self.found
        if self.stopped or found.count < enough or not self.closing:
            return self.stopped or found.count >= enough
        most = PATIENCE * enough
        return found.different >= most or found.count >= PATIENCE * most or found.first_closing() is not None

    def run(self, starts: Iterator[GraspStart]) -> None:
        """Try starts until enough grasps are found or the search has to end."""
        try:
            for index in range(self.options.starts):
                self._try_start(index, next(starts))
                if self.finished:
                    return
        except _Stop:  # while the next start was prepared
            if self._nearest is None and not self.found.count:
                self._keep(self._attempt(0, standard_start(self.problem)))

    def while_preparing(self) -> None:
        """Count an evaluation spent on a start to come, and leave if the search has to end."""
        self.evaluations += 1
        self._check_stop()

    def _attempt(self, index: int, start: GraspStart) -> _Attempt:
        """Return an attempt that stands at a start."""
        program = GraspProgram(self.problem, start.palm_pose)
        z = program.pack(start.joint_angles, start.palm_pose, start.delta_sigma, start.contact_forces)
        program.check_own_terms(z)
        return _Attempt(index, program, z, start.prepared)

    def _try_start(self, index: int, start: GraspStart) -> None:
        """Solve from one start and keep the result if it is the best so far."""
        attempt = self._attempt(index, start)
        self.tried += 1
        try:
            attempt = self._solve(attempt)
        except _Stop:
            self.stopped = True
        except (ValueError, FloatingPointError, np.linalg.LinAlgError) as error:
            # Far from any grasp G may lose rank and forces overflow: such a start has failed, not the search.
            attempt.message = str(error)
        self.evaluations += attempt.program.evaluations
        self._keep(attempt)

    def best(self) -> Grasp:
        """Return the best grasp with the report of the whole search."""
        chosen = (self.found.first_closing() if self.closing else None) or self.found.first()
        if chosen is None:
            assert self._nearest is not None
            chosen = self._nearest[1]
        return self._reported(chosen)

    def _reported(self, grasp: Grasp) -> Grasp:
        """Return a grasp with the report of the search so far."""
        assert grasp.search is not None
        report = replace(
            grasp.search,
            evaluations=self.evaluations,
            starts_tried=self.tried,
            starts_feasible=self.found.count,
            time_s=time.perf_counter() - self.began,
            cancelled=self.cancelled,
        )
        return replace(grasp, search=report)

    def _solve(self, attempt: _Attempt) -> _Attempt:
        """Run the phases from one start."""
        phase_one = self.options.phase_one
        clearance = self.problem.clearance.needs_geometry
        if phase_one is None:
            phase_one = clearance or self.problem.n_synergies <= FEW_SYNERGIES
        springs = self.problem.parameters.force_law == "springs"
        objective_scale = attempt.program.objective_scale(attempt.z)
        if phase_one:
            if attempt.prepared and springs:
                self._least_squares(attempt, settle)
            elif clearance or not attempt.prepared:
                self._least_squares(attempt, reach_feasibility)
            good_enough = LEAST_SQUARES_GOOD_ENOUGH
            # SQP helps where clearances are still violated, and from prepared starts; elsewhere it is in vain.
            if attempt.program.merit(attempt.z) > good_enough if clearance or springs else attempt.prepared:
                self._run(attempt, "one", 1.0)
                good_enough = PHASE_ONE_GOOD_ENOUGH
            if attempt.program.merit(attempt.z) > good_enough:
                return attempt
            objective_scale = attempt.program.objective_scale(attempt.z)
        self._run(attempt, "two", objective_scale)
        if attempt.program.merit(attempt.z) < WORTH_POLISHING and not self._grasp(attempt).feasible:
            self._least_squares(attempt, polish)
        return attempt

    def _least_squares(self, attempt: _Attempt, solve: Callable[..., Array]) -> None:
        """Move the attempt to the result of a least-squares solve of the violations."""
        before = attempt.program.evaluations
        self._check_stop()
        attempt.z = solve(attempt.program, attempt.z, self._check_stop)
        attempt.iterations["one"] += attempt.program.evaluations - before
        attempt.history.append(self._record(attempt, "one"))
        if self.callback is not None:
            self.callback(attempt.history[-1])

    def _run(self, attempt: _Attempt, phase: Phase, objective_scale: float) -> None:
        """Run one phase and move the attempt to its result."""
        program = attempt.program

        def after_iteration(z: Array) -> None:
            attempt.z = np.array(z)
            attempt.iterations[phase] += 1
            attempt.history.append(self._record(attempt, phase))
            if self.callback is not None:
                self.callback(attempt.history[-1])
            self._check_stop()

        self._check_stop()
        solution = solve_nlp(
            program.build(phase, objective_scale),
            attempt.z,
            max_iterations=self.options.max_iterations,
            tolerance=self.options.tolerance,
            callback=after_iteration,
        )
        attempt.message = solution.message
        # Cut off at the iteration limit, SLSQP may hand back a trial point of its line search.
        better = solution.converged or program.merit(solution.z) <= program.merit(attempt.z)
        if better and not np.array_equal(solution.z, attempt.z):
            after_iteration(solution.z)

    def _check_stop(self) -> None:
        """Leave the solver if cancelled or out of time."""
        if self.cancel is not None and self.cancel():
            self.cancelled = True
            raise _Stop
        limit = self.options.time_limit_s
        if limit is not None and time.perf_counter() - self.began > limit:
            raise _Stop

    def _record(self, attempt: _Attempt, phase: Phase) -> IterationRecord:
        """Return the record of the iteration that ended at the attempt's point."""
        program = attempt.program
        state = program.state(attempt.z)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = state.geometry.rotation, state.geometry.translation
        return IterationRecord(
            start=attempt.index,
            phase=phase,
            iteration=attempt.iterations[phase],
            objective=program.objective.value(self.problem, state),
            force_norm=state.force_norm,
            task_index=state.task_index,
            violations=program.violations(attempt.z),
            joint_angles=np.array(state.x[program.evaluator.layout.joints]),
            palm_pose=pose,
        )

    def _grasp(self, attempt: _Attempt) -> Grasp:
        """Return the grasp an attempt stands at."""
        return attempt.program.grasp(
            attempt.z,
            SearchReport(
                seed=self.seed,
                iterations=attempt.iterations["two"],
                phase_one_iterations=attempt.iterations["one"],
                message=attempt.message,
                history=tuple(attempt.history),
                options=self.options,
            ),
        )

    def _keep(self, attempt: _Attempt) -> None:
        """Turn an attempt into a grasp and keep it if it is better than the best so far."""
        if not np.isfinite(attempt.z).all():
            return
        grasp = self._grasp(attempt)
        if grasp.is_feasible(FEASIBILITY_TOLERANCE):
            self.found.keep(grasp)
        else:
            merit = attempt.program.merit(attempt.z)
            if self._nearest is None or merit < self._nearest[0]:
                self._nearest = merit, grasp
        if self.result_callback is not None:
            self.result_callback(self._reported(grasp))
