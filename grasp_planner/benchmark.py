"""How fast and how reliable planning is, measured: evaluations per second, time and success on random problems."""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from multiprocessing import get_context

import numpy as np
import pinocchio as pin

from .hand import Hand, load_hand
from .objects import Cylinder
from .planner import PlannerOptions, plan_grasp
from .problem import GraspParameters, GraspProblem
from .starts import random_start
from .state import StateEvaluator
from .task import force_task

RADIUS_RANGE = (0.020, 0.045)
"""Radii of the random cylinders [m]."""


@dataclass(frozen=True)
class EvaluationSpeed:
    """Cost of one full evaluation with all derivatives.

    Attributes:
        n_synergies: n_s.
        median_ms: Median time of a full evaluation [ms].
        kinematics_ms: Median time of Pinocchio's bare kinematics of the same state [ms]: forward kinematics,
            joint and frame Jacobians, and kinematic Hessians of the contact frames.
        ratio: Their ratio.
    """

    n_synergies: int
    median_ms: float
    kinematics_ms: float
    ratio: float


@dataclass(frozen=True)
class ProblemResult:
    """One random problem, planned with one call.

    Attributes:
        seed: Seed of the problem and of its starts.
        n_synergies: n_s.
        radius: Radius of the cylinder [m].
        direction: Task direction.
        feasible: Whether every violation, recomputed, is below 1e-6 in SI units.
        max_violation: The largest of them.
        iterations: Iterations of phase two from the start that gave the grasp.
        phase_one_iterations: Iterations of its phase one.
        evaluations: Evaluations over all starts.
        starts_tried: Starts tried.
        starts_feasible: Starts that ended feasible.
        force_norm: F [N].
        force_norm_floor: Floor of F at the contacts [N].
        angle_deg: Angle between task and ellipsoid [degrees].
        time_s: Wall time of the call [s].
        time_per_grasp_s: Wall time per feasible start [s].
    """

    seed: int
    n_synergies: int
    radius: float
    direction: tuple[float, float, float]
    feasible: bool
    max_violation: float
    iterations: int
    phase_one_iterations: int
    evaluations: int
    starts_tried: int
    starts_feasible: int
    force_norm: float
    force_norm_floor: float
    angle_deg: float
    time_s: float
    time_per_grasp_s: float


def random_problem(hand: Hand, seed: int, n_synergies: int) -> GraspProblem:
    """Return a random problem: a cylinder of 20–45 mm radius and a random force direction.

    Args:
        hand: The hand.
        seed: Seed.
        n_synergies: n_s.

    Returns:
        The problem, with the paper's parameters.
    """
    rng = np.random.default_rng(seed)
    cylinder = Cylinder(radius=float(rng.uniform(*RADIUS_RANGE)))
    return GraspProblem(
        hand, cylinder, (force_task(rng.normal(size=3)),), n_synergies, GraspParameters(force_weight=1e-6)
    )


def evaluation_speed(hand: Hand, n_synergies: int, *, states: int = 50, repeats: int = 20) -> EvaluationSpeed:
    """Measure full evaluations against bare kinematics at random states.

    Args:
        hand: The hand.
        n_synergies: n_s.
        states: Number of random states.
        repeats: Evaluations of each; the fastest counts.

    Returns:
        Medians over the states.
    """
    rng = np.random.default_rng(0)
    problem = random_problem(hand, 0, n_synergies)
    full, bare = [], []
    for _ in range(states):
        start = random_start(problem, rng)
        evaluator = StateEvaluator(problem, start.palm_pose)
        x = evaluator.pack(start.joint_angles, start.palm_pose, rng.normal(0.0, 1e-4, n_synergies))
        kinematics = _bare_kinematics(problem, start.joint_angles)
        full.append(_fastest(partial(evaluator.evaluate, x), repeats))
        bare.append(_fastest(kinematics, repeats))
    median, kinematics_ms = 1e3 * statistics.median(full), 1e3 * statistics.median(bare)
    return EvaluationSpeed(n_synergies, median, kinematics_ms, median / kinematics_ms)


def plan_random_problem(hand_name: str, seed: int, n_synergies: int) -> ProblemResult:
    """Plan one random problem with one call and the standard options.

    Args:
        hand_name: Hand by name or description file.
        seed: Seed of the problem and of the planner.
        n_synergies: n_s.

    Returns:
        The result.
    """
    problem = random_problem(load_hand(hand_name), seed, n_synergies)
    grasp = plan_grasp(problem, seed=seed, options=PlannerOptions())
    search = grasp.search
    assert search is not None
    cylinder = problem.grasp_object
    assert isinstance(cylinder, Cylinder)
    return ProblemResult(
        seed=seed,
        n_synergies=n_synergies,
        radius=cylinder.radius,
        direction=tuple(problem.tasks[0].direction[:3].tolist()),
        feasible=grasp.feasible,
        max_violation=max(grasp.violations.values()),
        iterations=search.iterations,
        phase_one_iterations=search.phase_one_iterations,
        evaluations=search.evaluations,
        starts_tried=search.starts_tried,
        starts_feasible=search.starts_feasible,
        force_norm=grasp.force_norm,
        force_norm_floor=grasp.force_norm_floor,
        angle_deg=grasp.alignments[0][0],
        time_s=search.time_s,
        time_per_grasp_s=search.time_s / max(search.starts_feasible, 1),
    )


def plan_random_problems(hand_name: str, counts: Sequence[int], problems: int, workers: int) -> Iterator[ProblemResult]:
    """Plan random problems for several numbers of synergies, in worker processes.

    Args:
        hand_name: Hand by name or description file.
        counts: Numbers of synergies.
        problems: Problems for each.
        workers: Worker processes.

    Yields:
        Results in a fixed order.
    """
    cases = [(seed, n_s) for n_s in counts for seed in range(problems)]
    if workers <= 1:
        for seed, n_s in cases:
            yield plan_random_problem(hand_name, seed, n_s)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        seeds, synergies = zip(*cases, strict=True)
        yield from pool.map(plan_random_problem, [hand_name] * len(cases), seeds, synergies)


def summarise(results: Sequence[ProblemResult], n_synergies: int) -> dict[str, float]:
    """Return success and medians over the feasible results of one number of synergies."""
    mine = [result for result in results if result.n_synergies == n_synergies]
    found = [result for result in mine if result.feasible]
    summary: dict[str, float] = {"problems": len(mine), "feasible": len(found)}
    for name in ("iterations", "starts_tried", "time_s", "time_per_grasp_s", "force_norm", "angle_deg"):
        values = [float(getattr(result, name)) for result in found]
        summary[f"median_{name}"] = statistics.median(values) if values else float("nan")
    tried = sum(result.starts_tried for result in mine)
    summary["start_success_share"] = sum(result.starts_feasible for result in mine) / max(tried, 1)
    return summary


def machine() -> dict[str, str | int | None]:
    """Return what the numbers were measured on."""
    return {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
        "pinocchio": pin.__version__,
        "numpy": np.__version__,
    }


def as_rows(results: Sequence[ProblemResult | EvaluationSpeed]) -> list[dict[str, object]]:
    """Return results as plain dictionaries."""
    return [asdict(result) for result in results]


def _fastest(function: Callable[[], object], repeats: int) -> float:
    """Return the shortest time of a call [s]."""
    best = float("inf")
    for _ in range(repeats):
        began = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - began)
    return best


def _bare_kinematics(problem: GraspProblem, q: np.ndarray) -> Callable[[], None]:
    """Return a call of Pinocchio's kinematics for the contact frames: FK, Jacobians, kinematic Hessians."""
    model, frames = problem.hand.model, problem.frames
    data, full = model.createData(), problem.hand.full_configuration(q)

    def kinematics() -> None:
        pin.computeJointJacobians(model, data, full)
        pin.updateFramePlacements(model, data)
        pin.computeJointKinematicHessians(model, data, full)
        for frame in frames:
            pin.getFrameJacobian(model, data, frame.frame_id, pin.LOCAL_WORLD_ALIGNED)
            pin.getJointKinematicHessian(model, data, frame.joint_id, pin.LOCAL_WORLD_ALIGNED)

    return kinematics
