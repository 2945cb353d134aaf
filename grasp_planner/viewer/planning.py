"""Planning in a process of its own: started once, progress streamed back, cancelled within a fraction of a second."""

from __future__ import annotations

import multiprocessing
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from typing import Any, Literal

from ..exceptions import GraspPlannerError
from ..grasp.grasp import Grasp, IterationRecord, SearchReport
from ..planning.options import PlannerOptions
from ..planning.planner import plan_grasp
from ..planning.starts import GraspStart
from ..problem.problem import GraspProblem
from ..spatial import Array, Pose

GRACE_S = 0.12
"""How long a cancelled search may take to stop by itself before its process is ended [s]."""
PROGRESS_PERIOD_S = 1 / 30
"""Least time between two progress reports [s]."""

Outcome = Literal["done", "cancelled", "failed"]


@dataclass(frozen=True)
class PlanRequest:
    """What to plan.

    Attributes:
        problem: The problem.
        seed: Seed of the random starts.
        options: How long and how hard to search.
        start: First start, the planner's own if None: (q, pose as 4 x 4, δσ).
    """

    problem: GraspProblem
    seed: int = 0
    options: PlannerOptions = field(default_factory=PlannerOptions)
    start: tuple[Array, Array, Array] | None = None


@dataclass(frozen=True)
class PlanEvents:
    """What to call; from a thread of the planning, never from two at once.

    Attributes:
        progress: Iterations since the last call, the newest last.
        result: A grasp, one for each start that ended.
        end: How it ended, and a message.
    """

    progress: Callable[[list[IterationRecord]], None]
    result: Callable[[Grasp], None]
    end: Callable[[Outcome, str], None]


class PlanningProcess:
    """A worker process for one search at a time."""

    def __init__(self) -> None:
        self._context = multiprocessing.get_context("spawn")
        self._lock = threading.RLock()
        self._job = 0
        self._events: PlanEvents | None = None
        self._request: PlanRequest | None = None
        self._closed = False
        self._spawn()

    @property
    def busy(self) -> bool:
        """Whether a search runs."""
        return self._events is not None

    def start(self, request: PlanRequest, events: PlanEvents) -> bool:
        """Start a search.

        Args:
            request: What to plan.
            events: What to call.

        Returns:
            False if one runs already; it goes on.
        """
        with self._lock:
            if self.busy or self._closed:
                return False
            if not self._process.is_alive():
                self._spawn()
            self._job += 1
            self._request, self._events = request, events
            self._cancelled.clear()
            try:
                self._connection.send((self._job, request))
            except OSError:
                self._spawn()
                self._connection.send((self._job, request))
            return True

    def cancel(self) -> None:
        """Stop the search; its end is reported within 0.2 s."""
        with self._lock:
            if not self.busy:
                return
            self._cancelled.set()
            threading.Thread(target=self._end_process_if_needed, args=(self._job,), daemon=True).start()

    def close(self) -> None:
        """End the process."""
        with self._lock:
            self._closed = True
            self._events = None
            self._process.kill()
        self._process.join(timeout=5.0)

    def _spawn(self) -> None:
        """Start a fresh process and a thread that reads from it."""
        self._connection, theirs = self._context.Pipe()
        self._cancelled = self._context.Event()
        self._process = self._context.Process(
            target=planning_main, args=(theirs, self._cancelled), name="grasp planning", daemon=True
        )
        self._process.start()
        theirs.close()
        threading.Thread(target=self._listen, args=(self._connection,), daemon=True).start()

    def _end_process_if_needed(self, job: int) -> None:
        """End a process that does not stop by itself."""
        time.sleep(GRACE_S)
        with self._lock:
            if job != self._job or not self.busy:
                return
            self._process.kill()
            self._finish("cancelled", "cancelled")
            if not self._closed:
                self._spawn()

    def _listen(self, connection: Connection) -> None:
        """Pass on what a process sends, until it is gone."""
        while True:
            try:
                job, kind, content = connection.recv()
            except (EOFError, OSError):
                with self._lock:
                    if connection is self._connection and self.busy:
                        self._finish("failed", "the planning process ended unexpectedly")
                return
            with self._lock:
                if connection is not self._connection or job != self._job or self._events is None:
                    continue
                if kind == "progress":
                    self._events.progress(content)
                elif kind == "result":
                    assert self._request is not None
                    self._events.result(_grasp(self._request.problem, content))
                else:
                    self._finish(kind, content)

    def _finish(self, outcome: Outcome, message: str) -> None:
        """Report the end of the search."""
        events, self._events = self._events, None
        if events is not None:
            events.end(outcome, message)


def planning_main(connection: Connection, cancelled: Any) -> None:
    """Serve searches, in the worker process, until the connection closes.

    Args:
        connection: Where requests come from and reports go to.
        cancelled: Event that stops the search.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            job, request = connection.recv()
        except (EOFError, OSError):
            return
        try:
            outcome, message = _search(connection, job, request, cancelled)
        except GraspPlannerError as error:
            outcome, message = "failed", str(error)
        except OSError:
            return
        except Exception as error:  # Reported on the page; the process stays up for the next search.
            outcome, message = "failed", f"{type(error).__name__}: {error}"
        connection.send((job, outcome, message))


def _search(connection: Connection, job: int, request: PlanRequest, cancelled: Any) -> tuple[Outcome, str]:
    """Plan, and send the iterations and what every start ends at."""
    waiting: list[IterationRecord] = []
    last_sent = 0.0

    def report(record: IterationRecord) -> None:
        nonlocal last_sent
        waiting.append(record)
        if time.perf_counter() - last_sent >= PROGRESS_PERIOD_S:
            connection.send((job, "progress", waiting))
            waiting.clear()
            last_sent = time.perf_counter()

    def send(grasp: Grasp) -> None:
        assert grasp.search is not None
        # What a cancelled search was at is no result.
        if not cancelled.is_set():
            search = replace(grasp.search, history=())
            connection.send(
                (job, "result", (grasp.joint_angles, grasp.palm_pose.homogeneous, grasp.delta_sigma, search))
            )

    best = plan_grasp(
        request.problem,
        seed=request.seed,
        options=request.options,
        start=_first_start(request),
        callback=report,
        cancel=cancelled.is_set,
        result_callback=send,
    )
    assert best.search is not None
    tried = f"{best.search.starts_tried} start{'s' if best.search.starts_tried != 1 else ''}"
    if cancelled.is_set():
        return "cancelled", f"cancelled after {tried}"
    return "done", f"{best.search.starts_feasible} feasible of {tried} in {best.search.time_s:.1f} s"


def _first_start(request: PlanRequest) -> GraspStart | None:
    """Return the start given, if there is one."""
    if request.start is None:
        return None
    q, pose, delta_sigma = request.start
    return GraspStart(q, Pose.of(pose), delta_sigma)


def _grasp(problem: GraspProblem, content: tuple[Array, Array, Array, SearchReport]) -> Grasp:
    """Return the grasp that was sent."""
    q, pose, delta_sigma, search = content
    return Grasp(problem, q, Pose.of(pose), delta_sigma, search)
