"""What a grasp is worth and what it withstands, as printed by all commands that show one."""

from __future__ import annotations

import math

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ..analysis.ladder import height, verdict_ladder
from ..grasp.grasp import Grasp
from ..judge.margins import Margin
from ..spatial import Array


def print_verdict(console: Console, grasp: Grasp) -> None:
    """Print the sentence of the verdict and the ladder below it, green as far as it is true."""
    console.print(f"[bold {'green' if grasp.feasible else 'red'}]{escape(grasp.verdict)}[/]", highlight=False)
    rungs = verdict_ladder(grasp)
    for index, rung in enumerate(rungs):
        colour = "green" if index < height(rungs) else "dim" if rung.met is None else "yellow" if rung.met else "red"
        console.print(f"  [{colour}]{rung.mark} {rung.name}[/]: {escape(rung.text)}", highlight=False)


def margin_rows(grasp: Grasp) -> list[tuple[str, str]]:
    """Return rows of what the grasp withstands: load cases asked for, margins in newtons."""
    margins = grasp.margins
    rows = [("load cases", loads_text(grasp)), ("stability", grasp.stability.text)]
    if math.isnan(margins.passive.size):
        return [*rows, ("margins", "not defined without contact stiffness")]
    rows.append(("margin, worst", f"{_text(margins.passive)}; re-squeezed {_text(margins.active)}"))
    for task, passive, active in zip(grasp.problem.tasks, margins.passive_tasks, margins.active_tasks, strict=True):
        if passive is not None and active is not None:
            unit = "N m" if task.kind == "torque" else "N"
            rows.append((f"margin {task.text}", f"{_text(passive, unit)}; re-squeezed {_size(active, unit)}"))
    return rows


def loads_text(grasp: Grasp) -> str:
    """Say which load cases were asked for."""
    loads = grasp.problem.loads
    if not loads.active:
        return "none: only the nominal load"
    amounts = (
        (loads.force, "N"),
        (loads.torque, "N m"),
        (loads.acceleration, "m/s²"),
        (1e3 * loads.position_error, "mm"),
        (math.degrees(loads.rotation_error), "°"),
    )
    parts = [f"{amount:.3g} {unit}" for amount, unit in amounts if amount]
    parts += [f"{len(loads.wrenches)} wrenches"] * bool(loads.wrenches)
    parts += [f"μ/{loads.friction_safety:g}", f"f_n ≥ {loads.min_normal_force:g} N"]
    if math.isfinite(grasp.problem.max_normal_force):
        parts.append(f"f_n ≤ {grasp.problem.max_normal_force:g} N")
    if loads.max_force_norm is not None:
        parts.append(f"F ≤ {loads.max_force_norm:.4g} N")
    return ", ".join(parts)


def _text(margin: Margin, unit: str = "N") -> str:
    """Return size, direction of a force and what gives way."""
    text = _size(margin, unit)
    if unit == "N" and math.isfinite(margin.size):
        text += f" along {direction_text(margin.direction[:3])}"
    return text + (f", {margin.gives_way}" if margin.gives_way else "")


def _size(margin: Margin, unit: str) -> str:
    """Return the size with its unit."""
    return "any" if math.isinf(margin.size) else f"{margin.size:.3g} {unit}"


def direction_text(direction: Array) -> str:
    """Return a direction as three short numbers."""
    return "(" + " ".join(f"{value:+.2f}" for value in np.round(direction, 2) + 0.0) + ")"


def new_table(title: str, columns: tuple[str, ...]) -> Table:
    """Return a narrow table: the first column names, the others hold numbers."""
    table = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for index, column in enumerate(columns):
        table.add_column(column, justify="right" if index else "left", no_wrap=True)
    return table
