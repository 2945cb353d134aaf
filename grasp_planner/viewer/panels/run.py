"""The tab of a batch run: filter, previous and next, the numbers of a row and its neighbours."""

from __future__ import annotations

import html
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import viser

from ...values import number_text
from .. import text
from .widgets import set_value

if TYPE_CHECKING:
    from ...batch import RunRows

FONT = "font:12px/1.4 system-ui,sans-serif;margin:2px 12px"
LONGEST = 300
"""Most letters of a text that is shown."""
WRAP = ("white-space:nowrap", *5 * ("overflow-wrap:anywhere",))
"""How the cells of a table wrap, by column."""
NEIGHBOURS = 4
"""Rows listed before and after the current one."""
ANY = "all"
LABELS = {
    "object_kind": "shape",
    "n_synergies": "n_s",
    "force_weight": "w_F",
    "task_weight": "w_C",
    "time_limit_s": "time limit [s]",
}
"""Columns that are called otherwise on the page."""
FIGURES = (
    ("reason", "reason", ""),
    ("objective", "objective", ""),
    ("force_norm", "F", " N"),
    ("force_norm_floor", "floor", " N"),
    ("task_index", "C", ""),
    ("alignment_angle_deg", "angle", "°"),
    ("starts_feasible", "feasible starts", ""),
    ("starts_tried", "starts tried", ""),
    ("iterations", "iterations", ""),
    ("time_s", "planning time", " s"),
)
"""Columns of a row, what they are called, and their unit."""


class RunPanel:
    """Widgets to go through the rows of a run.

    Attributes:
        step: First, previous, next, last.
        number: Number of the row.
        filters: A dropdown for every column that varies.
        order: What the rows are sorted by.
        reload: Reads the rows again.
    """

    def __init__(self, gui: viser.GuiApi, rows: RunRows) -> None:
        self._gui = gui
        self._chosen: Callable[[], None] = lambda: None
        self._title = gui.add_html("")
        self.step = gui.add_button_group("Show", ("first", "previous", "next", "last"))
        self.number = gui.add_number("Row", rows.row, min=0, max=max(rows.cases - 1, 0), step=1)
        self._values = gui.add_html("")
        self._folder = gui.add_folder("Filter")
        self.filters: dict[str, viser.GuiDropdownHandle[str]] = {}
        with self._folder:
            self.order = gui.add_dropdown("Sort by", rows.orders)
        self._add_filters(rows)
        self.order.on_update(lambda _: self._chosen())
        with gui.add_folder("Rows around it"):
            self._list = gui.add_html("")
        self.reload = gui.add_button("Read the run again", icon=viser.Icon.REFRESH, hint="For a run that still goes on")

    def on_choice(self, chosen: Callable[[], None]) -> None:
        """Have something called when a filter or the order has changed."""
        self._chosen = chosen

    @property
    def chosen(self) -> dict[str, str]:
        """What the filters say, by column."""
        return {column: widget.value for column, widget in self.filters.items()}

    def show(self, rows: RunRows) -> None:
        """Show the current row; to be called by the worker only."""
        self._add_filters(rows)
        set_value(self.number, rows.row)
        place = rows.place
        where = f"{place + 1} of {len(rows.shown)} shown" if place is not None else "left out by the filter"
        facts = f"{rows.count} of {rows.cases} cases" + (f" where {rows.where}" if rows.where else "")
        self._title.content = (
            f"<div style='{FONT}'><b style='font-size:14px'>Row {rows.row}</b> · {where}<br>"
            f"{html.escape(str(rows.folder))}: {html.escape(facts)}</div>"
        )
        self._values.content = row_table(rows.values(rows.row), tuple(rows.choices))
        self._list.content = neighbour_table(rows)

    def _add_filters(self, rows: RunRows) -> None:
        """Have a dropdown for every column that varies."""
        for column, values in rows.choices.items():
            options = (ANY, *values)
            if column not in self.filters:
                with self._folder:
                    self.filters[column] = self._gui.add_dropdown(label_of(column), options)
                self.filters[column].on_update(lambda _: self._chosen())
            elif self.filters[column].options != options:
                kept = self.filters[column].value
                self.filters[column].options = options
                set_value(self.filters[column], kept if kept in options else ANY)


def label_of(column: str) -> str:
    """Return what a column is called on the page."""
    return LABELS.get(column, column.replace("_", " "))


def row_table(values: dict[str, Any], varying: tuple[str, ...]) -> str:
    """Return the numbers of a row (HTML).

    Args:
        values: All columns.
        varying: Columns of the cases that vary in the run.
    """
    columns = ("status", *(name for name in varying if name not in ("status", "reason")))
    lines = [(label_of(name), str(values[name])) for name in columns]
    if not values["feasible"]:
        lines.append(("message", str(values["message"])))
    for column, label, unit in FIGURES:
        value = values[column]
        if value is not None and value != "":
            lines.append((label, f"{number_text(value) if isinstance(value, float) else value}{unit}"))
    return _table([], lines)


def neighbour_table(rows: RunRows) -> str:
    """Return the rows before and after the current one (HTML)."""
    if not rows.shown:
        return f"<div style='{FONT}'>No row meets the filter.</div>"
    place = rows.place or 0
    lines = []
    for row in rows.shown[max(place - NEIGHBOURS, 0) : place + NEIGHBOURS + 1]:
        values = rows.values(row)
        figures = [values["force_norm"], values["alignment_angle_deg"]]
        force, angle = ("–" if value is None else text.fixed(value) for value in figures)
        mark = f"▶ {row}" if row == rows.row else str(row)
        verdict = "✔" if values["status"] == "feasible" else "✘"
        lines.append((mark, verdict, force, angle, str(values["n_synergies"]), str(values["task"])))
    return _table(["row", "", "F [N]", "angle [°]", "n_s", "task"], lines)


def _table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """Return a table; every text is escaped."""
    cell = "padding:2px 8px 2px 0;vertical-align:top"
    top = "".join(f"<th style='text-align:left;{cell}'>{html.escape(word)}</th>" for word in head)
    body = ""
    for line in lines:
        words = zip((html.escape(word[:LONGEST]) for word in line), WRAP, strict=False)
        body += "<tr>" + "".join(f"<td style='{cell};{wrap}'>{word}</td>" for word, wrap in words) + "</tr>"
    return f"<table style='{FONT};border-collapse:collapse'><tr>{top}</tr>{body}</table>"
