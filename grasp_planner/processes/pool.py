"""Workers on this machine: jobs in, outcomes out; hanging workers are killed, dead ones replaced."""

from __future__ import annotations

import time
from collections.abc import Sequence
from multiprocessing.connection import wait
from typing import IO, Protocol

from .errors import WorkerStartError
from .jobs import Job, JobFunction, JobOutcome
from .worker_process import WorkerProcess

MEMORY_TICK_S = 0.1
"""How often the memory of workers is looked at [s]; a job can go beyond its limit by what it takes in this time."""
MAX_FAILED_STARTS = 6
"""Workers that may end before they are ready, one after the other, until the pool gives up."""


class JobPool(Protocol):
    """Anything that can run jobs."""

    def free_slots(self) -> int:
        """Return how many more jobs it takes now."""
        ...

    def submit(self, job: Job) -> None:
        """Take a job."""
        ...

    def wait(self, timeout: float) -> Sequence[JobOutcome]:
        """Return what has ended, after at most a time [s]."""
        ...

    def close(self) -> None:
        """Stop everything at once."""
        ...


class LocalPool:
    """Worker processes on this machine.

    Args:
        workers: How many.
        function: What answers jobs.
        log: File for what workers write to standard error, or :data:`~.worker_process.STANDARD_ERROR`; None discards
            it.
    """

    def __init__(self, workers: int, function: JobFunction, log: IO[bytes] | int | None = None) -> None:
        self._make = lambda: WorkerProcess(function, log)
        self._log = getattr(log, "name", None)
        self._failed_starts = 0
        self._lost: list[JobOutcome] = []
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
        """Return how many more jobs it takes now."""
        return sum(worker.free for worker in self._workers)

    def submit(self, job: Job) -> None:
        """Give a job to a free worker."""
        worker = next(worker for worker in self._workers if worker.free)
        if not worker.start(job):
            self._lost.append(JobOutcome(job, "died", detail=self._replace(worker)))

    def wait(self, timeout: float) -> Sequence[JobOutcome]:
        """Return what has ended, after at most a time [s].

        Raises:
            WorkerStartError: If workers do not start.
        """
        outcomes, self._lost = self._lost, []
        until = time.monotonic() + timeout
        while not outcomes:
            busy = [worker for worker in self._workers if not worker.free]
            left = min([until - time.monotonic(), *(worker.seconds_left() for worker in busy)])
            limited = [worker for worker in busy if worker.job and worker.job.memory_limit_mb is not None]
            left = min(left, MEMORY_TICK_S) if limited else left
            ready = wait([worker.connection for worker in self._workers], max(0.0, left))
            for worker in [worker for worker in self._workers if worker.connection in ready]:
                outcomes += self._receive(worker)
            for worker in [worker for worker in self._workers if worker.overdue()]:
                outcomes += self._stop_overdue(worker)
            for worker in limited:
                outcomes += self._stop_too_large(worker)
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

    def _receive(self, worker: WorkerProcess) -> list[JobOutcome]:
        """Take the message of a worker, or its end."""
        job = worker.job
        try:
            message = worker.receive()
        except EOFError:
            return self._dead(worker)
        if message.kind == "ready":
            self._failed_starts = 0
        if job is None or message.kind in ("ready", "report"):
            return []
        if message.kind == "failed":
            return [JobOutcome(job, "failed", detail=message.content)]
        return [JobOutcome(job, "done", message.content)]

    def _dead(self, worker: WorkerProcess) -> list[JobOutcome]:
        """Replace a worker that ended by itself."""
        job, ready = worker.job, worker.ready
        detail = self._replace(worker, grace_s=2.0)
        if not ready:
            self._failed_starts += 1
            if self._failed_starts >= MAX_FAILED_STARTS:
                raise WorkerStartError(detail, self._log)
        return [] if job is None else [JobOutcome(job, "died", detail=detail)]

    def _stop_overdue(self, worker: WorkerProcess) -> list[JobOutcome]:
        """Kill a worker that takes too long; an answer that arrived in the meantime still counts."""
        if worker.connection.poll():
            return self._receive(worker)
        job = worker.job
        if job is None:
            return self._dead(worker)
        self._replace(worker)
        return [JobOutcome(job, "timeout", detail=f"stopped at its limit of {job.time_limit_s:g} s")]

    def _stop_too_large(self, worker: WorkerProcess) -> list[JobOutcome]:
        """Kill a worker that holds more memory than its job may; nothing if it does not."""
        job = worker.job
        if job is None or job.memory_limit_mb is None or worker not in self._workers:
            return []
        used = worker.memory_mb()
        if used <= job.memory_limit_mb:
            return []
        self._replace(worker)
        detail = f"stopped at its limit of {job.memory_limit_mb:g} MB (its worker held {used:.0f} MB)"
        return [JobOutcome(job, "memory", detail=detail)]

    def _replace(self, worker: WorkerProcess, grace_s: float = 0.0) -> str:
        """Kill a worker, start another in its place, and return how the first one ended."""
        detail = worker.kill(grace_s)
        self._workers[self._workers.index(worker)] = self._make()
        return detail
