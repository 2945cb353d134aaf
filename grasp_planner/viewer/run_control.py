"""Going through a batch run on the page: by its buttons, its filters, and by links to a row."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ..exceptions import InvalidValueError
from .panels.run import RunPanel
from .session import Session

if TYPE_CHECKING:
    from ..batch import RunRows

Later = Callable[..., None]
HASH_DIGITS = 12
"""Digits of a run's hash that a link names at least."""


class RunControl:
    """Shows rows of a run; its methods are for the worker's thread, except :meth:`connect`."""

    def __init__(
        self,
        session: Session,
        rows: RunRows,
        panel: RunPanel,
        stop_animation: Callable[[], None],
    ) -> None:
        self._session, self.rows, self.panel = session, rows, panel
        self._stop_animation = stop_animation
        panel.show(rows)

    def connect(self, later: Later) -> None:
        """Connect the widgets, each request to be run by ``later``."""
        self.panel.step.on_click(lambda _: later(self.step_as_told))
        self.panel.number.on_update(lambda _: later(lambda: self.select(int(self.panel.number.value)), "row"))
        self.panel.on_choice(lambda: later(self.choose, "filter"))
        self.panel.reload.on_click(lambda _: later(self.reload))

    def step_as_told(self) -> None:
        """Go where the buttons say."""
        count = len(self.rows.shown)
        self.step({"first": -count, "previous": -1, "next": 1, "last": count}[str(self.panel.step.value)])

    def step(self, by: int) -> None:
        """Show the row some places further in what is shown."""
        self.rows.step(by)
        self.show()

    def select(self, row: int) -> None:
        """Show a row by its number."""
        if row != self.rows.row:
            try:
                self.rows.select(row)
            finally:
                self.panel.show(self.rows)
            self.show()

    def reload(self) -> None:
        """Read the run again."""
        self.rows.reload()
        self.panel.show(self.rows)

    def choose(self) -> None:
        """Filter and sort as the widgets say; if that leaves the current row out, show the first that is left."""
        from ..batch import RunFilter

        self.rows.choose(RunFilter(self.panel.chosen, self.panel.order.value))
        if self.rows.place is None and self.rows.shown:
            self.step(0)
        else:
            self.panel.show(self.rows)

    def show(self) -> None:
        """Show the current row."""
        self._stop_animation()
        try:
            grasp, note = self.rows.grasp()
            self._session.forget_results()
            self._session.seed = None
            self._session.show(grasp, note)
        finally:
            self.panel.show(self.rows)

    def open_link(self, query: dict[str, str]) -> None:
        """Show the row that the address of the page asks for.

        Raises:
            InvalidValueError: If it names another run or no row of this one.
        """
        run, row = query.get("run", ""), query["row"]
        if run and not (len(run) >= HASH_DIGITS and self.rows.spec_hash.startswith(run)):
            raise InvalidValueError("the link", "a row of another run", f"a row of {self.rows.folder}, which is open")
        if not (row.isascii() and row.isdigit() and len(row) < 12):
            raise InvalidValueError("row", row[:20], f"a whole number from 0 to {self.rows.cases - 1}")
        self.rows.select(int(row))
        self.show()
