"""``grasp-planner study-synergies``: success in simulation against the number of synergies, as a page with plots."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from ..simulate import PROTOCOLS
from ..simulate.engine import load_mujoco
from .batch import INTERRUPTED, progress
from .options import parse_counts, parse_names

if TYPE_CHECKING:
    from ..studies.study_rows import StudyRow
    from ..studies.synergy_study import StudySettings


@click.command("study-synergies")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True, help="Folder; goes on there.")
@click.option("--hand", default="dlr_hit_ii_right", show_default=True, help="Hand by name, or a description file.")
@click.option("--sets", default="native", show_default=True, help="Synergy sets, separated by commas.")
@click.option("--objects", default="cylinder", show_default=True, help="Kinds of random objects, or 'all'.")
@click.option("--counts", default="1-15", show_default=True, help="Numbers of synergies, such as 1-5,15.")
@click.option("--problems", type=int, default=20, show_default=True, help="Random problems for each combination.")
@click.option("--contact-set", default=None, help="Contact set [default: the hand's].")
@click.option("--clearance", type=click.Choice(["links", "none"]), default="none", show_default=True)
@click.option(
    "--loads/--no-loads", default=False, show_default=True, help="Whether plans hold the standard load cases."
)
@click.option(
    "--friction-safety",
    type=float,
    default=None,
    help="s: plans stay in the cones of μ/s [default: 1.2; 1 without loads].",
)
@click.option(
    "--joint-compliance", type=float, default=None, help="C_q of every joint [rad/(N m)] [default: the standard's]."
)
@click.option("--paper", is_flag=True, help="Plans are the paper's: forces by (17), weighed against the task.")
@click.option("--squeeze", type=float, default=1.0, show_default=True, help="Factor on the plans' δσ.")
@click.option("--protocol", type=click.Choice(tuple(PROTOCOLS)), default="plan", show_default=True)
@click.option(
    "--firmness",
    type=float,
    default=None,
    help="Times the planned efforts motors squeeze with [default: the protocol's].",
)
@click.option("--table", is_flag=True, help="Objects stand on a table, which plans keep clear of.")
@click.option(
    "--errors",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Close every grasp with errors too, this many samples a row: what survives.",
)
@click.option("--starts", type=int, default=40, show_default=True, help="Most starts of each search.")
@click.option(
    "--enough", type=int, default=4, show_default=True, help="Feasible grasps after which the best is simulated."
)
@click.option(
    "--time-limit",
    type=float,
    default=None,
    help="Longest search, wall time [s] [default: 60; none with --cpu-limit].",
)
@click.option("--cpu-limit", type=float, default=None, help="Longest search, processor time [s] [default: none].")
@click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="Worker processes.")
def study_synergies(
    out: Path,
    hand: str,
    sets: str,
    objects: str,
    counts: str,
    problems: int,
    contact_set: str | None,
    clearance: str,
    loads: bool,
    friction_safety: float | None,
    joint_compliance: float | None,
    paper: bool,
    squeeze: float,
    protocol: str,
    firmness: float | None,
    table: bool,
    errors: int,
    starts: int,
    enough: int,
    time_limit: float | None,
    cpu_limit: float | None,
    workers: int,
) -> None:
    """Plan random problems, simulate the grasps, and write a page: what holds, and which static margin predicts it."""
    from ..studies.synergy_study import StudySettings, load_study, run_study
    from ..studies.synergy_study_page import write_study

    load_mujoco()
    settings = StudySettings(
        hand=hand,
        synergy_sets=parse_names(sets),
        object_kinds=parse_names(objects),
        counts=parse_counts("counts", counts),
        problems=problems,
        contact_set=contact_set,
        clearance=clearance == "links",
        loads=loads,
        friction_safety=friction_safety,
        joint_compliance=joint_compliance,
        paper=paper,
        squeeze=squeeze,
        protocol=protocol,
        firmness=firmness,
        starts=starts,
        enough=enough,
        time_limit_s=60.0 if time_limit is None and cpu_limit is None else time_limit,
        cpu_limit_s=cpu_limit,
        errors=errors,
        table=table,
    )
    console = Console()
    with progress("problems") as on_progress:
        summary = run_study(settings, out, workers, on_progress)
    if summary.interrupted:
        click.echo(f"{summary.done} of {summary.total} problems done: {out / 'results'}")
        click.echo("stopped; run the same command again to go on", err=True)
        sys.exit(INTERRUPTED)
    rows = load_study(out)
    write_study(out, rows, settings)
    _print_study(console, rows, settings)
    failed = [row.message for row in rows if row.message is not None]
    if failed:
        text = f"{len(failed)} of {len(rows)} problems gave no answer and count as not found, the first: {failed[0]}"
        console.print(text, highlight=False, markup=False)
    console.print(f"wrote {out / 'study.html'}, study.md, results/*.parquet and figures", highlight=False)


def _print_study(console: Console, rows: Sequence[StudyRow], settings: StudySettings) -> None:
    """Print the tables of the page."""
    from ..studies.survival_tables import CERTIFICATE_COLUMNS, SURVIVAL_COLUMNS, certificate_rows, survival_rows
    from ..studies.synergy_study_page import (
        COUNT_COLUMNS,
        MARGIN_COLUMNS,
        REST_COLUMNS,
        count_rows,
        prediction_rows,
        rest_rows,
    )

    tables = [
        (COUNT_COLUMNS, count_rows(rows, settings)),
        (REST_COLUMNS, rest_rows(rows, settings)),
        (MARGIN_COLUMNS, prediction_rows(rows)),
    ]
    if settings.errors:
        tables += [
            (SURVIVAL_COLUMNS, survival_rows(rows, settings)),
            (CERTIFICATE_COLUMNS, certificate_rows(rows)),
        ]
    for columns, texts in tables:
        table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
        for column in columns:
            table.add_column(column.replace("[", "\\["), justify="right")
        for row in texts:
            table.add_row(*(text.replace("[", "\\[") for text in row))
        console.print(table)
