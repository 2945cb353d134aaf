"""Going through the rows of a run: filtered and sorted, one of them current. No display."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from ..exceptions import InvalidValueError
from ..grasp.grasp import Grasp
from ..hand.loading import load_hand
from ..planning.starts import standard_start
from .case import GraspCase
from .errors import ResultsError
from .results import find_rows, load_grasps, load_table
from .rows import RUN_COLUMNS
from .run_files import read_run_info

ALL = "all"
"""Choice of a filter that keeps every row."""
MOST_CHOICES = 60
"""Most values of a column that can be chosen from."""
MOST_FILTERS = 8
"""Most columns that can be chosen from."""
ORDERS = {
    "row": "row",
    "objective": "objective",
    "F": "force_norm",
    "angle": "alignment_angle_deg",
    "time": "time_s",
}
"""Columns that sort, by what they are called; least first, rows without a value last."""
FIRST_FILTERS = ("status", "hand", "object_kind", "object", "task", "n_synergies", "seed")
"""Columns that come first among the filters."""
NEVER_FILTERS = {"row", "case_id", "spec_hash", "message", "feasible", "settings", "record", "version"} | {*RUN_COLUMNS}
FIGURES = ("objective", "force_norm", "alignment_angle_deg", "time_s")


@dataclass(frozen=True)
class RunFilter:
    """What to show of a run, and in which order.

    Attributes:
        chosen: Text of the value that a column has to have, by column; columns left out may have any.
        order: A key of ``ORDERS``.
    """

    chosen: Mapping[str, str]
    order: str = "row"


class RunRows:
    """The rows of the run in a folder.

    Attributes:
        folder: The folder.
        where: Condition in SQL over the columns that all rows meet; none if empty.
        spec_hash: Hash of all cases of the run.
        cases: Number of cases of the run.
        choices: Values of the columns that vary, as texts, by column: what can be filtered by.
        shown: Numbers of the rows that the filter leaves, in their order.
        row: Number of the current row.
    """

    def __init__(self, folder: Path, *, where: str = "", row: int | None = None, hand: str | None = None) -> None:
        """Read the rows that are finished by now.

        Args:
            folder: Folder of the run.
            where: Condition in SQL over the columns, as for :func:`find_rows`.
            row: Number of the row to begin with; if left out, the first feasible one, or else the first.
            hand: Hand to take instead of the one that each case names: name or description file.

        Raises:
            ResultsError: If there is no run, or it has no rows yet.
            InvalidValueError: If the condition is malformed or met by no row, or there is no such row.
        """
        self.folder, self.where, self._hand = folder, where, hand
        info = read_run_info(folder)
        self.spec_hash, self.cases = info.spec_hash, info.cases
        self._filter = RunFilter({})
        self.row = -1 if row is None else row
        self.reload()
        if row is None:
            feasible = self._table.filter(pc.equal(self._table["status"], "feasible"))["row"].to_pylist()
            self.row = next(iter(feasible or self.shown))
        elif row not in self._all:
            raise InvalidValueError("row", row, f"a planned row of {folder}, from 0 to {self.cases - 1}")

    @property
    def orders(self) -> tuple[str, ...]:
        """What the rows can be sorted by."""
        return tuple(ORDERS)

    @property
    def count(self) -> int:
        """How many rows there are before the filter."""
        return len(self._all)

    def reload(self) -> None:
        """Read the rows again; a run that goes on has more of them."""
        light = [name for name in read_run_info(self.folder).columns if name != "record"]
        table = load_table(self.folder, light)
        if not table.num_rows:
            raise ResultsError(self.folder, "no rows yet")
        if self.where:
            wanted = pa.array(sorted(find_rows(self.folder, self.where)), pa.int64())
            table = table.filter(pc.is_in(table["row"], value_set=wanted))
        if not table.num_rows:
            raise InvalidValueError("filter", self.where, f"a condition that rows of {self.folder} meet")
        self._table, self._all = table, set(table["row"].to_pylist())
        self.choices = _choices(table)
        self.choose(self._filter)

    def choose(self, chosen: RunFilter) -> None:
        """Filter and sort; the current row stays the current one, whether it is shown or not.

        Raises:
            InvalidValueError: If a column or an order can't be chosen.
        """
        if chosen.order not in ORDERS:
            raise InvalidValueError("order", chosen.order, f"one of {', '.join(ORDERS)}")
        table = self._table
        for column, text in chosen.chosen.items():
            if column not in self.choices:
                raise InvalidValueError("column", column, f"one of {', '.join(self.choices)}")
            if text != ALL:
                table = table.filter(pc.equal(_texts(table[column]), text))
        keys = [(ORDERS[chosen.order], "ascending"), ("row", "ascending")]
        places = pc.sort_indices(table, sort_keys=keys)
        self.shown = [int(row) for row in table["row"].take(places).to_pylist()]
        self._filter = chosen

    def select(self, row: int) -> None:
        """Make a row the current one.

        Raises:
            InvalidValueError: If there is no such row.
        """
        if row not in self._all:
            raise InvalidValueError("row", row, f"a planned row of {self.folder}, from 0 to {self.cases - 1}")
        self.row = row

    def step(self, by: int) -> None:
        """Go some rows on in what is shown, at most to its ends; into it, if the current row is filtered out."""
        if not self.shown:
            raise InvalidValueError("filter", dict(self._filter.chosen), "a choice that leaves rows")
        place = self.place
        self.row = self.shown[0 if place is None else min(max(place + by, 0), len(self.shown) - 1)]

    @property
    def place(self) -> int | None:
        """Where the current row is in what is shown, from 0; None if the filter leaves it out."""
        return self.shown.index(self.row) if self.row in self.shown else None

    def values(self, row: int) -> dict[str, Any]:
        """Return all columns of a row but its record."""
        table = self._table
        found: dict[str, Any] = table.filter(pc.equal(table["row"], row)).to_pylist()[0]
        return found

    def grasp(self) -> tuple[Grasp, str]:
        """Return the grasp of the current row and a note on it.

        A row without a grasp (error, time limit, crash) gives its hand at the standard start, and the note says so.

        Raises:
            GraspPlannerError: If the row's hand or object can't be had here.
        """
        values = self.values(self.row)
        title = f"row {self.row} of {self.folder.name}: {values['status']}"
        if values["force_norm"] is not None:
            return load_grasps(self.folder, [self.row], self._hand)[0], title
        case = GraspCase(
            hand=self._hand or values["hand"],
            object=values["object"],
            task=tuple(values["task"].split(" + ")),
            n_synergies=values["n_synergies"],
            settings=json.loads(values["settings"]),
        )
        problem = case.problem(load_hand(case.hand))
        start = standard_start(problem)
        grasp = Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma)
        return grasp, f"{title}; no grasp, the hand stands where the search starts"


def _texts(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """Return the values of a column as they are shown; rows without one have an empty text."""
    return pc.fill_null(pc.cast(column, pa.string()), "")


def _choices(table: pa.Table) -> dict[str, tuple[str, ...]]:
    """Return the values of the columns of the cases that vary, but not too much."""
    plain = [f.name for f in table.schema if not pa.types.is_nested(f.type) and f.name not in NEVER_FILTERS]
    result = plain.index("objective") if "objective" in plain else len(plain)
    # Columns of the case come before those of the result.
    names = [*FIRST_FILTERS, "reason", *(name for name in plain[:result] if name not in (*FIRST_FILTERS, "reason"))]
    found = {}
    for name in names:
        different = pc.unique(table[name]).drop_null()
        if 2 <= len(different) <= MOST_CHOICES:
            ordered = pc.take(different, pc.sort_indices(different))
            found[name] = tuple(_texts(ordered).to_pylist())
        if len(found) == MOST_FILTERS:
            break
    return found
