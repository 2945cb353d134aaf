"""``grasp-planner simulate``: test a planned grasp, or all those of a batch run, in MuJoCo."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.table import Table

from ..exceptions import InvalidValueError
from ..problem.settings import text_of_numbers
from ..simulate import (
    PROTOCOLS,
    GateReport,
    Protocol,
    Simulation,
    build_scene,
    error_protocol,
    find_protocol,
    simulate_grasp,
    simulation_json,
    survival,
)
from ..simulate.engine import load_mujoco
from .grasp_file import HAND, opened_grasp
from .margins import new_table
from .output import check_writable, write_or_print

if TYPE_CHECKING:
    from ..batch import BatchProgress
    from ..grasp.grasp import Grasp

EXIT_PASSED, EXIT_FAILED, EXIT_INTERRUPTED = 0, 3, 130
SURFACE_NOTE = 1e-5
"""Distance of the simulated surface from the planned contacts that is worth a line [m]."""
FILE = click.Path(path_type=Path, dir_okay=False)
FOLDER = click.Path(path_type=Path, file_okay=False)


@click.command("simulate")
@click.argument("result", type=FILE, required=False)
@HAND
@click.option(
    "--protocol",
    "name",
    type=click.Choice(tuple(PROTOCOLS)),
    default="plan",
    show_default=True,
    help="plan: from the planned posture; closing, free, handed: from an open hand, the object held, left free or "
    "handed over; table: lifted and shaken; dexgraspbench: 100 g.",
)
@click.option("--squeeze", type=float, default=1.0, show_default=True, help="Factor on the plan's δσ.")
@click.option(
    "--geometry",
    type=click.Choice(["links", "contacts"]),
    default="links",
    show_default=True,
    help="What of the hand collides: all links, or the fingertips only (for plans without clearance).",
)
@click.option("--mass", type=float, default=None, help="Mass of the object [kg] [default: the protocol's].")
@click.option("--friction", type=float, default=None, help="Coefficient of friction [default: the protocol's].")
@click.option("--force", type=float, default=None, help="Force of each push [N] [default: the protocol's].")
@click.option("--firmness", type=float, help="Times the planned efforts motors squeeze with [default: the protocol's].")
@click.option("--ladder/--no-ladder", default=True, show_default=True, help="Look for the load at failure.")
@click.option(
    "--errors",
    "samples",
    type=click.IntRange(min=1),
    help="Close with errors, this many samples a row, around a free object, handed over or on a table: what survives.",
)
@click.option("--out", type=click.Path(path_type=Path), help="JSON file; with --run: folder of the results.")
@click.option("--html", "html_file", type=FILE, help="Write an animation that opens offline.")
@click.option("--mjcf", "mjcf_file", type=FILE, help="Write the scene as MJCF.")
@click.option("--run", "run_folder", type=FOLDER, help="Simulate the rows of a batch run instead of RESULT.")
@click.option("--where", default="feasible", show_default=True, help="With --run: which rows, in SQL.")
@click.option("--workers", type=click.IntRange(min=1), help="With --run: worker processes.")
def simulate(
    result: Path | None,
    hand: str | None,
    name: str,
    squeeze: float,
    geometry: str,
    mass: float | None,
    friction: float | None,
    force: float | None,
    firmness: float | None,
    ladder: bool,
    samples: int | None,
    out: Path | None,
    html_file: Path | None,
    mjcf_file: Path | None,
    run_folder: Path | None,
    where: str,
    workers: int | None,
) -> None:
    """Test the grasp of the file RESULT in MuJoCo: its own springs and synergies move the hand, nothing else.

    The object is pushed along ±x, ±y, ±z and twisted about them; the ladder finds the loads at which it is lost.
    Exit code 0: all six forces were held; 3: not; 2: wrong usage.
    """
    given: dict[str, Any] = {"mass": mass, "friction": friction, "force": force, "geometry": geometry}
    protocol = replace(
        find_protocol(name, firmness), **{key: value for key, value in given.items() if value is not None}
    )
    if (result is None) == (run_folder is None):
        raise click.UsageError("Give either RESULT or --run.")
    load_mujoco()
    if run_folder is not None:
        if html_file is not None or mjcf_file is not None:
            raise click.UsageError("--html and --mjcf are for one RESULT.")
        sys.exit(_simulate_run(run_folder, protocol, squeeze, ladder, out, where, hand, workers))
    assert result is not None
    check_writable(out, html_file, mjcf_file)
    grasp = opened_grasp(result, hand)
    console = Console()
    if not grasp.feasible:
        console.print(f"[red]the plan is {grasp.verdict}[/]", highlight=False)
    if samples is not None:
        sys.exit(_print_survival(console, grasp, samples, find_protocol(error_protocol(name), firmness)))
    if mjcf_file is not None:
        write_or_print(build_scene(grasp, protocol).xml, mjcf_file)
    with console.status("simulating …"):
        found = simulate_grasp(grasp, protocol, squeeze=squeeze, ladder=ladder, record=html_file is not None)
    print_simulation(console, found)
    if out is not None:
        write_or_print(simulation_json(found), out)
    if html_file is not None and not found.frames:
        console.print("no animation: nothing was simulated")
    elif html_file is not None:
        from ..viewer import export_simulation_html

        export_simulation_html(found, html_file)
        console.print(f"animation: {html_file}")
    sys.exit(EXIT_PASSED if found.passed else EXIT_FAILED)


def print_simulation(console: Console, found: Simulation) -> None:
    """Print a simulation as tables.

    Args:
        console: Where to.
        found: The simulation.
    """
    colour = "green" if found.passed else "yellow" if found.rest is None else "red"
    console.print(f"[bold {colour}]{found.verdict}[/]", highlight=False)
    summary = Table(show_header=False, box=None, pad_edge=False)
    gravity = "with gravity" if found.protocol.gravity else "without gravity"
    rows = [
        (
            "test",
            f"{found.protocol.name}: {found.mass:g} kg, μ {text_of_numbers(found.friction)}, {gravity}, "
            f"squeeze × {found.squeeze:g}",
        ),
        ("scene", "; ".join(found.notes)),
        *((f"overlap, {gate.posture}", _gate_text(gate, found.protocol.table)) for gate in found.gates),
    ]
    if found.surface_error > SURFACE_NOTE:
        off = f"up to {1e3 * found.surface_error:.2f} mm from the planned contacts"
        rows.append(("simulated surface", off))
    if not found.gate_passed and found.protocol.geometry == "links":
        rows.append(("", "plan with --clearance links, or simulate the fingertips alone: --geometry contacts"))
    if found.rest is not None:
        rest = found.rest
        rows.append(("object at rest", f"moved {1e3 * rest.displacement:.3f} mm, {rest.rotation_deg:.3f}°"))
        rows.append(("normal forces", f"differ from predicted by {100 * rest.normal_force_error:.1f} % of F"))
        if rest.other_force > 1e-6:
            rows.append(("other links press", f"{rest.other_force:.3f} N"))
    for label, text in rows:
        summary.add_row(f"[bold]{label}[/]", text)
    console.print(summary, highlight=False)
    if found.rest is None:
        return
    forces = new_table("normal forces at rest [N]", ("contact", "predicted", "simulated", "friction used"))
    rest = found.rest
    columns = (rest.predicted_normal_forces, rest.normal_forces, rest.friction_use)
    for frame, predicted, simulated, used in zip(found.grasp.problem.frames, *columns, strict=True):
        forces.add_row(frame.name, f"{predicted:.3f}", f"{simulated:.3f}", f"{100 * used:.0f} %")
    console.print(forces)
    console.print(_shake_table(found) if found.protocol.table else _direction_table(found))


def _print_survival(console: Console, grasp: Grasp, samples: int, protocol: Protocol) -> int:
    """Print what of a closing survives errors and return the exit code: passed if it closes as planned."""
    which = "an object handed over" if protocol.carried is not None else "the free object"
    pushed = "" if protocol.table else f"around {which}, then pushes; "
    title = f"closing {pushed}around the object on its table, then lifted and shaken"
    table = new_table(title, ("off the plan", "survived", "first failure"))
    table.columns[-1].no_wrap = False
    rows = survival(grasp, samples=samples, protocol=protocol)
    for row in rows:
        table.add_row(row.name, f"{row.survived} of {row.tried}" if row.tried else "–", row.worst)
    console.print(table)
    return EXIT_PASSED if rows[0].survived else EXIT_FAILED


def _gate_text(gate: GateReport, table: bool) -> str:
    """Return overlaps in words."""
    below = f", {1e3 * gate.table_overlap:.2f} mm with the table" if table else ""
    return f"{1e3 * gate.object_overlap:.2f} mm with the object, {1e3 * gate.self_overlap:.2f} mm of links{below}"


def _direction_table(found: Simulation) -> Table:
    """Return the table of pushes."""
    columns = ("push", "load", "held", "moved [mm]", "turned [°]", "held up to", "lost at")
    table = new_table("pushes: forces \\[N], torques \\[N mm]", columns)
    for report in found.directions:
        scale, digits = (1.0, 2) if report.kind == "force" else (1e3, 1)
        lost = report.load_lost
        ladder = "" if report.load_held is None else f"{scale * report.load_held:.{digits}f}"
        table.add_row(
            f"{report.kind} {report.direction}",
            f"{scale * report.load:.{digits}f}",
            "[green]yes[/]" if report.held else "[red]no[/]",
            f"{1e3 * report.displacement:.2f}",
            f"{report.rotation_deg:.2f}",
            ladder,
            "–" if lost is None else f"{scale * lost:.{digits}f}",
        )
    return table


def _shake_table(found: Simulation) -> Table:
    """Return the table of shakes."""
    table = new_table(f"shaken, {found.protocol.shake:g} m/s²", ("along", "held", "moved [mm]", "turned [°]"))
    for report in found.directions:
        held = "[green]yes[/]" if report.held else "[red]no[/]"
        table.add_row(report.direction, held, f"{1e3 * report.displacement:.2f}", f"{report.rotation_deg:.2f}")
    return table


def _simulate_run(
    run: Path,
    protocol: Protocol,
    squeeze: float,
    ladder: bool,
    out: Path | None,
    where: str,
    hand: str | None,
    workers: int | None,
) -> int:
    """Simulate the rows of a batch run and return the exit code."""
    from ..batch.simulations import simulate_run

    if squeeze <= 0.0:
        raise InvalidValueError("squeeze", squeeze, "a number > 0")

    def show(state: BatchProgress) -> None:
        click.echo(f"\r{state.done}/{state.total} simulated, {state.feasible} passed", nl=False, err=True)

    summary = simulate_run(
        run, out, protocol, squeeze=squeeze, ladder=ladder, where=where, hand=hand, workers=workers, on_progress=show
    )
    click.echo("", err=True)
    click.echo(f"{summary.feasible} of {summary.done} passed ({summary.total} rows): {summary.folder / 'results'}")
    if summary.interrupted:
        click.echo("stopped; run the same command again to go on", err=True)
        return EXIT_INTERRUPTED
    return EXIT_PASSED if summary.feasible == summary.total else EXIT_FAILED
