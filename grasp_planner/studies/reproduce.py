"""Running the paper's tables and the trade-off between F and C, with one seed for all."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..grasp.grasp import Grasp, IterationRecord
from ..hand.hand import Hand
from ..model.task_direction import force_task
from ..objects import Cylinder
from ..planning.planner import plan_grasp
from ..planning.ranking import feasible_rank
from ..planning.starts import GraspStart, random_start
from ..problem.clearance_options import ClearanceOptions
from ..problem.parameters import GraspParameters
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from .paper_tables import DIRECTIONS, PAPER_CELLS, PaperCell

PARETO_RATIOS = tuple(np.logspace(-9, 0, 20).tolist())
"""Ratios w_F/w_C of the trade-off curve."""
PARETO_SYNERGIES = 3
"""Number of synergies of the trade-off curve, as in table II."""
FAIR_SETS = ("santello", "uji", "native_apart")
"""Sets to put beside the paper's, human ones first; of those made by planning, one that never saw such a cylinder."""


@dataclass(frozen=True)
class SingleRuns:
    """Single runs of the search, each from one random infeasible point.

    Attributes:
        tried: How many.
        feasible: How many ended feasible.
    """

    tried: int = 0
    feasible: int = 0


@dataclass(frozen=True)
class CellResult:
    """One cell, planned.

    Attributes:
        cell: The paper's cell.
        grasp: Our grasp, the best of several starts.
        all_iterations: Iterations of both phases over all starts.
        single: How single runs end.
    """

    cell: PaperCell
    grasp: Grasp
    all_iterations: int = 0
    single: SingleRuns = SingleRuns()

    @property
    def angle(self) -> float | None:
        """Angle between task and ellipsoid [degrees]; None where the ellipsoid has no longest axis."""
        angle, degenerate = self.grasp.alignments[0]
        return None if degenerate or not math.isfinite(angle) else angle

    def row(self) -> dict[str, object]:
        """Return the cell as a row of plain values; the contract of ``reproduce.json``."""
        grasp, search = self.grasp, self.grasp.search
        assert search is not None
        return {
            "table": self.cell.table,
            "direction": self.cell.direction,
            "n_synergies": self.cell.n_synergies,
            "weight_ratio": self.cell.weight_ratio,
            "feasible": grasp.feasible,
            "force_norm": grasp.force_norm,
            "force_norm_floor": _finite(grasp.force_norm_floor),
            "task_index": grasp.task_index,
            "alignment_angle_deg": self.angle,
            "iterations": search.iterations,
            "phase_one_iterations": search.phase_one_iterations,
            "all_iterations": self.all_iterations,
            "starts_tried": search.starts_tried,
            "starts_feasible": search.starts_feasible,
            "single_runs": self.single.tried,
            "single_runs_feasible": self.single.feasible,
            "time_s": search.time_s,
            "max_violation": grasp.max_violation,
            "synergy_set": grasp.problem.synergies.name,
            "paper": {
                "force_norm": self.cell.force_norm,
                "alignment_angle_deg": self.cell.alignment_angle_deg,
                "iterations": self.cell.iterations,
            },
        }


@dataclass(frozen=True)
class ParetoPoint:
    """One point of the trade-off curve.

    Attributes:
        weight_ratio: w_F/w_C.
        grasp: The best grasp found for it.
    """

    weight_ratio: float
    grasp: Grasp


def fair_sets(hand: Hand, *, clearance: bool = False) -> tuple[str, ...]:
    """Return the hand's sets to put beside the paper's; its default one if it has none of them, or with clearance."""
    found = () if clearance else tuple(name for name in FAIR_SETS if name in hand.synergy_set_names)
    default = hand.description.synergies.default_for(clearance)
    return found or ((hand.synergies().name,) if default is None else (default,))


def cell_problem(
    hand: Hand, cell: PaperCell, synergy_set: str | None, torque_model: str, clearance: bool
) -> GraspProblem:
    """Return the problem of a cell: the paper's cylinder, parameters and weights.

    Args:
        hand: The hand.
        cell: The cell.
        synergy_set: Synergy set; the hand's default if None.
        torque_model: ``internal`` (the paper's eq. 33) or ``total``.
        clearance: Whether Remarks 1 and 2 hold on the hand's real geometry.

    Returns:
        The problem, with the paper's point fingertips.
    """
    return GraspProblem.paper(
        hand=hand,
        grasp_object=Cylinder(radius=0.03, height=0.15, mass=0.2),
        tasks=(force_task(DIRECTIONS[cell.direction]),),
        n_synergies=cell.n_synergies,
        parameters=GraspParameters(
            force_weight=cell.weight_ratio,
            task_weight=1.0,
            torque_model=torque_model,  # type: ignore[arg-type]  # checked by the parameters
        ),
        synergy_set=synergy_set,
        contact_set="point",
        clearance=ClearanceOptions(remark1=True) if clearance else ClearanceOptions.off(),
    )


def run_cells(
    hand: Hand,
    *,
    seed: int,
    options: PlannerOptions,
    synergy_set: str | None = None,
    torque_model: str = "internal",
    clearance: bool = False,
    single_runs: int = 0,
    progress: Callable[[CellResult], None] | None = None,
) -> list[CellResult]:
    """Plan every cell of tables I and II from the standard start, seeded ones, and the grasp with fewer synergies.

    Args:
        hand: The hand.
        seed: Seed of every cell.
        options: Search options of every cell.
        synergy_set: Synergy set; the hand's default if None.
        torque_model: ``internal`` or ``total``.
        clearance: Whether links keep clear.
        single_runs: Single runs of each cell beside.
        progress: Called after every cell.

    Returns:
        Results in the order of the paper's cells.
    """
    results: list[CellResult] = []
    for cell in PAPER_CELLS:
        problem = cell_problem(hand, cell, synergy_set, torque_model, clearance)
        iterations: list[IterationRecord] = []
        search = partial(plan_grasp, problem, seed=seed, callback=iterations.append)
        grasp = search(options=options)
        same = [result for result in results if result.cell.table == cell.table == 1]
        for fewer in (result for result in same if result.cell.direction == cell.direction):
            start = _continued(fewer.grasp, problem)
            grasp = _better(grasp, search(options=replace(options, starts=1, phase_one=False), start=start))
        single = _run_singly(problem, seed, options, single_runs)
        results.append(CellResult(cell, grasp, len(iterations), single))
        if progress is not None:
            progress(results[-1])
    return results


def pareto_front(
    hand: Hand,
    *,
    seed: int,
    options: PlannerOptions,
    synergy_set: str | None = None,
    torque_model: str = "internal",
    clearance: bool = False,
    progress: Callable[[ParetoPoint], None] | None = None,
) -> list[ParetoPoint]:
    """Trace F against C over the ratio of weights, for the y task with three synergies.

    Whether a grasp is feasible does not depend on the weights, so every feasible grasp found for one ratio is a
    candidate for all: each ratio is re-solved from the best candidate, upwards and downwards.

    Args:
        hand: The hand.
        seed: Seed of the search.
        options: Search options.
        synergy_set: Synergy set; the hand's default if None.
        torque_model: ``internal`` or ``total``.
        clearance: Whether links keep clear.
        progress: Called after every ratio.

    Returns:
        One point for each ratio for which a feasible grasp was found, by rising ratio.
    """
    cell = PaperCell(2, "y", PARETO_SYNERGIES, 1.0, 0, 0, 0)
    base = cell_problem(hand, cell, synergy_set, torque_model, clearance)
    pool: list[Grasp] = []
    for ratio in PARETO_RATIOS[:: len(PARETO_RATIOS) // 4]:
        grasp = plan_grasp(_weighted(base, ratio), seed=seed, options=options)
        if grasp.feasible:
            pool.append(grasp)
    single = replace(options, starts=1, phase_one=False)
    for ratio in (*PARETO_RATIOS, *reversed(PARETO_RATIOS)):
        if not pool:
            break
        best = _best_for(pool, ratio)
        start = GraspStart(best.joint_angles, best.palm_pose, best.delta_sigma)
        grasp = plan_grasp(_weighted(base, ratio), seed=seed, options=single, start=start)
        if grasp.feasible:
            pool.append(grasp)
    points = [ParetoPoint(ratio, _best_for(pool, ratio)) for ratio in PARETO_RATIOS if pool]
    for point in points:
        if progress is not None:
            progress(point)
    return points


def _run_singly(problem: GraspProblem, seed: int, options: PlannerOptions, count: int) -> SingleRuns:
    """Run the search from random infeasible points, once from each."""
    rng = np.random.default_rng(seed)
    once = replace(options, starts=1, enough=1)
    runs = [plan_grasp(problem, seed=seed, options=once, start=random_start(problem, rng)) for _ in range(count)]
    return SingleRuns(count, sum(grasp.feasible for grasp in runs))


def _continued(grasp: Grasp, problem: GraspProblem) -> GraspStart:
    """Return the start at a grasp with fewer synergies, which is one of the problem's own as far as posture goes."""
    delta_sigma = np.zeros(problem.n_synergies)
    delta_sigma[: grasp.problem.n_synergies] = grasp.delta_sigma
    return GraspStart(grasp.joint_angles, grasp.palm_pose, delta_sigma)


def _better(grasp: Grasp, other: Grasp) -> Grasp:
    """Return the better of two grasps of one problem, with the efforts of both searches."""
    ours, theirs = grasp.search, other.search
    assert ours is not None
    assert theirs is not None
    chosen = min((grasp, other), key=lambda each: (False, *feasible_rank(each)) if each.feasible else (True,))
    assert chosen.search is not None
    report = replace(
        chosen.search,
        starts_tried=ours.starts_tried + theirs.starts_tried,
        starts_feasible=ours.starts_feasible + theirs.starts_feasible,
        evaluations=ours.evaluations + theirs.evaluations,
        time_s=ours.time_s + theirs.time_s,
    )
    return chosen.with_search(report)


def _weighted(problem: GraspProblem, ratio: float) -> GraspProblem:
    """Return the problem with w_F/w_C set."""
    return replace(problem, parameters=replace(problem.parameters, force_weight=ratio, task_weight=1.0))


def _best_for(pool: list[Grasp], ratio: float) -> Grasp:
    """Return the grasp of the pool with the least ratio · F + C."""
    return min(pool, key=lambda grasp: ratio * grasp.force_norm + grasp.task_index)


def _finite(value: float) -> float | None:
    """Return a finite number, or None."""
    return value if math.isfinite(value) else None
