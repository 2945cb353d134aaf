"""Work that may take its process with it, done in a copy of the process: native readers crash on damaged files."""

from __future__ import annotations

import contextlib
import faulthandler
import os
import resource
import signal
import warnings
from collections.abc import Callable
from pathlib import Path

from ..files.writing import drop_output

LIMIT_BYTES = 1_500_000_000
"""Memory that the copy may take beyond what the process has [bytes]."""
LIMIT_S = 30
"""Time that the copy may take [s]."""
_NUMBER_BYTES = 20


def number_or_death(work: Callable[[], int]) -> int | None:
    """Return the number that a piece of work finds; None if it raises, dies, or takes too much memory or time.

    Args:
        work: What to do. It runs in a copy of this process, so nothing else of what it does remains.

    Returns:
        The number.
    """
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        # Python warns of copies of a process with threads: the copy calls one function of a library and ends.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        with contextlib.suppress(BaseException):
            _limit()
            os.write(writing, str(int(work())).encode())
        os._exit(0)
    os.close(writing)
    try:
        text = os.read(reading, _NUMBER_BYTES)
    finally:
        os.close(reading)
        os.waitpid(child, 0)
    return int(text) if text else None


def _limit() -> None:
    """Limit memory and time of this process, and keep what a dying library says from the terminal."""
    faulthandler.disable()
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(LIMIT_S)
    drop_output()
    with contextlib.suppress(OSError, ValueError):  # only Linux says what a process has
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        most = pages * os.sysconf("SC_PAGE_SIZE") + LIMIT_BYTES
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
