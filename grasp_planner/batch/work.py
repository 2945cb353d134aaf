"""Working off rows: jobs to workers, rows to disk, until every row is there; stops and goes on."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from ..exceptions import InvalidValueError
from ..processes import Job, JobFunction, JobOutcome, JobPool, LocalPool, work_off
from .errors import ResultsError
from .interrupts import StopOnSignal
from .progress import BatchProgress, RateMeter
from .rows import Row
from .run_files import RunInfo
from .store import ResultStore


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


@dataclass(frozen=True)
class RowWork:
    """What makes the rows of a run, whatever they hold.

    Attributes:
        info: What the run is.
        function: What answers the jobs, each with its row.
        job: Job of a row, by number.
        failed: Row of a job that gave no answer, from its number, status (``error``, ``timeout``, ``memory``,
            ``crashed``), a short reason and what happened in words.
    """

    info: RunInfo
    function: JobFunction
    job: Callable[[int], Job]
    failed: Callable[[int, str, str, str], Row]


def work_off_rows(
    work: RowWork,
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    on_progress: Callable[[BatchProgress], None] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> BatchSummary:
    """Make every row that is not there yet; run again to go on after a stop of any kind.

    The first Ctrl-C (or SIGTERM) stops within a second with all finished rows on disk, the second at once.

    Args:
        work: What makes the rows.
        folder: Folder of the run.
        workers: Worker processes on this machine; as many as there are cores if left out.
        scheduler: Address of a Dask scheduler whose workers are to be used instead.
        on_progress: Called several times a second.
        cancel: Polled several times a second; True stops as Ctrl-C does.

    Returns:
        What the run came to.

    Raises:
        InvalidValueError: If there are no workers.
        ResultsError: If the folder can't be written or holds another run.
        SchedulerError: If the scheduler can't be reached or is lost.
        WorkerStartError: If workers do not start.
    """
    if workers is not None and workers < 1:
        raise InvalidValueError("workers", workers, "a whole number >= 1")
    with StopOnSignal() as stop, ResultStore(Path(folder), work.info) as store:
        resumed, meter = store.finished, RateMeter()

        def report() -> BatchProgress:
            state = meter.progress(work.info.cases, store.finished, resumed, store.feasible)
            if on_progress is not None:
                on_progress(state)
            return state

        if store.finished < work.info.cases:
            pool = _pool(work, store, workers, scheduler)
            ended = work_off(_jobs_left(work, store), pool, lambda: stop.stopped or bool(cancel and cancel()))
            with closing(ended):
                for outcomes in ended:
                    store.append([_row(work, outcome) for outcome in outcomes])
                    report()
        state = report()
        interrupted = state.done < state.total
        return BatchSummary(
            store.folder, state.total, state.done, resumed, state.feasible, interrupted, state.elapsed_s
        )


def _pool(work: RowWork, store: ResultStore, workers: int | None, scheduler: str | None) -> JobPool:
    """Return the workers of a run."""
    if scheduler is not None:
        from .dask_pool import DaskPool

        return DaskPool(scheduler, work.function, work.info.spec_hash)
    return LocalPool(workers or os.cpu_count() or 1, work.function, store.log)


def _jobs_left(work: RowWork, store: ResultStore) -> Iterator[Job]:
    """Yield the jobs of the rows that are not there yet."""
    row = -1
    while (row := store.done.find(0, row + 1)) >= 0:
        yield work.job(row)


def _row(work: RowWork, outcome: JobOutcome) -> Row:
    """Return the row of a job that has ended."""
    job = outcome.job
    if outcome.kind == "done":
        values: Row = outcome.answer
        if values.get("row") != job.number:
            raise ResultsError(work.info.planner, f"a worker answered row {values.get('row')} for {job.number}")
    elif outcome.kind == "failed":
        values = work.failed(job.number, "error", "error", outcome.detail)
    elif outcome.kind == "timeout":
        values = work.failed(job.number, "timeout", "time limit", outcome.detail)
    elif outcome.kind == "memory":
        values = work.failed(job.number, "memory", "memory limit", outcome.detail)
    else:
        detail = f"its worker died {job.attempt} times ({outcome.detail})"
        values = work.failed(job.number, "crashed", "worker died", detail)
    if "attempts" in work.info.columns:
        values["attempts"] = job.attempt
    return values
