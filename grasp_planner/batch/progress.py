"""How far a run is: done, rate, success share, time left."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass

RATE_WINDOW_S = 60.0
"""Time over which the rate is taken [s]."""


@dataclass(frozen=True)
class BatchProgress:
    """The state of a run.

    Attributes:
        total: Cases of the run.
        done: Cases that have a row.
        resumed: How many of them were there before.
        feasible: Rows with a feasible grasp.
        rate: Cases per second lately; None as long as nothing was done.
        seconds_left: Time left at this rate [s].
        elapsed_s: Time since the start [s].
    """

    total: int
    done: int
    resumed: int
    feasible: int
    rate: float | None
    seconds_left: float | None
    elapsed_s: float

    @property
    def success(self) -> float | None:
        """Share of feasible rows."""
        return self.feasible / self.done if self.done else None


class RateMeter:
    """Measures the rate of a run over a moving window."""

    def __init__(self) -> None:
        self.began = time.monotonic()
        self._marks: deque[tuple[float, int]] = deque([(self.began, 0)])

    def progress(self, total: int, done: int, resumed: int, feasible: int) -> BatchProgress:
        """Return the state of the run now."""
        now, here = time.monotonic(), done - resumed
        if here != self._marks[-1][1]:
            self._marks.append((now, here))
        while len(self._marks) > 2 and now - self._marks[1][0] > RATE_WINDOW_S:
            self._marks.popleft()
        since, before = self._marks[0]
        rate = (here - before) / (now - since) if here > before and now > since else None
        left = (total - done) / rate if rate else None
        return BatchProgress(total, done, resumed, feasible, rate, left, now - self.began)
