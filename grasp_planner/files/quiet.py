"""Libraries that log what they also raise: their logs are closed for a while, so that one error is said once."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator


@contextlib.contextmanager
def quiet(*libraries: str) -> Iterator[None]:
    """Let libraries write nothing to their logs, tracebacks above all.

    Args:
        libraries: Names of their loggers; those below them are closed too.
    """
    below = tuple(f"{library}." for library in libraries)
    names = [*libraries, *(name for name in list(logging.root.manager.loggerDict) if name.startswith(below))]
    closed = [logger for logger in map(logging.getLogger, names) if not logger.disabled]
    for logger in closed:
        logger.disabled = True
    try:
        yield
    finally:
        for logger in closed:
            logger.disabled = False
