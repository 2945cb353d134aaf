"""The other side of the pipe: a worker process that answers one job after another.

Its standard input is never written: it ends when the parent does, however the parent ends, and with it the worker,
even in the middle of a job.
"""

from __future__ import annotations

import os
import pickle
import runpy
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from ..exceptions import GraspPlannerError
from .jobs import Message, find_function

GRACE_S = 10
"""Time after its limit at which a job that holds the interpreter is ended by the kernel [s]."""
Answer = Callable[[Any, "JobContext"], Any]
"""From the content of a job to its answer."""


class JobContext:
    """The way back to the parent while a job runs.

    Args:
        connection: The pipe.
        number: Number of the job.
    """

    def __init__(self, connection: Connection, number: int) -> None:
        self._connection, self._number = connection, number
        self._cancelled = False

    def report(self, content: Any) -> None:
        """Send something before the answer."""
        self.send(Message("report", self._number, content))

    def cancelled(self) -> bool:
        """Return whether the parent wants the job to stop."""
        while not self._cancelled and self._connection.poll():
            kind, content = pickle.loads(self._connection.recv_bytes())
            self._cancelled = kind == "cancel" and content == self._number
        return self._cancelled

    def send(self, message: Message) -> None:
        """Send a message."""
        self._connection.send_bytes(pickle.dumps((message.kind, message.number, message.content)))


def serve(handle: int) -> None:
    """Answer jobs until the parent closes the pipe or ends.

    Args:
        handle: Number of the socket to the parent.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    connection = Connection(handle)
    answer: Answer | None = None
    while True:
        try:
            kind, content = pickle.loads(connection.recv_bytes())
        except (EOFError, OSError):
            return
        try:
            if kind == "make":
                maker, settings = content
                answer = find_function("maker", maker)(**settings)
                JobContext(connection, -1).send(Message("ready"))
            elif kind == "main":
                _import_main(content)
            elif kind == "job" and answer is not None:
                number, limit, pickled = content
                _answer(JobContext(connection, number), answer, number, limit, pickled)
        except OSError:  # the parent is gone
            return


def _answer(context: JobContext, answer: Answer, number: int, limit: float | None, pickled: bytes) -> None:
    """Answer one job, or say what it raised."""
    # Without a handler the kernel ends the process, even if a library never gives the interpreter back.
    signal.alarm(0 if limit is None else int(limit) + 1 + GRACE_S)
    try:
        message = Message("done", number, answer(pickle.loads(pickled), context))
    except GraspPlannerError as error:
        message = Message("failed", number, str(error))
    except Exception as error:  # a job may fail in any way; the others go on
        traceback.print_exc()
        message = Message("failed", number, f"{type(error).__name__}: {error}")
    signal.alarm(0)
    context.send(message)


def _import_main(path: str) -> None:
    """Run the parent's script as a module, so that classes defined in it are known here."""
    sys.modules["__main__"].__dict__.update(runpy.run_path(path, run_name="__mp_main__"))


def _end_with_parent() -> None:
    """Wait until standard input ends, then end the process at once."""
    while os.read(0, 4096):
        pass
    os._exit(1)
