"""Running the paper's tables and the trade-off between F and C, with one seed for all."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..grasp.grasp import Grasp
from ..hand.hand import Hand
from ..model.task_direction import force_task
from ..objects import Cylinder
from ..planning.planner import plan_grasp
from ..planning.ranking import feasible_rank
from ..planning.starts import GraspStart
from ..problem.clearance_options import ClearanceOptions
from ..problem.parameters import GraspParameters
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from .paper_tables import DIRECTIONS, PAPER_CELLS, PaperCell

PARETO_RATIOS = tuple(np.logspace(-9, 0, 20).tolist())
"""Ratios w_F/w_C of the trade-off curve."""
PARETO_SYNERGIES = 3
"""Number of synergies of the trade-off curve, as in table II."""


@dataclass(frozen=True)
class CellResult:
    """One cell, planned.

    Attributes:
        cell: The paper's cell.
        grasp: Our grasp.
    """

    cell: PaperCell
    grasp: Grasp

    def row(self) -> dict[str, object]:
        """Return the cell as a row of plain values; the contract of ``reproduce.json``."""
        grasp, search = self.grasp, self.grasp.search
        assert search is not None
        angle, degenerate = grasp.alignments[0]
        return {
            "table": self.cell.table,
            "direction": self.cell.direction,
            "n_synergies": self.cell.n_synergies,
            "weight_ratio": self.cell.weight_ratio,
            "feasible": grasp.feasible,
            "force_norm": grasp.force_norm,
            "force_norm_floor": _finite(grasp.force_norm_floor),
            "task_index": grasp.task_index,
            "alignment_angle_deg": _finite(angle),
            "alignment_degenerate": degenerate,
            "iterations": search.iterations,
            "phase_one_iterations": search.phase_one_iterations,
            "starts_tried": search.starts_tried,
            "starts_feasible": search.starts_feasible,
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


def cell_problem(
    hand: Hand, cell: PaperCell, synergy_set: str | None, torque_model: str, clearance: bool
) -> GraspProblem:
    """Return the problem of a cell: the paper's cylinder, parameters and weights.

    Args:
        hand: The hand.
        cell: The cell.
        synergy_set: Synergy set; the hand's default if None.
        torque_model: ``total`` or ``internal`` (the paper's eq. 33).
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
        clearance=ClearanceOptions() if clearance else ClearanceOptions.off(),
    )


def run_cells(
    hand: Hand,
    *,
    seed: int,
    options: PlannerOptions,
    synergy_set: str | None = None,
    torque_model: str = "total",
    clearance: bool = False,
    progress: Callable[[CellResult], None] | None = None,
) -> list[CellResult]:
    """Plan every cell of tables I and II from the standard start, seeded ones, and the grasp with fewer synergies.

    Args:
        hand: The hand.
        seed: Seed of every cell.
        options: Search options of every cell.
        synergy_set: Synergy set; the hand's default if None.
        torque_model: ``total`` or ``internal``.
        clearance: Whether links keep clear.
        progress: Called after every cell.

    Returns:
        Results in the order of the paper's cells.
    """
    results: list[CellResult] = []
    for cell in PAPER_CELLS:
        problem = cell_problem(hand, cell, synergy_set, torque_model, clearance)
        grasp = plan_grasp(problem, seed=seed, options=options)
        same = [result for result in results if result.cell.table == cell.table == 1]
        for fewer in (result for result in same if result.cell.direction == cell.direction):
            grasp = _better(grasp, _continued(fewer.grasp, problem, seed, options))
        results.append(CellResult(cell, grasp))
        if progress is not None:
            progress(results[-1])
    return results


def pareto_front(
    hand: Hand,
    *,
    seed: int,
    options: PlannerOptions,
    synergy_set: str | None = None,
    torque_model: str = "total",
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
        torque_model: ``total`` or ``internal``.
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


def _continued(grasp: Grasp, problem: GraspProblem, seed: int, options: PlannerOptions) -> Grasp:
    """Solve a problem from a grasp with fewer synergies, which is one of its own as far as posture goes."""
    delta_sigma = np.zeros(problem.n_synergies)
    delta_sigma[: grasp.problem.n_synergies] = grasp.delta_sigma
    start = GraspStart(grasp.joint_angles, grasp.palm_pose, delta_sigma)
    return plan_grasp(problem, seed=seed, options=replace(options, starts=1, phase_one=False), start=start)


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
    return replace(chosen, search=report)


def _weighted(problem: GraspProblem, ratio: float) -> GraspProblem:
    """Return the problem with w_F/w_C set."""
    return replace(problem, parameters=replace(problem.parameters, force_weight=ratio, task_weight=1.0))


def _best_for(pool: list[Grasp], ratio: float) -> Grasp:
    """Return the grasp of the pool with the least ratio · F + C."""
    return min(pool, key=lambda grasp: ratio * grasp.force_norm + grasp.task_index)


def _finite(value: float) -> float | None:
    """Return a finite number, or None."""
    return value if math.isfinite(value) else None
