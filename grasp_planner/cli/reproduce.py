"""``grasp-planner reproduce``: the paper's tables and figures, beside ours."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from ..hand.loading import load_hand
from ..problem.search_options import PlannerOptions
from ..studies.paper_tables import PAPER_CELLS
from ..studies.reproduce import PARETO_RATIOS, CellResult, ParetoPoint, fair_sets, pareto_front, run_cells
from .options import parse_names


@click.command()
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), help="Write JSON, pages and figures there.")
@click.option("--hand", default="dlr_hit_ii_right", show_default=True, help="Hand by name, or a description file.")
@click.option(
    "--synergy-sets",
    default=None,
    help="Synergy sets [default: human ones, then one made for the hand; with clearance the hand's for that].",
)
@click.option(
    "--clearance",
    type=click.Choice(["none", "links"]),
    default="none",
    show_default=True,
    help="Whether links keep clear (Remarks 1 and 2); the paper's tables are without.",
)
@click.option("--torque-model", type=click.Choice(["total", "internal"]), default="internal", show_default=True)
@click.option("--starts", type=int, default=60, show_default=True, help="Most starts for each cell.")
@click.option("--enough", type=int, default=8, show_default=True, help="Feasible starts after which a cell is done.")
@click.option(
    "--single-runs",
    type=click.IntRange(min=0),
    default=20,
    show_default=True,
    help="Single runs of each cell.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of every cell.")
def reproduce(
    out: Path | None,
    hand: str,
    synergy_sets: str | None,
    clearance: str,
    torque_model: str,
    starts: int,
    enough: int,
    single_runs: int,
    seed: int,
) -> None:
    """Plan tables I and II of [Mavrogiannis2014] and print paper and ours, cell by cell.

    Every cell starts from the same infeasible point without contact, then from seeded random ones.
    """
    from ..studies.reproduce_page import by_synergies, page_notes, write_reproduction

    console = Console()
    loaded = load_hand(hand)
    names = parse_names(synergy_sets) if synergy_sets is not None else fair_sets(loaded, clearance=clearance == "links")
    options = PlannerOptions(starts=starts, enough=enough, max_iterations=200)
    with Progress(console=console, transient=True) as progress:
        bar = progress.add_task("cells", total=len(names) * len(PAPER_CELLS) + (len(PARETO_RATIOS) if out else 0))

        def step(_: CellResult | ParetoPoint) -> None:
            progress.advance(bar)

        run: dict[str, Any] = {
            "hand": loaded,
            "seed": seed,
            "options": options,
            "torque_model": torque_model,
            "clearance": clearance == "links",
            "progress": step,
        }
        cells = [cell for name in names for cell in run_cells(**run, synergy_set=name, single_runs=single_runs)]
        front = pareto_front(**run, synergy_set=names[0]) if out else []
    for group in by_synergies(cells):
        console.print(_table(group))
    console.print(page_notes(cells), style="dim")
    if out is not None:
        settings = f"{loaded.description.title}; torque model {torque_model}; clearance {clearance}"
        write_reproduction(out, cells, front, seed=seed, settings=settings)
        console.print(f"wrote {out / 'reproduce.json'}, reproduce.md, reproduce.html and figures")


def _table(cells: Sequence[CellResult]) -> Table:
    """Return the comparison as a table."""
    from ..studies.reproduce_page import COLUMNS, set_title, table_cells

    table = Table(title=set_title(cells), title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0), pad_edge=False)
    for column in COLUMNS:
        table.add_column(column, justify="right")
    for cell in cells:
        table.add_row(*table_cells(cell))
    return table
