"""One thread that does all the work of the viewer: requests in order, the newest value wins, then one redraw."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

from ..exceptions import GraspPlannerError

MAX_RATE_HZ = 30.0
"""Most redraws per second."""
REST_S = 0.4
"""How long nothing has been asked for when what can wait is done [s]."""


@dataclass
class _Queue:
    """Requests that wait; a request with a key replaces an older one with the same key."""

    waiting: dict[Hashable, Callable[[], None]] = field(default_factory=dict)
    count: int = 0


class Worker:
    """Runs requests in one thread, so that Pinocchio data is never touched from two.

    Widget callbacks run in many threads at once; all they do is :meth:`submit`. After every batch of requests,
    and while an animation runs, ``redraw`` is called at most 30 times a second.

    Attributes:
        durations: Time from taking a batch until it was drawn, the last 200 of them [s].
        efforts: The same in processor time of the thread [s].
    """

    def __init__(
        self,
        redraw: Callable[[], bool | None],
        on_error: Callable[[str], None],
        at_rest: Callable[[], bool] | None = None,
    ) -> None:
        """Start the thread.

        Args:
            redraw: Called after every batch of requests; returns whether there was anything to draw.
            on_error: Called with what went wrong.
            at_rest: A piece of work that can wait, done while nothing is asked for until it returns False.
        """
        self._redraw, self._on_error, self._at_rest = redraw, on_error, at_rest
        self._left = False
        self._queue = _Queue()
        self._condition = threading.Condition()
        self._animation: Callable[[], bool] | None = None
        self._stopping = self._busy = False
        self.durations: list[float] = []
        self.efforts: list[float] = []
        self._thread = threading.Thread(target=self._run, name="viewer worker", daemon=True)
        self._thread.start()

    def submit(self, request: Callable[[], None], key: Hashable | None = None) -> None:
        """Queue a request.

        Args:
            request: What to do.
            key: Requests with the same key replace each other; None keeps them all.
        """
        with self._condition:
            self._queue.count += 1
            self._queue.waiting.pop(key, None)
            self._queue.waiting[self._queue.count if key is None else key] = request
            self._condition.notify_all()

    def animate(self, step: Callable[[], bool] | None) -> None:
        """Start an animation, or stop it with None; to be called in the worker's thread.

        Args:
            step: Called before every redraw until it returns False.
        """
        self._animation = step

    @property
    def is_current(self) -> bool:
        """Whether the caller runs in the worker's thread."""
        return threading.current_thread() is self._thread

    def drain(self, timeout_s: float = 10.0) -> bool:
        """Wait until nothing waits, runs or moves; return whether that happened in time."""
        with self._condition:
            return self._condition.wait_for(
                lambda: not (self._queue.waiting or self._busy or self._animation), timeout_s
            )

    def stop(self) -> None:
        """End the thread after what it is doing now."""
        with self._condition:
            self._stopping = True
            self._condition.notify_all()
        if not self.is_current:
            self._thread.join(timeout=5.0)

    def _run(self) -> None:
        """Take batches until stopped."""
        while True:
            with self._condition:
                asked = self._condition.wait_for(
                    lambda: bool(self._queue.waiting or self._animation or self._stopping),
                    REST_S if self._left else None,
                )
                if self._stopping:
                    return
                batch = list(self._queue.waiting.values())
                self._queue.waiting.clear()
                self._busy = True
            if not asked and self._at_rest is not None:
                self._left = bool(self._guarded(self._at_rest))
                self._finish()
                continue
            self._left = self._at_rest is not None
            began, effort = time.perf_counter(), time.thread_time()
            for request in batch:
                self._guarded(request)
            if self._animation is not None and not self._guarded(self._animation):
                self._animation = None
            drawn = self._guarded(self._redraw)
            spent = time.perf_counter() - began
            self.durations = [*self.durations[-199:], spent]
            self.efforts = [*self.efforts[-199:], time.thread_time() - effort]
            self._finish()
            if drawn:  # what draws nothing, such as a search that is not followed, holds up nobody
                time.sleep(max(0.0, 1.0 / MAX_RATE_HZ - spent))

    def _finish(self) -> None:
        """Let those who wait know that a batch is done."""
        with self._condition:
            self._busy = False
            self._condition.notify_all()

    def _guarded(self, work: Callable[[], bool | None]) -> bool | None:
        """Do a piece of work; report what goes wrong instead of ending the thread."""
        try:
            return work()
        except GraspPlannerError as error:
            self._on_error(str(error))
        except Exception as error:  # The page has to survive whatever happens behind it.
            self._on_error(f"{type(error).__name__}: {error}")
        return None
