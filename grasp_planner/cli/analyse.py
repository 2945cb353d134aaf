"""``grasp-planner analyse`` and ``improve``: what a planned grasp withstands, how it depends on what may be off."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table
from threadpoolctl import threadpool_limits

from ..analysis.improve import GOALS, Goal, Improvement, improve_grasp, withstood
from ..analysis.measured_contacts import ContactSet, contact_set
from ..analysis.measures import Measure
from ..analysis.optimality_program import ForceBound
from ..analysis.sensitivity import SETTLED, PostOptimality, Sensitivity, post_optimality
from ..analysis.tolerance import QUESTION, pose_tolerances
from ..grasp.grasp import Grasp
from ..records.analysis_record import analysis_record, contact_analysis_record
from ..records.contact_file import is_contact_file, read_contact_file
from ..records.grasp_files import grasp_json
from .closing_tolerance import print_closing_tolerances
from .grasp_file import HAND, opened_grasp
from .margins import margin_rows, new_table, print_verdict
from .measures import opened_contacts, print_measures
from .output import check_writable, write_or_print

EXIT_NOT_BETTER = 3
UNITS: dict[Goal, tuple[float, str]] = {"force": (1.0, "N"), "position": (1e3, "mm"), "rotation": (180 / math.pi, "°")}
"""How disturbances are printed."""

FILE = click.argument("file", type=click.Path(path_type=Path))
OUT = click.Path(path_type=Path, allow_dash=True)


@click.command()
@FILE
@HAND
@click.option("--json", "json_file", type=OUT, help="Write the analysis as JSON; - for standard output.")
@click.option("--all", "everything", is_flag=True, help="Print every measure instead of those that matter most.")
@click.option("--compare", type=click.Path(path_type=Path), help="Second grasp or contact file to print beside it.")
@click.option("--picture", type=click.Path(path_type=Path), help="Draw slices and ellipsoids, as PNG.")
@click.option(
    "--tolerance",
    "directions",
    type=click.IntRange(min=1),
    help="How far palm, size, friction and mass may be off for it still to close; that many directions of the palm.",
)
@click.option("--simulated", is_flag=True, help="With --tolerance: by simulation, some minutes, instead of statics.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of these directions.")
@click.option("--sensitivity/--no-sensitivity", default=True, show_default=True, help="Whether to find the optimum.")
def analyse(
    file: Path,
    hand: str | None,
    json_file: Path | None,
    everything: bool,
    compare: Path | None,
    picture: Path | None,
    directions: int | None,
    simulated: bool,
    seed: int,
    sensitivity: bool,
) -> None:
    """Print margins, measures, stability, tolerance and sensitivities of a planned grasp.

    FILE is a grasp of `plan --json`, or a JSON file of contacts from elsewhere (points, normals, friction; forces, J,
    S, stiffnesses where they are known), of which the measures are printed. The sensitivities are those of the optimum
    near the grasp: dF*/dp for friction, mass, size, compliances and the object's pose, and how far each parameter may
    change until the active set does or F is 5 % off what they predict.
    """
    if simulated and directions is None:
        raise click.UsageError("--simulated is for --tolerance.")
    check_writable(json_file, picture)
    console = Console(stderr=str(json_file) == "-")
    if is_contact_file(file):
        found_measures = _print_measures(console, file, read_contact_file(file), hand, everything, compare, picture)
        if json_file is not None:
            write_or_print(contact_analysis_record(found_measures).model_dump_json(indent=2) + "\n", json_file)
        return
    grasp = opened_grasp(file, hand)
    print_verdict(console, grasp)
    _print_rows(console, [("F", f"{grasp.force_norm:.4f} N"), *margin_rows(grasp)])
    measured = _print_measures(console, file, contact_set(grasp), hand, everything, compare, picture)
    console.print(_tolerance_table(grasp))
    if directions is not None:
        print_closing_tolerances(console, grasp, directions, seed, simulated)
    found = None
    if sensitivity and grasp.feasible:
        with console.status("finding the optimum …"), threadpool_limits(limits=1):
            found = post_optimality(grasp)
        _print_sensitivities(console, grasp, found)
    if json_file is not None:
        write_or_print(analysis_record(grasp, found, measured).model_dump_json(indent=2) + "\n", json_file)


def _print_measures(
    console: Console,
    file: Path,
    contacts: ContactSet,
    hand: str | None,
    everything: bool,
    compare: Path | None,
    picture: Path | None,
) -> tuple[Measure, ...]:
    """Print the measures of contacts, beside those of another file, and draw them where that is asked for."""
    columns = {"value" if compare is None else file.stem: contacts}
    if compare is not None:
        columns[compare.stem if compare.stem != file.stem else str(compare)] = opened_contacts(compare, hand)
    if picture is not None:
        from ..drawing.measures_picture import draw_measures

        draw_measures(contacts, picture)
    return print_measures(console, columns, everything=everything)


@click.command()
@FILE
@HAND
@click.option(
    "--goal",
    type=click.Choice(GOALS),
    default="force",
    show_default=True,
    help="What to withstand more of: a disturbing force, or an object that is off in position or rotation.",
)
@click.option("--budget", type=float, default=0.2, show_default=True, help="How much larger F may become, relative.")
@click.option("--trials", type=int, default=8, show_default=True, help="Most plans.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the random starts.")
@click.option("--out", type=OUT, default=None, help="Write the better grasp as JSON; - for standard output.")
def improve(file: Path, hand: str | None, goal: Goal, budget: float, trials: int, seed: int, out: Path | None) -> None:
    """Plan anew from a grasp, within a budget of grasping force, so that it withstands more.

    FILE is a grasp of `plan --json`. Exit code 0: a better grasp; 3: none was found.
    """
    grasp = opened_grasp(file, hand)
    console = Console(stderr=str(out) == "-")
    with console.status("planning anew …"):
        found = improve_grasp(grasp, goal=goal, budget=budget, trials=trials, seed=seed)
    console.print(_trial_table(found))
    console.print(_comparison(found))
    better = found.after is not grasp
    console.print(f"F grows by {100 * found.cost:.1f} %" if better else "no better grasp within the budget")
    if out is not None:
        write_or_print(grasp_json(found.after), out)
    sys.exit(0 if better else EXIT_NOT_BETTER)


def _print_rows(console: Console, rows: list[tuple[str, str]]) -> None:
    """Print named lines."""
    table = Table(show_header=False, box=None, pad_edge=False)
    for name, text in rows:
        table.add_row(f"[bold]{name}[/]", text)
    console.print(table, highlight=False)


def _tolerance_table(grasp: Grasp) -> Table:
    """Return how far the object may be off."""
    title = f"tolerance ({QUESTION}): how far the object may be moved in a closed hand until something gives way"
    table = new_table(title, ("", "−", "+", "unit", "gives way (−)", "gives way (+)"))
    for found in pose_tolerances(grasp):
        factor, unit = (1e3, "mm") if found.unit == "m" else (180.0 / math.pi, "°")
        table.add_row(
            found.coordinate,
            f"{factor * found.down:.3g}",
            f"{factor * found.up:.3g}",
            unit,
            found.gives_way_down,
            found.gives_way_up,
        )
    return table


def _print_sensitivities(console: Console, grasp: Grasp, found: PostOptimality) -> None:
    """Print the optimum and its sensitivities."""
    best = found.grasp
    console.print(
        f"optimum nearby: F = {best.force_norm:.4f} N (given: {grasp.force_norm:.4f}), C = {best.task_index:.4g}; "
        f"{len(found.active)} active inequalities, {found.flat} flat directions",
        highlight=False,
    )
    if found.stationarity > SETTLED:
        console.print(f"[red]not settled (gradient left {found.stationarity:.1e}): sensitivities are rough[/]")
    title = "sensitivity of the optimum, and how far each parameter may change for F to follow it (to 5 %)"
    head = ("parameter p", "dF*/dp \\[N]", "dC*/dp", "per", "valid −", "valid +")
    table = new_table(title, head)
    for entry in found.sensitivities:
        if entry.follows:
            table.add_row(*_sensitivity_cells(entry))
    console.print(table)
    if any(name.startswith(ForceBound.name) for name, _ in found.active):
        console.print("F is at the bound that the search gave it and stays there: what answers is C", highlight=False)
    lost = [entry.name for entry in found.sensitivities if not entry.follows]
    if lost:
        console.print(f"too few motors to keep every active constraint: {', '.join(lost)}", highlight=False)


def _sensitivity_cells(entry: Sensitivity) -> tuple[str, ...]:
    """Return the cells of one parameter."""
    bounds = ("any" if math.isinf(value) else f"{value:.3g}" for value in (entry.down, entry.up))
    return entry.name, f"{entry.d_force_norm:+.4g}", f"{entry.d_task_index:+.4g}", entry.unit, *bounds


def _trial_table(found: Improvement) -> Table:
    """Return the trials of an improvement."""
    title = f"trials with F ≤ {(1 + found.budget) * found.before.force_norm:.4g} N"
    factor, unit = UNITS[found.goal]
    table = new_table(title, (f"{found.goal} \\[{unit}]", "found", "F \\[N]", "C"))
    for step in found.steps:
        verdict = "yes" if step.feasible else "no"
        amount = f"{factor * step.disturbance:.3g}"
        table.add_row(amount, verdict, f"{step.force_norm:.4f}", f"{step.task_index:.4g}")
    return table


def _comparison(found: Improvement) -> Table:
    """Return the grasp before and after."""
    table = new_table("before and after", ("", "before", "after"))
    before, after = found.before, found.after
    rows = {
        "F [N]": (before.force_norm, after.force_norm),
        "C": (before.task_index, after.task_index),
        "margin, worst [N]": (before.margins.passive.size, after.margins.passive.size),
        "re-squeezed [N]": (before.margins.active.size, after.margins.active.size),
        "least shift withstood [mm]": (1e3 * withstood(before, "position"), 1e3 * withstood(after, "position")),
        "least turn withstood [°]": tuple(math.degrees(withstood(g, "rotation")) for g in (before, after)),
    }
    for name, (old, new) in rows.items():
        table.add_row(name.replace("[", "\\["), f"{old:.4g}", f"{new:.4g}")
    return table
