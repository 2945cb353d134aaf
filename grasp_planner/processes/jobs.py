"""What goes to worker processes and what comes back."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from ..exceptions import InvalidValueError


@dataclass(frozen=True)
class JobFunction:
    """What answers jobs, by its name: every worker makes its own, once.

    Attributes:
        maker: ``module:function``, called as ``function(**settings)``; returns what is called with the content of a
            job and its :class:`~.serving.JobContext`, and returns the answer.
        settings: Arguments of the maker.
    """

    maker: str
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Job:
    """A job on its way.

    Attributes:
        number: Its number.
        content: What to do, as values that can be pickled.
        time_limit_s: Wall time after which its worker is killed [s]; None for no limit.
        attempt: How often it was started, counting this time.
        memory_limit_mb: Resident memory of its worker above which that is killed [MB]; None for no limit.
    """

    number: int
    content: Any
    time_limit_s: float | None = None
    attempt: int = 1
    memory_limit_mb: float | None = None


@dataclass(frozen=True)
class Message:
    """What a worker sends.

    Attributes:
        kind: ``ready`` once, when everything is imported; ``report`` while a job runs; at its end ``done``, or
            ``failed`` if it raised.
        number: Number of the job.
        content: The report, the answer, or what was raised in words.
    """

    kind: Literal["ready", "report", "done", "failed"]
    number: int = -1
    content: Any = None


@dataclass(frozen=True)
class JobOutcome:
    """What became of a job.

    Attributes:
        job: The job.
        kind: ``done`` with an answer; ``failed`` if it raised; ``timeout`` or ``memory`` if it was stopped at a limit;
            ``died`` if its worker ended.
        answer: The answer, if done.
        detail: How it ended otherwise, in words.
    """

    job: Job
    kind: Literal["done", "failed", "timeout", "memory", "died"]
    answer: Any = None
    detail: str = ""


def find_function(field: str, name: str) -> Callable[..., Any]:
    """Return a function by its name.

    Args:
        field: What it is for, as named in the error.
        name: ``module:function``.

    Raises:
        InvalidValueError: If there is none.
    """
    module, _, function = name.partition(":")
    try:
        found: Callable[..., Any] = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError) as error:
        raise InvalidValueError(field, name, f"module:function that can be imported ({error})") from None
    return found
