"""One worker process, seen from its parent."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import time
from multiprocessing.connection import Connection
from typing import IO, Any, Protocol

from .worker import READY

START_LIMIT_S = 120.0
"""Time a worker may take to import everything [s]."""
PLANNING_WORKER = "grasp_planner.batch.worker"
"""Module whose ``main`` plans cases."""
_PROGRAM = "import sys; from importlib import import_module; import_module(sys.argv[1]).main(sys.argv[2:])"
ONE_THREAD = {
    name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
}
"""Workers compute on one thread each: as many as there are cores keep all of them busy, and sums keep their order."""


class Case(Protocol):
    """Anything that can be sent to a worker: its values, and how long it may take [s]."""

    @property
    def time_limit_s(self) -> float:
        """Wall time after which it is stopped [s]."""
        ...

    def model_dump(self, *, mode: str) -> dict[str, Any]:
        """Return its values; ``mode`` is ``json``."""
        ...


class Job:
    """A case on its way.

    Attributes:
        row: Number of the case.
        case: The case.
        attempt: How often it was started, counting this time.
    """

    __slots__ = ("attempt", "case", "row")

    def __init__(self, row: int, case: Case, attempt: int = 1) -> None:
        self.row, self.case, self.attempt = row, case, attempt


class WorkerProcess:
    """A worker process with at most one case.

    A pipe of its own and no shared locks: a worker killed at any instant disturbs no other.

    Args:
        planner: What plans, as ``module:function``.
        spec_hash: Hash of all cases of the run.
        log: File for what workers write to standard error; None discards it.
        module: Module whose ``main`` answers cases.
    """

    def __init__(
        self, planner: str, spec_hash: str, log: IO[bytes] | None = None, module: str = PLANNING_WORKER
    ) -> None:
        self._planner, self._spec_hash = planner, spec_hash
        ours, theirs = socket.socketpair()
        path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)  # noqa: PTH109
        command = [sys.executable, "-X", "faulthandler", "-c", _PROGRAM, module, str(theirs.fileno())]
        with theirs:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=log if log is not None else subprocess.DEVNULL,
                pass_fds=(theirs.fileno(),),
                env={**os.environ, **ONE_THREAD, "PYTHONPATH": path},
                start_new_session=True,  # Ctrl-C in the terminal is for the parent
            )
        self.connection = Connection(ours.detach())
        self.job: Job | None = None
        self.ready = False
        self._deadline = time.monotonic() + START_LIMIT_S

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def free(self) -> bool:
        """Whether it waits for a case."""
        return self.ready and self.job is None

    def overdue(self) -> bool:
        """Return whether its case, or its start, takes longer than allowed."""
        return (self.job is not None or not self.ready) and time.monotonic() > self._deadline

    def seconds_left(self) -> float:
        """Return the time until it is overdue [s]."""
        return max(0.0, self._deadline - time.monotonic())

    def start(self, job: Job) -> bool:
        """Give it a case; return whether it took it."""
        message = {
            "row": job.row,
            "case": job.case.model_dump(mode="json"),
            "planner": self._planner,
            "spec_hash": self._spec_hash,
        }
        try:
            self.connection.send_bytes(json.dumps(message).encode())
        except OSError:
            return False
        self.job = job
        self._deadline = time.monotonic() + job.case.time_limit_s
        return True

    def receive(self) -> dict[str, Any] | None:
        """Return the row it sent, or None if it reported to be ready.

        Raises:
            EOFError: If it has ended.
        """
        try:
            message = self.connection.recv_bytes()
        except OSError:
            raise EOFError from None
        if message == READY:
            self.ready = True
            return None
        self.job = None
        row: dict[str, Any] = json.loads(message)
        return row

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
