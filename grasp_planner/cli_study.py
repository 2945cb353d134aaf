"""``grasp-planner study-synergies``: success in simulation against the number of synergies, as a page with plots."""

from __future__ import annotations

from pathlib import Path

import click
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import track
from rich.table import Table

from .cli_options import parse_counts
from .simulate import PROTOCOLS
from .simulate.engine import load_mujoco


@click.command("study-synergies")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True, help="Folder; goes on there.")
@click.option("--hand", default="dlr_hit_ii_right", show_default=True, help="Hand by name, or a description file.")
@click.option("--sets", default="native", show_default=True, help="Synergy sets, separated by commas.")
@click.option("--counts", default="1-15", show_default=True, help="Numbers of synergies, such as 1-5,15.")
@click.option("--problems", type=int, default=20, show_default=True, help="Random problems for each set and number.")
@click.option("--contact-set", default=None, help="Contact set [default: the hand's first].")
@click.option("--clearance", type=click.Choice(["links", "none"]), default="none", show_default=True)
@click.option("--squeeze", type=float, default=1.0, show_default=True, help="Factor on the plans' δσ.")
@click.option("--protocol", type=click.Choice(tuple(PROTOCOLS)), default="plan", show_default=True)
@click.option("--starts", type=int, default=40, show_default=True, help="Most starts of each search.")
@click.option("--time-limit", type=float, default=60.0, show_default=True, help="Longest search [s].")
@click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="Worker processes.")
def study_synergies(
    out: Path,
    hand: str,
    sets: str,
    counts: str,
    problems: int,
    contact_set: str | None,
    clearance: str,
    squeeze: float,
    protocol: str,
    starts: int,
    time_limit: float,
    workers: int,
) -> None:
    """Plan random problems, simulate the grasps, and write a page: what holds, and which static margin predicts it."""
    from .synergy_study import StudySettings, run_study
    from .synergy_study_page import COUNT_COLUMNS, MARGIN_COLUMNS, count_rows, margin_rows, write_study

    load_mujoco()
    settings = StudySettings(
        hand=hand,
        synergy_sets=tuple(name.strip() for name in sets.split(",")),
        counts=parse_counts("counts", counts),
        problems=problems,
        contact_set=contact_set,
        clearance=clearance == "links",
        squeeze=squeeze,
        protocol=protocol,
        starts=starts,
        time_limit_s=time_limit,
    )
    console = Console()
    rows = list(track(run_study(settings, out, workers), "problems", total=len(settings.cases), console=console))
    write_study(out, rows, settings)
    for columns, texts in ((COUNT_COLUMNS, count_rows(rows, settings)), (MARGIN_COLUMNS, margin_rows(rows))):
        table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
        for column in columns:
            table.add_column(column, justify="right")
        for row in texts:
            table.add_row(*row)
        console.print(table)
    console.print(f"wrote {out / 'study.html'}, study.md, rows.jsonl and figures", highlight=False)
