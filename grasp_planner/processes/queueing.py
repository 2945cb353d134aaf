"""Many jobs through a pool: each is tried again once if its worker dies."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from .errors import JobError
from .jobs import Job, JobFunction, JobOutcome
from .pool import JobPool, LocalPool
from .worker_process import STANDARD_ERROR

TICK_S = 0.2
"""Longest time without a look at what stops the work [s]."""
MAX_ATTEMPTS = 2
"""How often a job is started if its worker dies."""


def work_off(
    jobs: Iterable[Job], pool: JobPool, stopped: Callable[[], bool] = lambda: False
) -> Generator[Sequence[JobOutcome], None, None]:
    """Work off jobs until all have ended, or it is stopped; then the pool is closed.

    Args:
        jobs: The jobs; each is taken when a worker is free for it.
        pool: Who works.
        stopped: Polled several times a second.

    Yields:
        What has ended since the last time, in the order of the ends; several times a second, also if nothing has.
    """
    waiting = iter(jobs)
    again: deque[Job] = deque()
    running = 0
    try:
        following = next(waiting, None)
        while (running or again or following is not None) and not stopped():
            while pool.free_slots() and (again or following is not None):
                if again:
                    pool.submit(again.popleft())
                elif following is not None:
                    pool.submit(following)
                    following = next(waiting, None)
                running += 1
            ended = pool.wait(TICK_S)
            running -= len(ended)
            settled = []
            for outcome in ended:
                if outcome.kind == "died" and outcome.job.attempt < MAX_ATTEMPTS:
                    again.append(replace(outcome.job, attempt=outcome.job.attempt + 1))
                else:
                    settled.append(outcome)
            yield settled
    finally:
        pool.close()


def answers_in_order(function: JobFunction, contents: Sequence[Any], workers: int) -> Iterator[Any]:
    """Work off jobs in worker processes.

    Args:
        function: What answers them.
        contents: Their contents.
        workers: Worker processes.

    Yields:
        The answers, in the order of the jobs.

    Raises:
        JobError: If one gives no answer.
        WorkerStartError: If workers do not start.
    """
    if not contents:
        return
    pool = LocalPool(min(workers, len(contents)), function, STANDARD_ERROR)
    early: dict[int, Any] = {}
    due = 0
    for outcomes in work_off((Job(number, content) for number, content in enumerate(contents)), pool):
        for outcome in outcomes:
            if outcome.kind != "done":
                raise JobError(outcome.job.number, outcome.detail)
            early[outcome.job.number] = outcome.answer
        while due in early:
            yield early.pop(due)
            due += 1
