"""``grasp-planner bench --stages``: the stages of a search one by one."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import track
from rich.table import Table

from ..checks import known_names

if TYPE_CHECKING:
    from ..studies.benchmark_problems import BenchmarkCase
    from ..studies.benchmark_stages import BatchSpeed, GraspTimes, OptimalitySpeed, SolverRun, Throughput

STAGES = ("batches", "optima", "grasps", "throughput")
"""Stages that can be measured."""
OPTIMAL = 1e-6
"""Stationarity below which a grasp counts as an optimum."""
RATES = (("slsqp", 1), ("none", 1), ("none", 16), ("none", 64))
"""Solvers, and grasps asked of each problem, whose throughput is measured."""
WORKERS = (1, 2)
"""Worker processes whose throughput is measured."""


def stage_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return names of stages; ``all`` alone stands for all of them.

    Raises:
        NameNotFoundError: If there is no such stage.
    """
    return known_names("stage", names, STAGES)


def print_stages(
    console: Console,
    cases: Sequence[BenchmarkCase],
    stages: Sequence[str],
    *,
    kinematics_ms: float,
    cpu_limit_s: float,
) -> None:
    """Measure and print batches of starts, the way to an optimum, times until there are grasps, and throughput.

    Args:
        console: Where to.
        cases: Random problems of one group.
        stages: Which of them.
        kinematics_ms: Time of bare kinematics, which batches are compared with [ms].
        cpu_limit_s: Processor time for each search [s].
    """
    from ..studies.benchmark_stages import batch_speeds, grasp_times, optimality_speed, throughput

    hand, n_s, kind = cases[0].hand, cases[0].n_synergies, cases[0].object_kind
    console.print(f"{hand}, {n_s} synergies, {kind}")
    if "batches" in stages:
        console.print(_batch_table(list(batch_speeds(hand, n_s)), kinematics_ms))
    if "optima" in stages:
        found = [optimality_speed(case) for case in track(cases, "optima", console=console)]
        console.print(_optimality_table([each for each in found if each is not None]))
    if "grasps" in stages:
        console.print(_times_table([grasp_times(case) for case in track(cases, "grasps", console=console)]))
    if "throughput" in stages:
        rates = [
            throughput(cases, workers, solver=solver, enough=enough, cpu_limit_s=cpu_limit_s)
            for solver, enough in RATES
            for workers in WORKERS
        ]
        console.print(_throughput_table(rates))


def _batch_table(speeds: Sequence[BatchSpeed], kinematics_ms: float) -> Table:
    """Return the table of batches."""
    table = _table(
        "a batch of random starts, processor time per start",
        "asked",
        "starts",
        "evaluation \\[µs]",
        "× bare kinematics",
        "iteration \\[µs]",
        "feasible",
        "ms per feasible",
    )
    for speed in speeds:
        table.add_row(
            speed.asked,
            str(speed.width),
            f"{speed.evaluation_us:.0f}",
            f"{1e-3 * speed.evaluation_us / kinematics_ms:.2g}",
            f"{speed.iteration_us:.0f}",
            f"{speed.found}/{speed.taken}",
            f"{speed.ms_per_found:.0f}" if speed.found else "–",
        )
    return table


def _optimality_table(found: Sequence[OptimalitySpeed]) -> Table:
    """Return the table of phase two by both solvers."""
    table = _table(
        f"phase two from the same {len(found)} starts; medians", "", "SLSQP", "with second derivatives", "Newton/SLSQP"
    )
    if not found:
        return table
    runs = [each.slsqp for each in found], [each.newton for each in found]

    def row(heading: str, name: str, form: str, *, ratio: bool = False) -> None:
        first, second = (statistics.median(getattr(run, name) for run in each) for each in runs)
        table.add_row(heading, format(first, form), format(second, form), f"{second / first:.2g}" if ratio else "")

    row("iterations", "iterations", ".0f", ratio=True)
    row("left of the gradient", "residual", ".1g")
    table.add_row(f"below {OPTIMAL:g}", *(str(sum(run.residual < OPTIMAL for run in each)) for each in runs))
    row("largest violation", "violation", ".1g")
    row("processor time \\[s]", "seconds", ".3f", ratio=True)
    table.add_row("objective more than 1 % worse", *(str(_worse(*pair)) for pair in (runs, runs[::-1])))
    table.add_row("judging a grasp \\[ms]", f"{statistics.median(each.verification_ms for each in found):.1f}")
    return table


def _worse(mine: Sequence[SolverRun], theirs: Sequence[SolverRun]) -> int:
    """Return how often an objective, of order one at the start, is more than 1 % (and 1e-4) above another."""
    return sum(
        a.objective - b.objective > max(0.01 * abs(b.objective), 1e-4) for a, b in zip(mine, theirs, strict=True)
    )


def _times_table(times: Sequence[GraspTimes]) -> Table:
    """Return the table of processor times until there are grasps, and of the force they take."""
    columns = "", "median \\[s]", "longest \\[s]", "least F, median \\[N]", "found"
    table = _table("different grasps: processor time, and the least F of one", *columns)
    names = {"one, no solver": "point", "one, SLSQP": "first", "16, no solver": "several"}
    for heading, name in names.items():
        found = [one for each in times if not math.isnan((one := getattr(each, name)).seconds)]
        cells = ["–", "–", "–"]
        if found:
            spent, forces = [one.seconds for one in found], [one.force for one in found]
            cells = [f"{value:.2f}" for value in (statistics.median(spent), max(spent), statistics.median(forces))]
        table.add_row(heading, *cells, f"{len(found)}/{len(times)}")
    return table


def _throughput_table(rates: Sequence[Throughput]) -> Table:
    """Return the table of problems a second."""
    columns = "solver", "grasps asked", "workers", "problems/s", "feasible grasps/s", "of workers times one worker"
    table = _table("throughput by the clock", *columns)
    alone: dict[tuple[str, int], float] = {}
    for rate in rates:
        spent = rate.seconds * rate.workers
        share = alone.setdefault((rate.solver, rate.enough), spent) / spent
        each = (rate.problems / rate.seconds, rate.feasible / rate.seconds)
        table.add_row(
            rate.solver, str(rate.enough), str(rate.workers), *(f"{a:.1f}" for a in each), f"{100 * share:.0f} %"
        )
    return table


def _table(title: str, *columns: str) -> Table:
    """Return a narrow table of numbers."""
    table = Table(title=title, box=SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        table.add_column(column, justify="right")
    return table
