"""The worker: a process of its own that plans one case after another, as told through a pipe.

Started with the number FD of a socket, see :func:`main`. It reads cases as JSON from the socket FD and answers each
with its row. Its standard input is never written: it ends when the parent does, however the parent ends, and
with it the worker, even in the middle of a case.
"""

from __future__ import annotations

import importlib
import json
import os
import platform
import signal
import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime
from multiprocessing.connection import Connection
from typing import Any

from ..exceptions import GraspPlannerError, InvalidValueError
from ..grasp.grasp import Grasp
from ..hand.hand import Hand
from ..hand.loading import load_hand
from ..planning.planner import plan_grasp
from .case import GraspCase
from .rows import Row, add_failure, add_grasp, case_row

READY = b"ready"
"""First message of a worker, when everything is imported."""
STANDARD_PLANNER = "grasp_planner.planning.planner:plan_grasp"
GRACE_S = 10
"""Time after its limit at which a case that holds the interpreter is ended by the kernel [s]."""


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
    module, _, function = name.partition(":")
    if name == STANDARD_PLANNER:
        return plan_grasp
    try:
        found: Any = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError) as error:
        raise InvalidValueError("planner", name, f"module:function that can be imported ({error})") from None
    return found


def main(arguments: list[str]) -> None:
    """Plan cases until the parent closes the socket or ends.

    Args:
        arguments: The number of the socket.
    """
    runner: CaseRunner | None = None

    def plan(job: dict[str, Any]) -> Row:
        nonlocal runner
        runner = runner or CaseRunner(job["planner"])
        return runner.run(job["row"], GraspCase.model_validate(job["case"]), job["spec_hash"])

    serve(arguments, plan)


def serve(arguments: list[str], answer: Callable[[dict[str, Any]], Row]) -> None:
    """Answer cases until the parent closes the socket or ends.

    Args:
        arguments: The number of the socket.
        answer: From a job (``row``, ``case``, ``planner``, ``spec_hash``) to its row.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    connection = Connection(int(arguments[0]))
    connection.send_bytes(READY)
    while True:
        try:
            job = json.loads(connection.recv_bytes())
        except (EOFError, OSError):
            return
        # Without a handler the kernel ends the process, even if a library never gives the interpreter back.
        signal.alarm(int(job["case"]["time_limit_s"]) + 1 + GRACE_S)
        values = answer(job)
        signal.alarm(0)
        try:
            connection.send_bytes(json.dumps(values).encode())
        except OSError:
            return


def _end_with_parent() -> None:
    """Wait until standard input ends, then end the process at once."""
    while os.read(0, 4096):
        pass
    os._exit(1)
