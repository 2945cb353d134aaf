"""Planning in a process of its own: started once, progress streamed back, cancelled within a fraction of a second."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

from ..grasp.grasp import Grasp, IterationRecord, SearchReport
from ..hand.description import ContactDescription
from ..hand.skin import with_contact_sets
from ..planning.planner import plan_grasps
from ..planning.starts import GraspStart
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from ..processes import Job, JobContext, JobFunction, WorkerProcess
from ..processes.worker_process import STANDARD_ERROR
from ..spatial import Array, Pose

GRACE_S = 0.12
"""How long a cancelled search may take to stop by itself before its process is ended [s]."""
PROGRESS_PERIOD_S = 1 / 30
"""Least time between two progress reports [s]."""

NICE = 5
"""By how much the search steps back behind the page where both want one core."""

FUNCTION = JobFunction("grasp_planner.viewer.planning:searcher")
"""What plans in the worker process."""

SearchEnd = Literal["done", "cancelled", "failed"]
ContactSets = dict[str, dict[str, ContactDescription]]
Content = tuple[Array, Array, Array, Array | None, SearchReport, ContactSets]
"""What of a grasp is sent between the processes: q, palm pose, δσ, contact forces, how it was found, the contacts of
its hand, which the search may have moved."""


@dataclass(frozen=True)
class PlanRequest:
    """What to plan.

    Attributes:
        problem: The problem.
        seed: Seed of the random starts.
        options: How long and how hard to search.
        count: How many grasps that differ.
        start: First start, the planner's own if None: (q, pose as 4 x 4, δσ, forces in O).
    """

    problem: GraspProblem
    seed: int = 0
    options: PlannerOptions = field(default_factory=PlannerOptions)
    count: int = 1
    start: tuple[Array, Array, Array, Array | None] | None = None


@dataclass(frozen=True)
class PlanEvents:
    """What to call; from a thread of the planning, never from two at once.

    Attributes:
        progress: Iterations since the last call, the newest last.
        result: A grasp, one for each start that ended.
        best: The grasps that the whole search ended with, the best first; not if it was cancelled.
        end: How it ended, and a message.
    """

    progress: Callable[[list[IterationRecord]], None]
    result: Callable[[Grasp], None]
    best: Callable[[list[Grasp]], None]
    end: Callable[[SearchEnd, str], None]


class PlanningProcess:
    """A worker process for one search at a time."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._events: PlanEvents | None = None
        self._job = Job(0, None)
        self._closed = False
        self._spawn()

    @property
    def busy(self) -> bool:
        """Whether a search runs."""
        return self._events is not None

    @property
    def pid(self) -> int:
        """Process id of the worker."""
        return self._worker.pid

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
            self._job = Job(self._job.number + 1, request)
            self._events = events
            if not self._worker.start(self._job):
                self._spawn()
                self._worker.start(self._job)
            return True

    def cancel(self) -> None:
        """Stop the search; its end is reported within 0.2 s."""
        with self._lock:
            if not self.busy:
                return
            self._worker.cancel()
            threading.Thread(target=self._end_process_if_needed, args=(self._job,), daemon=True).start()

    def close(self) -> None:
        """End the process."""
        with self._lock:
            self._closed = True
            self._events = None
            self._worker.signal_kill()
        if threading.current_thread() is not self._listener:
            self._listener.join(timeout=5.0)

    def _spawn(self) -> None:
        """Start a fresh process and a thread that reads from it."""
        self._worker = WorkerProcess(FUNCTION, STANDARD_ERROR)
        self._listener = threading.Thread(target=self._listen, args=(self._worker,), daemon=True)
        self._listener.start()

    def _end_process_if_needed(self, job: Job) -> None:
        """End a process that does not stop by itself."""
        time.sleep(GRACE_S)
        with self._lock:
            if job is not self._job or not self.busy:
                return
            self._worker.signal_kill()
            self._finish("cancelled", "cancelled")
            if not self._closed:
                self._spawn()

    def _listen(self, worker: WorkerProcess) -> None:
        """Pass on what a process sends, until it is gone."""
        while True:
            try:
                message = worker.receive()
            except EOFError:
                worker.kill()
                with self._lock:
                    if worker is self._worker and self.busy:
                        self._finish("failed", "the planning process ended unexpectedly")
                return
            with self._lock:
                if worker is not self._worker or message.number != self._job.number or self._events is None:
                    continue
                if message.kind == "failed":
                    self._finish("failed", message.content)
                elif message.kind == "done":
                    self._finish(*message.content)
                elif message.content[0] == "progress":
                    self._events.progress(message.content[1])
                else:
                    kind, content = message.content
                    problem = self._job.content.problem
                    found = [_grasp(problem, each) for each in content]
                    if kind == "best":
                        self._events.best(found)
                    else:
                        self._events.result(found[0])

    def _finish(self, outcome: SearchEnd, message: str) -> None:
        """Report the end of the search."""
        events, self._events = self._events, None
        if events is not None:
            events.end(outcome, message)


def searcher() -> Callable[[PlanRequest, JobContext], tuple[SearchEnd, str]]:
    """Return what answers a request, in the worker process: reports on the way, in the end how it went."""
    os.nice(NICE)
    return _search


def _search(request: PlanRequest, context: JobContext) -> tuple[SearchEnd, str]:
    """Plan, and send the iterations and what every start ends at."""
    waiting: list[IterationRecord] = []
    last_sent = 0.0

    def report(record: IterationRecord) -> None:
        nonlocal last_sent
        waiting.append(record)
        if time.perf_counter() - last_sent >= PROGRESS_PERIOD_S:
            context.report(("progress", waiting))
            waiting.clear()
            last_sent = time.perf_counter()

    def send(grasp: Grasp) -> None:
        # What a cancelled search was at is no result.
        if not context.cancelled():
            context.report(("result", [_content(grasp)]))

    found = plan_grasps(
        request.problem,
        request.count,
        seed=request.seed,
        options=request.options,
        start=_first_start(request),
        callback=report,
        cancel=context.cancelled,
        result_callback=send,
    )
    best = found[0]
    assert best.search is not None
    tried = f"{best.search.starts_tried} start{'s' if best.search.starts_tried != 1 else ''}"
    if context.cancelled():
        return "cancelled", f"cancelled after {tried}"
    context.report(("best", [_content(grasp) for grasp in found]))
    return "done", f"{best.search.starts_feasible} feasible of {tried} in {best.search.time_s:.1f} s"


def _first_start(request: PlanRequest) -> GraspStart | None:
    """Return the start given, if there is one."""
    if request.start is None:
        return None
    q, pose, delta_sigma, forces = request.start
    return GraspStart(q, Pose.of(pose), delta_sigma, forces)


def _content(grasp: Grasp) -> Content:
    """Return what of a grasp is sent: not its problem, which the other side has."""
    assert grasp.search is not None
    search = replace(grasp.search, history=())
    placed = grasp.joint_angles, grasp.palm_pose.homogeneous, grasp.delta_sigma, grasp.contact_forces
    return *placed, search, grasp.problem.hand.description.contact_sets


def _grasp(problem: GraspProblem, content: Content) -> Grasp:
    """Return the grasp that was sent."""
    q, pose, delta_sigma, forces, search, contact_sets = content
    if contact_sets != problem.hand.description.contact_sets:
        problem = replace(problem, hand=with_contact_sets(problem.hand, contact_sets))
    return Grasp(problem, q, Pose.of(pose), delta_sigma, forces, search)
