"""Workers on this machine: cases in, rows out; hanging workers are killed, dead ones replaced."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import IO, Literal, Protocol

from .errors import ResultsError
from .process import PLANNING_WORKER, Job, WorkerProcess
from .rows import Row

MAX_FAILED_STARTS = 6
"""Workers that may end before they are ready, one after the other, until the run gives up."""


@dataclass(frozen=True)
class Outcome:
    """What became of a case.

    Attributes:
        job: The case.
        kind: ``done`` with a row; ``timeout`` if it was stopped at its limit; ``died`` if its worker ended.
        values: The row, if done.
        detail: How it ended otherwise.
    """

    job: Job
    kind: Literal["done", "timeout", "died"]
    values: Row | None = None
    detail: str = ""


class CasePool(Protocol):
    """Anything that can run cases."""

    def free_slots(self) -> int:
        """Return how many more cases it takes now."""
        ...

    def submit(self, job: Job) -> None:
        """Take a case."""
        ...

    def wait(self, timeout: float) -> Sequence[Outcome]:
        """Return what has ended, after at most a time [s]."""
        ...

    def close(self) -> None:
        """Stop everything at once."""
        ...


class LocalPool:
    """Worker processes on this machine.

    Args:
        workers: How many.
        planner: What plans, as ``module:function``.
        spec_hash: Hash of all cases of the run.
        log: File for what workers write to standard error; None discards it.
        module: Module whose ``main`` answers cases.
    """

    def __init__(
        self,
        workers: int,
        planner: str,
        spec_hash: str,
        log: IO[bytes] | None = None,
        module: str = PLANNING_WORKER,
    ) -> None:
        self._make = lambda: WorkerProcess(planner, spec_hash, log, module)
        self._failed_starts = 0
        self._lost: list[Outcome] = []
        self._workers: list[WorkerProcess] = []
        try:
            for _ in range(workers):
                self._workers.append(self._make())
        except BaseException:
            self.close()
            raise

    @property
    def worker_ids(self) -> list[int]:
        """Process ids of the workers."""
        return [worker.pid for worker in self._workers]

    def free_slots(self) -> int:
        """Return how many more cases it takes now."""
        return sum(worker.free for worker in self._workers)

    def submit(self, job: Job) -> None:
        """Give a case to a free worker."""
        worker = next(worker for worker in self._workers if worker.free)
        if not worker.start(job):
            self._lost.append(Outcome(job, "died", detail=self._replace(worker)))

    def wait(self, timeout: float) -> Sequence[Outcome]:
        """Return what has ended, after at most a time [s].

        Raises:
            ResultsError: If workers do not start.
        """
        outcomes, self._lost = self._lost, []
        until = time.monotonic() + timeout
        while not outcomes:
            left = min([until - time.monotonic(), *(w.seconds_left() for w in self._workers if not w.free)])
            ready = wait([worker.connection for worker in self._workers], max(0.0, left))
            for worker in [worker for worker in self._workers if worker.connection in ready]:
                outcomes += self._receive(worker)
            for worker in [worker for worker in self._workers if worker.overdue()]:
                outcomes += self._stop_overdue(worker)
            if time.monotonic() >= until or self.free_slots():
                break
        return outcomes

    def close(self) -> None:
        """Kill all workers."""
        for worker in self._workers:
            worker.signal_kill()
        for worker in self._workers:
            worker.kill()
        self._workers = []

    def _receive(self, worker: WorkerProcess) -> list[Outcome]:
        """Take the message of a worker, or its end."""
        job = worker.job
        try:
            values = worker.receive()
        except EOFError:
            return self._dead(worker)
        if values is None or job is None:
            self._failed_starts = 0
            return []
        return [Outcome(job, "done", values)]

    def _dead(self, worker: WorkerProcess) -> list[Outcome]:
        """Replace a worker that ended by itself."""
        job, ready = worker.job, worker.ready
        detail = self._replace(worker, grace_s=0.5)
        if not ready:
            self._failed_starts += 1
            if self._failed_starts >= MAX_FAILED_STARTS:
                raise ResultsError("workers", f"do not start ({detail}); see workers.log in the folder of the run")
        return [] if job is None else [Outcome(job, "died", detail=detail)]

    def _stop_overdue(self, worker: WorkerProcess) -> list[Outcome]:
        """Kill a worker that takes too long; a row that arrived in the meantime still counts."""
        if worker.connection.poll():
            return self._receive(worker)
        job = worker.job
        if job is None:
            return self._dead(worker)
        self._replace(worker)
        return [Outcome(job, "timeout", detail=f"stopped at its limit of {job.case.time_limit_s:g} s")]

    def _replace(self, worker: WorkerProcess, grace_s: float = 0.0) -> str:
        """Kill a worker, start another in its place, and return how the first one ended."""
        detail = worker.kill(grace_s)
        self._workers[self._workers.index(worker)] = self._make()
        return detail
