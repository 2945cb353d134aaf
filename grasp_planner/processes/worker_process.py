"""One worker process, seen from its parent."""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import socket
import subprocess
import sys
import time
from multiprocessing.connection import Connection
from typing import IO, Any

from .jobs import Job, JobFunction, Message

START_LIMIT_S = 120.0
"""Time a worker may take to import everything [s]."""
STANDARD_ERROR = 2
"""As a log: what workers write to standard error goes where that of this process goes."""
_PROGRAM = "import sys; from grasp_planner.processes.serving import serve; serve(int(sys.argv[1]))"
ONE_THREAD = {
    name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
}
"""Workers compute on one thread each: as many as there are cores keep all of them busy, and sums keep their order."""


class WorkerProcess:
    """A worker process with at most one job.

    A pipe of its own and no shared locks: a worker killed at any instant disturbs no other.

    Args:
        function: What answers jobs.
        log: File for what it writes to standard error, or :data:`STANDARD_ERROR`; None discards it.
    """

    def __init__(self, function: JobFunction, log: IO[bytes] | int | None = None) -> None:
        ours, theirs = socket.socketpair()
        path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)  # noqa: PTH109
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-X", "faulthandler", "-c", _PROGRAM, str(theirs.fileno())],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=log if log is not None else subprocess.DEVNULL,
                pass_fds=(theirs.fileno(),),
                env={**os.environ, **ONE_THREAD, "PYTHONPATH": path},
                start_new_session=True,  # Ctrl-C in the terminal is for the parent
            )
        self.connection = Connection(ours.detach())
        self.job: Job | None = None
        self.ready = self._knows_main = False
        self._deadline = time.monotonic() + START_LIMIT_S
        with contextlib.suppress(OSError):  # it has ended already; receiving tells
            self._send("make", (function.maker, dict(function.settings)))

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def free(self) -> bool:
        """Whether it waits for a job."""
        return self.ready and self.job is None

    def overdue(self) -> bool:
        """Return whether its job, or its start, takes longer than allowed."""
        return (self.job is not None or not self.ready) and time.monotonic() > self._deadline

    def memory_mb(self) -> float:
        """Return the memory it holds now [MB]; 0 if it has ended."""
        import psutil  # only batches ask

        try:
            return float(psutil.Process(self.pid).memory_info().rss) / 1e6
        except psutil.Error:
            return 0.0

    def seconds_left(self) -> float:
        """Return the time until it is overdue [s]."""
        return max(0.0, self._deadline - time.monotonic())

    def start(self, job: Job) -> bool:
        """Give it a job, also before it is ready; return whether it took it."""
        pickled = pickle.dumps(job.content)
        try:
            if b"__main__" in pickled:
                self._send_main()
            self._send("job", (job.number, job.time_limit_s, pickled))
        except OSError:
            return False
        self.job = job
        self._deadline = math.inf if job.time_limit_s is None else time.monotonic() + job.time_limit_s
        return True

    def cancel(self) -> None:
        """Ask its job to stop; one that does not listen goes on."""
        if self.job is not None:
            with contextlib.suppress(OSError):
                self._send("cancel", self.job.number)

    def receive(self) -> Message:
        """Wait for what it sends next.

        Raises:
            EOFError: If it has ended.
        """
        try:
            message = Message(*pickle.loads(self.connection.recv_bytes()))
        except OSError:
            raise EOFError from None
        if message.kind == "ready":
            self.ready = True
        elif message.kind != "report":
            self.job = None
        return message

    def signal_kill(self) -> None:
        """Send the signal that ends it, without waiting for the end."""
        self._process.kill()

    def kill(self, grace_s: float = 0.0) -> str:
        """End it and return how it ended, in words.

        Args:
            grace_s: Time it gets to end by itself [s].
        """
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(grace_s)
        self._process.kill()
        code = self._process.wait()
        self.connection.close()
        if self._process.stdin is not None:
            self._process.stdin.close()
        return f"signal {-code}" if code < 0 else f"exit code {code}"

    def _send(self, kind: str, content: Any) -> None:
        """Send a message."""
        self.connection.send_bytes(pickle.dumps((kind, content)))

    def _send_main(self) -> None:
        """Tell it, once, which script defines the classes of this process's main module."""
        path = getattr(sys.modules["__main__"], "__file__", None)
        if path is not None and not self._knows_main:
            self._send("main", os.path.abspath(path))  # noqa: PTH100
        self._knows_main = True
