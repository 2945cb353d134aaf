"""The workers of an existing Dask scheduler; each runs its cases in a worker process of its own.

The process is the same as on one machine (:class:`~grasp_planner.processes.WorkerProcess`), so a job that hangs or
crashes is stopped at its limit there and never takes the Dask worker with it. A Dask worker that is lost has its jobs
given to another one by Dask itself.
"""

from __future__ import annotations

import contextlib
import queue
import threading
import time
import uuid
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from typing import Any

from ..files.quiet import quiet
from ..processes import Job, JobFunction, JobOutcome, LocalPool
from ..processes.worker_process import START_LIMIT_S
from .errors import BatchDependencyError, SchedulerError

try:
    import distributed
except ImportError:
    raise BatchDependencyError("distributed") from None

CONNECT_LIMIT_S = 15.0
"""Time for the scheduler to answer [s]."""
CASES_PER_THREAD = 2
"""Cases sent ahead for every thread of the cluster, so that none waits for the network."""
LOST = (OSError, TimeoutError, RuntimeError, CancelledError)
"""What Dask raises, of many kinds, when its scheduler is gone."""
REFRESH_S = 2.0
"""How often the number of threads is looked up [s]."""


class JobSlots(distributed.WorkerPlugin):
    """Keeps the worker processes of one Dask worker, one for each of its threads.

    Args:
        function: What answers the jobs.
        spec_hash: Hash of all cases of the run.
    """

    def __init__(self, function: JobFunction, spec_hash: str) -> None:
        self.function, self.spec_hash = function, spec_hash
        self.name = f"grasp-planner-{spec_hash}"

    def setup(self, worker: Any) -> None:
        """Prepare, when the Dask worker gets the plugin."""
        self._idle: list[LocalPool] = []
        self._lock = threading.Lock()

    def teardown(self, worker: Any) -> None:
        """Kill the processes, when the Dask worker or the run ends."""
        with self._lock:
            for pool in self._idle:
                pool.close()
            self._idle.clear()

    def run(self, job: Job) -> tuple[str, Any, str]:
        """Answer one job in a process of its own.

        Args:
            job: The job.

        Returns:
            Kind, answer and detail of its :class:`~grasp_planner.processes.JobOutcome`.
        """
        with self._lock:
            pool = self._idle.pop() if self._idle else None
        pool = pool or LocalPool(1, self.function)
        try:
            deadline = time.monotonic() + START_LIMIT_S
            while not pool.free_slots() and time.monotonic() < deadline:
                pool.wait(1.0)
            pool.submit(job)
            while not (outcomes := pool.wait(1.0)):
                pass
        except BaseException:
            pool.close()
            raise
        with self._lock:
            self._idle.append(pool)
        return outcomes[0].kind, outcomes[0].answer, outcomes[0].detail


def _run_job(plugin: str, job: Job) -> tuple[str, Any, str]:
    """Answer a job on a Dask worker."""
    slots = distributed.get_worker().plugins[plugin]
    assert isinstance(slots, JobSlots)
    return slots.run(job)


class DaskPool:
    """The workers of an existing Dask scheduler.

    Args:
        address: Address of the scheduler, such as ``tcp://127.0.0.1:8786``.
        function: What answers the jobs; importable on every worker.
        spec_hash: Hash of all cases of the run.

    Raises:
        SchedulerError: If it does not answer.
    """

    def __init__(self, address: str, function: JobFunction, spec_hash: str) -> None:
        self.address = address
        self._quiet = contextlib.ExitStack()
        self._quiet.enter_context(quiet("distributed", "tornado", "asyncio"))
        try:
            self._client = distributed.Client(address, timeout=CONNECT_LIMIT_S, set_as_default=False)
            self._plugin = JobSlots(function, spec_hash)
            self._client.register_plugin(self._plugin)
        except (OSError, ValueError, TimeoutError) as error:
            self._quiet.close()
            raise SchedulerError(f"no Dask scheduler answers at {address}: {error}") from None
        self._ended: queue.SimpleQueue[tuple[Job, distributed.Future]] = queue.SimpleQueue()
        self._flying: dict[tuple[int, int], distributed.Future] = {}
        self._threads, self._looked = 0, 0.0

    def free_slots(self) -> int:
        """Return how many more cases it takes now; none while there are no workers."""
        if time.monotonic() - self._looked > REFRESH_S:
            with self._lost_is_one_error():
                self._threads, self._looked = sum(self._client.nthreads().values()), time.monotonic()
        return max(0, CASES_PER_THREAD * self._threads - len(self._flying))

    def submit(self, job: Job) -> None:
        """Send a case."""
        key = f"grasp-{self._plugin.spec_hash}-{job.number}-{job.attempt}-{uuid.uuid4().hex[:8]}"
        with self._lost_is_one_error():
            future = self._client.submit(_run_job, self._plugin.name, job, key=key, pure=False)
        self._flying[job.number, job.attempt] = future
        future.add_done_callback(lambda done: self._ended.put((job, done)))

    def wait(self, timeout: float) -> Sequence[JobOutcome]:
        """Return what has ended, after at most a time [s].

        Raises:
            SchedulerError: If the scheduler is lost.
        """
        outcomes: list[JobOutcome] = []
        try:
            outcomes.append(self._outcome(*self._ended.get(timeout=timeout)))
            while True:
                outcomes.append(self._outcome(*self._ended.get_nowait()))
        except queue.Empty:
            pass
        if not outcomes and self._client.status not in ("running", "connecting"):
            raise self._lost()
        return outcomes

    def close(self) -> None:
        """Cancel what is flying and end the worker processes."""
        with self._quiet:
            with contextlib.suppress(*LOST):
                if self._client.status == "running":
                    self._client.cancel(list(self._flying.values()), force=True)
                    self._client.unregister_worker_plugin(self._plugin.name)
            self._flying.clear()
            with contextlib.suppress(*LOST):
                self._client.close(timeout=1.0)

    def _lost(self) -> SchedulerError:
        """Return the error of a scheduler that is gone."""
        return SchedulerError(f"the Dask scheduler at {self.address} was lost; run again to go on")

    @contextlib.contextmanager
    def _lost_is_one_error(self) -> Iterator[None]:
        """Turn what Dask raises when its scheduler is gone into one error."""
        try:
            yield
        except LOST:
            raise self._lost() from None

    def _outcome(self, job: Job, future: distributed.Future) -> JobOutcome:
        """Return the outcome of a case."""
        self._flying.pop((job.number, job.attempt), None)
        if future.status == "finished":
            with self._lost_is_one_error():
                kind, answer, detail = future.result(timeout=10.0)
            return JobOutcome(job, kind, answer, detail)
        if future.status in ("cancelled", "lost"):
            raise SchedulerError(f"the Dask scheduler at {self.address} dropped case {job.number}; run again to go on")
        with self._lost_is_one_error():
            error = future.exception(timeout=10.0)
        if isinstance(error, distributed.KilledWorker):
            return JobOutcome(job, "died", detail=str(error).splitlines()[0])
        raise SchedulerError(f"the Dask workers can't run cases (is grasp_planner installed there?): {error}")
