"""``grasp-planner plan``: plan one grasp, print it, save it, draw it."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table

from ..analysis.why_not import explain_infeasibility
from ..grasp.grasp import FEASIBILITY_TOLERANCE, Grasp, IterationRecord, SearchReport
from ..grasp.joint_rows import joint_rows
from ..judge.clearance_check import ClearanceKind
from ..planning.planner import MOST_GRASPS, plan_grasps
from ..planning.side_contacts import said_of
from ..planning.trade import task_angle, trade_front, trade_text, traded_grasps
from ..problem.term import own_costs
from ..values import number_text
from .margins import margin_rows, new_table, print_verdict
from .options import planner_options, problem_from_options, problem_options, search_options
from .output import check_writable, write_or_print

EXIT_FEASIBLE, EXIT_INFEASIBLE, EXIT_INTERRUPTED = 0, 3, 130


@click.command()
@problem_options
@search_options
@click.option(
    "--json",
    "json_file",
    type=click.Path(path_type=Path, allow_dash=True),
    help="Write the grasp as JSON; - for standard output.",
)
@click.option(
    "--grasps",
    "count",
    type=click.IntRange(1, MOST_GRASPS),
    default=1,
    show_default=True,
    help="How many grasps that differ; more than one are a list, the best first, also as JSON.",
)
@click.option("--picture", type=click.Path(path_type=Path), help="Write a picture of the grasp (PNG or SVG).")
@click.option(
    "--trade", type=click.Path(path_type=Path), help="Draw F against the angle of the task, as PNG; print the front."
)
@click.option("--explain/--no-explain", default=True, show_default=True, help="Without a feasible grasp: say why.")
@click.option("--quiet", is_flag=True, help="No progress and no table.")
def plan(
    json_file: Path | None,
    count: int,
    picture: Path | None,
    trade: Path | None,
    explain: bool,
    quiet: bool,
    seed: int,
    **arguments: Any,
) -> None:
    """Plan a task-specific force-closure grasp.

    Hand, object and task are by default those of [Mavrogiannis2014]: the DLR/HIT II hand, a 6 cm cylinder of 200 g, a
    force along +y. The links keep clear and a push from any side is withstood; with --paper it is the paper's own
    problem. Exit code 0: a feasible grasp; 2: wrong usage; 3: no feasible grasp was found.
    """
    problem = problem_from_options(**arguments)
    options = planner_options(arguments)
    check_writable(json_file, picture, trade)
    found: list[Grasp] = []
    to_stdout = str(json_file) == "-"
    # Everything but JSON goes to standard error when JSON has standard output.
    console = Console(stderr=to_stdout, quiet=quiet)
    with console.status("planning …") as status:

        def show(record: IterationRecord) -> None:
            status.update(
                f"start {record.start + 1}, phase {record.phase}, iteration {record.iteration}: "
                f"F = {number_text(record.force_norm)} N, C = {number_text(record.task_index)}, "
                f"gap {number_text(1e3 * record.violations['surface'])} mm"
            )

        try:
            grasps = plan_grasps(
                problem, count, seed=seed, options=options, callback=show, result_callback=found.append
            )
        except KeyboardInterrupt:
            console.print("interrupted")
            sys.exit(EXIT_INTERRUPTED)
    grasp = grasps[0]
    for line in said_of(problem.hand, grasp.problem.hand):
        click.echo(line, err=True)
    print_grasp(console, grasp)
    if count > 1:
        console.print(_grasps_table(grasps, count))
    if grasp.feasible:
        _print_trade(console, grasp, found, trade)
    if explain and not grasp.feasible:
        with console.status("looking for the reason (at most a minute) …"):
            diagnosis = explain_infeasibility(grasp, seed=seed)
        console.print(f"[bold]why not[/]\n{diagnosis.text}", highlight=False)
    if json_file is not None:
        from ..records.grasp_files import grasp_json, grasp_list_json  # slow to import

        write_or_print(grasp_json(grasp) if count == 1 else grasp_list_json(grasps), json_file)
    if picture is not None:
        from ..drawing.picture import save_picture

        save_picture(grasp, picture)
        console.print(f"picture: {picture}")
    sys.exit(EXIT_FEASIBLE if grasp.feasible else EXIT_INFEASIBLE)


def _print_trade(console: Console, grasp: Grasp, found: list[Grasp], picture: Path | None) -> None:
    """Say what a badly served task costs in force; print and draw the whole front where that is asked for."""
    known = [grasp, *(each for each in found if each.feasible)]
    if picture is not None:
        with console.status("moving the bound of F …"):
            known += traded_grasps(grasp)
    front = trade_front(known)
    told = trade_text(front, grasp)
    if told is not None:
        console.print(f"[bold]trade[/]: {told}; no posture found serves the task with little force", highlight=False)
    if picture is None:
        return
    from ..drawing.trade_picture import draw_trade

    table = new_table("front of force and task", ("F [N]", "angle [°]", "C"))
    for each in front:
        table.add_row(f"{each.force_norm:.3f}", f"{task_angle(each):.1f}", number_text(each.task_index))
    console.print(table)
    draw_trade(known, front, grasp, picture)
    console.print(f"front: {picture}")


def print_grasp(console: Console, grasp: Grasp) -> None:
    """Print a grasp as tables.

    Args:
        console: Where to.
        grasp: The grasp.
    """
    if console.quiet:
        return
    problem, search = grasp.problem, grasp.search or SearchReport(seed=0)
    print_verdict(console, grasp)
    summary = Table(show_header=False, box=None, pad_edge=False)
    title = problem.hand.description.title or problem.hand.name
    rows = [
        ("hand, object", f"{title}; {problem.grasp_object.text}"),
        ("task", ", ".join(task.text for task in problem.tasks)),
        ("synergies", f"{problem.n_synergies} of set {_set_name(grasp)}"),
        ("F", f"{grasp.force_norm:.4f} N ({_force_text(grasp)})"),
        ("C", number_text(grasp.task_index, 4)),
        *own_cost_rows(grasp),
        *_task_rows(grasp),
        ("clearance", _clearance_text(grasp)),
        ("force closure", f"{'yes' if grasp.force_closed else 'no'}, margin {grasp.force_closure_margin:.3f}"),
        *margin_rows(grasp),
        ("σ [rad]", " ".join(f"{value:+.4f}" for value in grasp.sigma)),
        (
            "search",
            f"{search.phase_one_iterations} + {search.iterations} iterations; {search.starts_feasible} of "
            f"{search.starts_tried} starts feasible; {search.evaluations} evaluations; {search.time_s:.2f} s; "
            f"seed {search.seed}",
        ),
    ]
    for name, text in rows:
        summary.add_row(f"[bold]{name}[/]", text)
    console.print(summary, highlight=False)
    console.print(_contact_table(grasp))
    console.print(_joint_table(grasp))
    console.print(_violation_table(grasp))


def _force_text(grasp: Grasp) -> str:
    """Say how little force would do: at these contacts, and as far as the search knows."""
    told = f"floor at these contacts {grasp.force_norm_floor:.4f} N"
    if grasp.problem.loads.active:
        told += f", with every load case {grasp.load_force_floor:.4f} N"
    least = grasp.search.least_force if grasp.search is not None else None
    return told if least is None else f"{told}; least found {least:.4f} N"


def _grasps_table(grasps: Sequence[Grasp], count: int) -> Table:
    """Return the table of several grasps."""
    columns = ("", "F [N]", "angle [°]", "C", "margin [N]", "closes")
    found = sum(grasp.feasible for grasp in grasps)
    table = new_table(f"{found} of {count} grasps that differ; what is above is the first", columns)
    for number, grasp in enumerate(grasps, start=1):
        table.add_row(
            str(number),
            f"{grasp.force_norm:.3f}",
            f"{grasp.alignments[0][0]:.1f}",
            number_text(grasp.task_index),
            f"{grasp.passive_margin.size:.2f}",
            "yes" if grasp.closing.holds else "no",
        )
    return table


def own_cost_rows(grasp: Grasp) -> list[tuple[str, str]]:
    """Return the user's own costs of a grasp, by the plain formulas, with their weights in the objective."""
    return [
        (each.cost.name, f"{each.cost.unit.text(each.cost.clear_value(grasp))}, weight {each.weight:g}")
        for each in own_costs(grasp.problem.costs)
    ]


def _clearance_text(grasp: Grasp) -> str:
    """Say what overlaps, and whether that was to be avoided."""
    kinds: tuple[tuple[ClearanceKind, str], ...] = (
        ("link_object", "links overlap the object"),
        ("self_collision", "links overlap links"),
    )
    overlaps = []
    for kind, what in kinds:
        if (overlap := grasp.overlap(kind)) > FEASIBILITY_TOLERANCE:
            note = "" if kind in grasp.violations else " (allowed)"
            overlaps.append(f"{what} by {1e3 * overlap:.1f} mm{note}")
    return "; ".join(overlaps) or "no link overlaps the object or another link"


def _set_name(grasp: Grasp) -> str:
    """Return the name of the synergy set in use."""
    problem = grasp.problem
    return problem.synergies.name or problem.synergy_set or "given"


def _task_rows(grasp: Grasp) -> list[tuple[str, str]]:
    """Return a row for each task direction."""
    rows = []
    for task, ratio, (angle, degenerate) in zip(
        grasp.problem.tasks, grasp.transmission_ratios, grasp.alignments, strict=True
    ):
        symbol = "β" if task.is_motion else "α"
        amount = "∞ (the structure resists, not the motors)" if math.isinf(ratio) else number_text(ratio, 4)
        note = ", degenerate ellipsoid" if degenerate else ""
        rows.append((f"{symbol} {task.text}", f"{amount}; angle to the ellipsoid's longest axis {angle:.2f}°{note}"))
    return rows


def _contact_table(grasp: Grasp) -> Table:
    """Return the table of contacts."""
    columns = ("contact", "x", "y", "z", "f_x", "f_y", "f_z", "f_n", "margin")
    table = new_table("contacts in the object frame: points \\[mm], forces of the hand on the object \\[N]", columns)
    contacts = grasp.contacts
    for i, frame in enumerate(grasp.problem.frames):
        table.add_row(
            frame.name,
            *(f"{1e3 * value:.2f}" for value in contacts.points[i]),
            *(f"{value:.3f}" for value in grasp.forces[i]),
            f"{grasp.normal_forces[i]:.3f}",
            f"{grasp.friction_margins[i]:.3f}",
        )
    return table


def _joint_table(grasp: Grasp) -> Table:
    """Return the table of joints."""
    table = new_table("joints", ("joint", "q [°]", "reference q_r [°]", "torque [N mm]"))
    for row in joint_rows(grasp):
        table.add_row(row.name, f"{row.angle:.2f}", f"{row.reference:.2f}", f"{row.torque:.2f}")
    return table


def _violation_table(grasp: Grasp) -> Table:
    """Return the table of violations."""
    title = f"violations, recomputed; feasible up to {FEASIBILITY_TOLERANCE:g}"
    table = new_table(title, ("requirement", "violation", "unit"))
    failed = grasp.failures()
    for name, found in grasp.violations.items():
        value = number_text(found.value)
        table.add_row(name, f"[red]{value}[/]" if name in failed else value, found.unit.symbol)
    return table
