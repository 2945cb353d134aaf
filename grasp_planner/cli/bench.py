"""``grasp-planner bench``: measure evaluations per second, and success and time on random problems."""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import track
from rich.table import Table

from ..checks import positive_whole
from ..exceptions import InvalidValueError
from ..problem.search_options import SOLVERS
from .options import parse_counts, parse_names
from .output import check_writable, write_or_print

if TYPE_CHECKING:
    from ..studies.benchmark import EvaluationSpeed, ProblemResult
    from ..studies.benchmark_problems import BenchmarkCase

Group = tuple[str, str, int]
"""Synergy set, kind of object, n_s."""


@click.command()
@click.option("--hand", default="dlr_hit_ii_right", show_default=True, help="Hand by name, or a description file.")
@click.option("--synergies", default="3,5,15", show_default=True, help="Numbers of synergies.")
@click.option("--synergy-sets", default="default", show_default=True, help="Synergy sets, or 'default'.")
@click.option("--objects", default="cylinder", show_default=True, help="Kinds of random objects, or 'all'.")
@click.option("--contact-set", default=None, help="Contact set [default: the hand's].")
@click.option("--clearance", type=click.Choice(["none", "links"]), default="none", show_default=True)
@click.option("--loads/--no-loads", default=False, help="Whether the standard load cases have to be held.")
@click.option("--problems", type=int, default=100, show_default=True, help="Random problems for each combination.")
@click.option("--enough", type=int, default=2, show_default=True, help="Feasible grasps after which a search ends.")
@click.option(
    "--solver", type=click.Choice(SOLVERS), default=SOLVERS[0], show_default=True, help="What solves phase two."
)
@click.option("--cpu-limit", type=float, default=10.0, show_default=True, help="Processor time for a problem [s].")
@click.option("--workers", type=int, default=1, show_default=True, help="Worker processes.")
@click.option(
    "--stages",
    is_flag=False,
    flag_value="all",
    default=None,
    metavar="[NAMES]",
    help="Measure stages of the search one by one: batches, optima, grasps, throughput, several with commas, or all.",
)
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write every result as JSON.")
def bench(
    hand: str,
    synergies: str,
    synergy_sets: str,
    objects: str,
    contact_set: str | None,
    clearance: str,
    loads: bool,
    problems: int,
    enough: int,
    solver: str,
    cpu_limit: float,
    workers: int,
    stages: str | None,
    json_file: Path | None,
) -> None:
    """Benchmark the planner: speed of an evaluation, and seeded random problems, each planned with one call.

    A problem is a random object (cylinders of 20-45 mm radius, spheres of 25-45 mm, boxes of 40-80 mm, ...) of
    200 g with a random force direction. Lists are separated by commas; every combination is run.
    """
    from ..studies import benchmark
    from ..studies.benchmark_problems import BenchmarkCase, object_kinds

    for name, value in (("problems", problems), ("workers", workers), ("enough", enough)):
        positive_whole(name, value)
    if not cpu_limit > 0.0:
        raise InvalidValueError("cpu-limit", cpu_limit, "a number > 0 [s]")
    check_writable(json_file)
    counts = parse_counts("synergies", synergies)
    kinds = object_kinds(parse_names(objects))
    groups: list[Group] = list(itertools.product(parse_names(synergy_sets), kinds, counts))
    links = clearance == "links"

    def case(seed: int, synergy_set: str, kind: str, n_s: int) -> BenchmarkCase:
        chosen = None if synergy_set == "default" else synergy_set
        return BenchmarkCase(seed, n_s, hand, kind, chosen, contact_set, links, loads)

    for group in groups:
        case(0, *group).problem()  # mistakes show before the first search
    if stages is not None:
        from .bench_stages import stage_names

        chosen = stage_names(parse_names(stages))
    console = Console()
    speeds = [benchmark.evaluation_speed(hand, n_s, clearance=on) for n_s in counts for on in {False, links}]
    console.print(_speed_table(speeds))
    if stages is not None:
        from .bench_stages import print_stages

        for group in groups:
            own = [case(seed, *group) for seed in range(problems)]
            print_stages(console, own, chosen, kinematics_ms=speeds[0].kinematics_ms, cpu_limit_s=cpu_limit)
        return
    cases = [case(seed, *group) for group in groups for seed in range(problems)]
    solved = benchmark.plan_cases(cases, cpu_limit_s=cpu_limit, enough=enough, workers=workers, solver=solver)
    results = list(track(solved, "random problems", total=len(cases), console=console))
    by_group = {group: results[i * problems : (i + 1) * problems] for i, group in enumerate(groups)}
    console.print(_summary_table(by_group))
    if json_file is not None:
        report = {
            "machine": benchmark.machine(),
            "evaluation": benchmark.as_rows(speeds),
            "summary": [
                {"synergy_set": name, "object": kind, "n_synergies": n_s, **benchmark.summarise(rows)}
                for (name, kind, n_s), rows in by_group.items()
            ],
            "problems": benchmark.as_rows(results),
        }
        write_or_print(json.dumps(report, indent=1) + "\n", json_file)


def _speed_table(speeds: Sequence[EvaluationSpeed]) -> Table:
    """Return the table of evaluation speeds."""
    table = Table(title="one full evaluation with all derivatives")
    for column in ("n_s", "clearance", "median \\[ms]", "evaluations/s", "bare kinematics \\[ms]", "ratio"):
        table.add_column(column, justify="right")
    for speed in speeds:
        table.add_row(
            str(speed.n_synergies),
            "links" if speed.clearance else "none",
            f"{speed.median_ms:.3f}",
            f"{1e3 / speed.median_ms:.0f}",
            f"{speed.kinematics_ms:.3f}",
            f"{speed.ratio:.1f}",
        )
    return table


def _summary_table(by_group: dict[Group, list[ProblemResult]]) -> Table:
    """Return the table of success and medians."""
    from ..studies.benchmark import summarise

    table = Table(title="random problems, one call each; medians over the feasible", box=SIMPLE_HEAD, pad_edge=False)
    columns = (
        "set",
        "object",
        "n_s",
        "feasible",
        "starts",
        "it.",
        "cpu \\[s]",
        "F \\[N]",
        "angle \\[°]",
        "overlap \\[mm]",
    )
    for column in columns:
        table.add_column(column, justify="right")
    for (name, kind, n_s), rows in by_group.items():
        summary = summarise(rows)
        medians = (
            f"{summary['median_phase_one_iterations']:.0f} + {summary['median_iterations']:.0f}",
            f"{summary['median_cpu_s']:.1f}",
            f"{summary['median_force_norm']:.2f}",
            f"{summary['median_angle_deg']:.1f}",
            f"{1e3 * summary['max_penetration']:.3f}",
        )
        table.add_row(
            name,
            kind,
            str(n_s),
            f"{summary['feasible']:.0f}/{summary['problems']:.0f}",
            f"{100 * summary['start_success_share']:.0f} %",
            *(medians if summary["feasible"] else "–" * len(medians)),
        )
    return table
