"""What plans cases in worker processes: from the values of a case to its row."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

from ..exceptions import GraspPlannerError
from ..grasp.grasp import Grasp
from ..hand.hand import Hand
from ..hand.loading import load_hand
from ..planning.planner import plan_grasp
from ..processes import JobContext, JobFunction, find_function
from .case import GraspCase
from .rows import Row, add_failure, add_grasp, case_row

STANDARD_PLANNER = "grasp_planner.planning.planner:plan_grasp"


class CaseRunner:
    """Plans cases; hands are loaded once.

    Args:
        planner: What plans, as ``module:function``; called like :func:`grasp_planner.plan_grasp`.
    """

    def __init__(self, planner: str = STANDARD_PLANNER) -> None:
        self.planner = find_planner(planner)
        self._hands: dict[str, Hand] = {}

    def run(self, row: int, case: GraspCase, spec_hash: str) -> Row:
        """Plan one case.

        Args:
            row: Number of the case.
            case: The case.
            spec_hash: Hash of all cases of the run.

        Returns:
            Its row, whatever happened short of the end of the process.
        """
        values = case_row(row, case, spec_hash)
        values["started_utc"] = datetime.now(UTC).isoformat(timespec="milliseconds")
        values["worker"] = f"{platform.node()}:{os.getpid()}"
        began, cpu = time.perf_counter(), time.process_time()
        try:
            if case.hand not in self._hands:
                self._hands[case.hand] = load_hand(case.hand)
            problem = case.problem(self._hands[case.hand])
            add_grasp(values, self.planner(problem, seed=case.seed, options=case.options()))
        except GraspPlannerError as error:
            add_failure(values, "error", type(error).__name__, str(error))
        except Exception as error:  # a case may fail in any way; the others go on
            add_failure(values, "error", type(error).__name__, f"{type(error).__name__}: {error}")
        values["time_cpu_s"] = time.process_time() - cpu
        values["time_total_s"] = time.perf_counter() - began
        return values


def find_planner(name: str) -> Callable[..., Grasp]:
    """Return a planner by its name.

    Args:
        name: ``module:function``.

    Raises:
        InvalidValueError: If there is none.
    """
    return plan_grasp if name == STANDARD_PLANNER else find_function("planner", name)


def planning_function(planner: str, spec_hash: str) -> JobFunction:
    """Return what plans cases in worker processes.

    Args:
        planner: What plans, as ``module:function``.
        spec_hash: Hash of all cases of the run.
    """
    return JobFunction(f"{__name__}:case_planner", {"planner": planner, "spec_hash": spec_hash})


def case_planner(planner: str, spec_hash: str) -> Callable[[dict[str, Any], JobContext], Row]:
    """Return what answers a job, in the worker process."""
    runner = CaseRunner(planner)
    return lambda job, _: runner.run(job["row"], GraspCase.model_validate(job["case"]), spec_hash)
