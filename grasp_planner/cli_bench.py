"""``grasp-planner bench``: measure evaluations per second, and success and time on random problems."""

from __future__ import annotations

import json
from pathlib import Path

import click
from rich.console import Console
from rich.progress import track
from rich.table import Table

from .exceptions import FileFormatError, InvalidValueError

NUMBERS_OF_SYNERGIES = (3, 5, 15)


@click.command()
@click.option("--hand", default="dlr_hit_ii_right", show_default=True, help="Hand by name, or a description file.")
@click.option(
    "--problems", type=int, default=100, show_default=True, help="Random problems for each number of synergies."
)
@click.option(
    "--workers", type=int, default=1, show_default=True, help="Worker processes; timings are cleanest with 1."
)
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write every result as JSON.")
def bench(hand: str, problems: int, workers: int, json_file: Path | None) -> None:
    """Benchmark the planner: speed of an evaluation, and 3 x N random problems.

    The random problems are cylinders of 20–45 mm radius with a random force direction, for 3, 5 and 15
    synergies, each planned with one call.
    """
    from . import benchmark
    from .hand import load_hand

    for name, value in (("problems", problems), ("workers", workers)):
        if value < 1:
            raise InvalidValueError(name, value, "a whole number >= 1")
    if json_file is not None and not json_file.parent.is_dir():
        raise FileFormatError(json_file, f"can't be written: no folder {json_file.parent}")
    console = Console()
    loaded = load_hand(hand)
    speeds = [benchmark.evaluation_speed(loaded, n_s) for n_s in NUMBERS_OF_SYNERGIES]
    table = Table(title="one full evaluation with all derivatives")
    for column in ("n_s", "median [ms]", "evaluations/s", "bare kinematics [ms]", "ratio"):
        table.add_column(column, justify="right")
    for speed in speeds:
        table.add_row(
            str(speed.n_synergies),
            f"{speed.median_ms:.3f}",
            f"{1e3 / speed.median_ms:.0f}",
            f"{speed.kinematics_ms:.3f}",
            f"{speed.ratio:.1f}",
        )
    console.print(table)
    iterator = benchmark.plan_random_problems(hand, NUMBERS_OF_SYNERGIES, problems, workers)
    total = problems * len(NUMBERS_OF_SYNERGIES)
    results = list(track(iterator, "random problems", total=total, console=console))
    summaries = {n_s: benchmark.summarise(results, n_s) for n_s in NUMBERS_OF_SYNERGIES}
    console.print(_summary_table(summaries))
    if json_file is not None:
        report = {
            "machine": benchmark.machine(),
            "evaluation": benchmark.as_rows(speeds),
            "summary": {str(n_s): summary for n_s, summary in summaries.items()},
            "problems": benchmark.as_rows(results),
        }
        json_file.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def _summary_table(summaries: dict[int, dict[str, float]]) -> Table:
    """Return the table of success and medians."""
    table = Table(title="random problems, one call each")
    columns = (
        "n_s",
        "feasible",
        "starts feasible",
        "iterations",
        "time/call [s]",
        "time/grasp [s]",
        "F [N]",
        "angle [°]",
    )
    for column in columns:
        table.add_column(column, justify="right")
    for n_s, summary in summaries.items():
        table.add_row(
            str(n_s),
            f"{summary['feasible']:.0f}/{summary['problems']:.0f}",
            f"{100 * summary['start_success_share']:.0f} %",
            f"{summary['median_iterations']:.0f}",
            f"{summary['median_time_s']:.2f}",
            f"{summary['median_time_per_grasp_s']:.2f}",
            f"{summary['median_force_norm']:.2f}",
            f"{summary['median_angle_deg']:.2f}",
        )
    return table
