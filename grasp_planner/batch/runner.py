"""Running a batch: cases to workers, rows to disk, until every case has exactly one row."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..exceptions import InvalidValueError
from .case import GraspCase
from .errors import ResultsError
from .expand import CaseTable, cases_hash
from .interrupts import StopOnSignal
from .pool import CasePool, LocalPool, Outcome
from .process import Case, Job
from .progress import BatchProgress, RateMeter
from .rows import Row, add_failure, case_row
from .spec import BatchSpec
from .store import ResultStore, run_info
from .worker import STANDARD_PLANNER, find_planner

TICK_S = 0.2
"""Longest time without a look at signals and progress [s]."""
MAX_ATTEMPTS = 2
"""How often a case is started if its worker dies."""


@dataclass(frozen=True)
class BatchSummary:
    """What a run came to.

    Attributes:
        folder: Folder of the run.
        total: Cases.
        done: Cases that have a row.
        resumed: How many of them were there before.
        feasible: Rows with a feasible grasp.
        interrupted: Whether it was stopped before the end.
        elapsed_s: Time it took [s].
    """

    folder: Path
    total: int
    done: int
    resumed: int
    feasible: int
    interrupted: bool
    elapsed_s: float


def run_batch(
    cases: BatchSpec | Sequence[GraspCase],
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    planner: str = STANDARD_PLANNER,
    spec_text: str = "",
    on_progress: Callable[[BatchProgress], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> BatchSummary:
    """Plan every case that has no row yet; run again to go on after a stop of any kind.

    The first Ctrl-C (or SIGTERM) stops within a second with all finished rows on disk, the second at once.

    Args:
        cases: A specification, or the cases themselves.
        folder: Folder of the run.
        workers: Worker processes on this machine; as many as there are cores if left out.
        scheduler: Address of a Dask scheduler whose workers are to be used instead.
        planner: What plans, as ``module:function`` called like :func:`grasp_planner.plan_grasp`.
        spec_text: Text of the specification, kept with the run.
        on_progress: Called several times a second.
        cancel: Polled several times a second; True stops as Ctrl-C does.

    Returns:
        What the run came to.

    Raises:
        SpecError: If a case makes no problem.
        ResultsError: If the folder can't be written or holds another run.
        SchedulerError: If the scheduler can't be reached or is lost.
    """
    table = CaseTable(cases) if isinstance(cases, BatchSpec) else cases
    _check(table, workers, planner)
    info = run_info(cases_hash(table, planner), len(table), planner, spec_text)
    with StopOnSignal() as stop, ResultStore(Path(folder), info) as store:
        return _PlanningLoop(table, store, on_progress, lambda: stop.stopped or bool(cancel and cancel())).run(
            lambda: _pool(store, workers, scheduler)
        )


def _check(table: Sequence[GraspCase], workers: int | None, planner: str) -> None:
    """Check the arguments of a run, and the cases of a specification."""
    if not len(table):
        raise InvalidValueError("cases", 0, "at least one case")
    if workers is not None and workers < 1:
        raise InvalidValueError("workers", workers, "a whole number >= 1")
    find_planner(planner)
    if isinstance(table, CaseTable):
        table.check()


def _pool(store: ResultStore, workers: int | None, scheduler: str | None) -> CasePool:
    """Return the workers of a run."""
    info = store.info
    if scheduler is not None:
        from .dask_pool import DaskPool

        return DaskPool(scheduler, info.planner, info.spec_hash)
    return LocalPool(workers or os.cpu_count() or 1, info.planner, info.spec_hash, store.log)


class BatchLoop(ABC):
    """One call of :func:`run_batch`, or of another function that works off cases."""

    def __init__(
        self,
        cases: Sequence[Case],
        store: ResultStore,
        on_progress: Callable[[BatchProgress], None] | None,
        stopped: Callable[[], bool],
    ) -> None:
        self.cases, self.store, self.on_progress, self.stopped = cases, store, on_progress, stopped
        self.resumed = store.finished
        self.meter = RateMeter()
        self._next = 0
        self._again: deque[Job] = deque()
        self._running = 0

    def run(self, make_pool: Callable[[], CasePool]) -> BatchSummary:
        """Run until every case has a row, or it is stopped."""
        if self.store.finished < len(self.cases):
            pool = make_pool()
            try:
                self._loop(pool)
            finally:
                pool.close()
        state = self._report()
        interrupted = state.done < state.total
        return BatchSummary(
            self.store.folder, state.total, state.done, state.resumed, state.feasible, interrupted, state.elapsed_s
        )

    def _loop(self, pool: CasePool) -> None:
        """Hand out cases and take rows."""
        while not self.stopped():
            while pool.free_slots() and (job := self._next_job()) is not None:
                pool.submit(job)
                self._running += 1
            outcomes = pool.wait(TICK_S)
            self._running -= len(outcomes)
            self.store.append([values for values in map(self._settle, outcomes) if values is not None])
            self._report()
            if not self._running and self._peek() is None:
                return

    def _peek(self) -> int | None:
        """Return the next case that has no row and is not being planned."""
        if self._again:
            return self._again[0].row
        self._next = self.store.done.find(0, self._next)
        if self._next < 0:
            self._next = len(self.cases)
        return self._next if self._next < len(self.cases) else None

    def _next_job(self) -> Job | None:
        """Take the next case."""
        row = self._peek()
        if row is None:
            return None
        if self._again:
            return self._again.popleft()
        self._next += 1
        return Job(row, self.cases[row])

    def _settle(self, outcome: Outcome) -> Row | None:
        """Return the row of a case that has ended; None if it is tried again."""
        job = outcome.job
        if outcome.kind == "done" and outcome.values is not None:
            values = outcome.values
            if values.get("row") != job.row:
                raise ResultsError(self.store.folder, f"a worker answered case {values.get('row')} for {job.row}")
            values["attempts"] = job.attempt
            return values
        if outcome.kind == "died" and job.attempt < MAX_ATTEMPTS:
            self._again.append(Job(job.row, job.case, job.attempt + 1))
            return None
        if outcome.kind == "timeout":
            return self._failure(job, "timeout", "time limit", outcome.detail)
        detail = f"its worker died {job.attempt} times ({outcome.detail})"
        return self._failure(job, "crashed", "worker died", detail)

    @abstractmethod
    def _failure(self, job: Job, status: str, reason: str, message: str) -> Row:
        """Return the row of a case that gave no answer."""

    def _report(self) -> BatchProgress:
        """Report how far it is."""
        store = self.store
        state = self.meter.progress(len(self.cases), store.finished, self.resumed, store.feasible)
        if self.on_progress is not None:
            self.on_progress(state)
        return state


class _PlanningLoop(BatchLoop):
    """Works off grasps to be planned."""

    def _failure(self, job: Job, status: str, reason: str, message: str) -> Row:
        """Return the row of a case that gave no grasp."""
        assert isinstance(job.case, GraspCase)
        values = case_row(job.row, job.case, self.store.info.spec_hash)
        values["attempts"] = job.attempt
        add_failure(values, status, reason, message)
        return values
