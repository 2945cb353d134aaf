"""Measures of a grasp, or of two side by side, as tables in groups; the file they are read from."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from ..analysis.measured_contacts import ContactSet, contact_set
from ..analysis.measures import Measure, measure_contacts
from ..records.contact_file import is_contact_file, read_contact_file
from ..values import number_text
from .grasp_file import opened_grasp
from .margins import new_table


def opened_contacts(path: Path, hand: str | None) -> ContactSet:
    """Return the contacts of a plain file, or of a grasp file.

    Args:
        path: The file.
        hand: The hand to take for a grasp file, or its own.

    Raises:
        GraspPlannerError: If the file can't be read.
    """
    return read_contact_file(path) if is_contact_file(path) else contact_set(opened_grasp(path, hand))


def print_measures(console: Console, columns: dict[str, ContactSet], *, everything: bool) -> tuple[Measure, ...]:
    """Print measures group by group, one column for each grasp, and return those of the first.

    Args:
        console: Where to.
        columns: The grasps by the title of their column.
        everything: Whether all, or only the ones that matter most.
    """
    found = {title: measure_contacts(contacts, everything=everything) for title, contacts in columns.items()}
    first = next(iter(found.values()))
    for group, members in itertools.groupby(first, key=lambda measure: measure.group):
        table = new_table(group, ("", *found, "unit", "what it says"))
        table.columns[-1].justify, table.columns[-1].no_wrap = "left", False
        for measure in members:
            cells = [_cell(measure.name, others) for others in found.values()]
            table.add_row(measure.name, *cells, measure.unit, measure.says.replace("[", "\\["))
        console.print(table)
    return first


def _cell(name: str, others: Sequence[Measure]) -> str:
    """Return the value of a measure as a cell, a dash where there is none."""
    measure = next((each for each in others if each.name == name), None)
    if measure is None:
        return "–"
    return measure.text or number_text(measure.value, 4)
