"""Undo and redo: what was shown before each change, and after it. No display code here."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Generic, TypeVar

MOST = 50
"""Changes that can be undone."""
APART_S = 0.8
"""Changes of one kind that follow each other faster are one, such as those of a slider that is dragged [s]."""

State = TypeVar("State")


class History(Generic[State]):
    """Two stacks of states, which have to be values that never change."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Start with nothing to undo.

        Args:
            clock: Gives the time [s].
        """
        self._clock = clock
        self._before: list[State] = []
        self._after: list[State] = []
        self._last: tuple[str, float] = ("", -APART_S)

    def note(self, state: State, kind: str) -> None:
        """Keep what was there before a change.

        Args:
            state: What was there.
            kind: What is changed.
        """
        kind_before, then = self._last
        self._last = kind, self._clock()
        if self._before and not self._after and kind == kind_before and self._last[1] - then < APART_S:
            return
        self._before = [*self._before, state][-MOST:]
        self._after = []

    def back(self, present: State) -> State | None:
        """Return what was there before the last change, None if there was none; ``present`` can be redone."""
        return self._step(self._before, self._after, present)

    def forth(self, present: State) -> State | None:
        """Return what was there before the last undo, None if there was none; ``present`` can be undone."""
        return self._step(self._after, self._before, present)

    def _step(self, source: list[State], target: list[State], present: State) -> State | None:
        """Take a state from one stack and put the present one on the other."""
        if not source:
            return None
        target.append(present)
        self._last = ("", -APART_S)
        return source.pop()
