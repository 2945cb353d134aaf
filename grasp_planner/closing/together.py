"""Many closings of one problem at once: each is written as if it were alone, and all wait for their steps together."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from typing import Any, TypeVar

from .newton import Asked, RestEvaluator

T = TypeVar("T")
Work = Generator[Any, Any, T]
"""What yields an :class:`~grasp_planner.closing.newton.Asked` and is sent its Newton step, or yields other works and is
sent a list of what they return."""


def run_together(evaluator: RestEvaluator, works: Iterable[Work[T]]) -> list[T]:
    """Run works until all have ended; Newton steps that several of them wait for are evaluated at once.

    Args:
        evaluator: Evaluates the steps.
        works: The works, of the evaluator's problem.

    Returns:
        What the works return.
    """
    whole = _Group(None, list(works))
    ready: list[tuple[_Task, Any]] = [(task, None) for task in whole.tasks]
    waiting: list[tuple[_Task, Asked]] = []
    while ready or waiting:
        while ready:
            task, answer = ready.pop()
            try:
                wanted = task.work.send(answer)
            except StopIteration as ended:
                task.group.results[task.index] = ended.value
                task.group.missing -= 1
                if not task.group.missing and task.group.parent is not None:
                    ready.append((task.group.parent, task.group.results))
                continue
            if isinstance(wanted, Asked):
                waiting.append((task, wanted))
            else:
                ready += [(each, None) for each in _Group(task, wanted).tasks]
        if waiting:
            steps = evaluator.steps([asked for _, asked in waiting])
            ready = [(task, step) for (task, _), step in zip(waiting, steps, strict=True)]
            waiting = []
    return whole.results


class _Task:
    """A work and its place among those that were begun with it."""

    def __init__(self, work: Work[Any], group: _Group, index: int) -> None:
        self.work, self.group, self.index = work, group, index


class _Group:
    """Works that another one, the parent, waits for."""

    def __init__(self, parent: _Task | None, works: Sequence[Work[Any]]) -> None:
        self.parent, self.missing = parent, len(works)
        self.results: list[Any] = [None] * len(works)
        self.tasks = [_Task(work, self, index) for index, work in enumerate(works)]
