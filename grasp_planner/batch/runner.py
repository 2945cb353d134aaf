"""Running a batch: every case is planned and gets exactly one row."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from ..exceptions import InvalidValueError
from ..hand.hand import Hand
from ..processes import Job
from .case import GraspCase
from .expand import CaseTable, cases_hash
from .planning_job import STANDARD_PLANNER, find_planner, planning_function
from .progress import BatchProgress
from .rows import Row, add_failure, case_row
from .run_files import run_info
from .spec import BatchSpec
from .work import BatchSummary as BatchSummary
from .work import RowWork, work_off_rows


def run_batch(
    cases: BatchSpec | Sequence[GraspCase],
    folder: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    planner: str = STANDARD_PLANNER,
    spec_text: str = "",
    on_progress: Callable[[BatchProgress], None] | None = None,
    on_hand: Callable[[Hand], None] | None = None,
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
        on_hand: Called once with each hand of a specification before anything is planned.
        cancel: Polled several times a second; True stops as Ctrl-C does.

    Returns:
        What the run came to.

    Raises:
        SpecError: If a case makes no problem.
        ResultsError: If the folder can't be written or holds another run.
        SchedulerError: If the scheduler can't be reached or is lost.
    """
    table = CaseTable(cases) if isinstance(cases, BatchSpec) else cases
    if not len(table):
        raise InvalidValueError("cases", 0, "at least one case")
    find_planner(planner)
    if isinstance(table, CaseTable):
        table.check(on_hand)
    info = run_info(cases_hash(table, planner), len(table), planner, spec_text)

    def job(row: int) -> Job:
        case = table[row]
        content = {"row": row, "case": case.model_dump(mode="json")}
        return Job(row, content, case.time_limit_s, memory_limit_mb=case.memory_limit_mb)

    def failed(row: int, status: str, reason: str, message: str) -> Row:
        values = case_row(row, table[row], info.spec_hash)
        add_failure(values, status, reason, message)
        return values

    work = RowWork(info, planning_function(planner, info.spec_hash), job, failed)
    return work_off_rows(work, folder, workers=workers, scheduler=scheduler, on_progress=on_progress, cancel=cancel)
