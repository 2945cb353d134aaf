"""How fast and how reliable planning is, measured: evaluations per second, time and success on random problems."""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin

from ..evaluation.state import StateEvaluator
from ..planning.planner import plan_grasp
from ..planning.starts import random_start
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from ..processes import JobContext, JobFunction, answers_in_order
from .benchmark_problems import BenchmarkCase

STARTS_EACH = 4
"""Starts for each grasp that is asked for, where the planner's own limit would be less."""
APART = 1e-7
"""How far apart the states of one measurement are, in every variable."""


@dataclass(frozen=True)
class EvaluationSpeed:
    """Cost of one full evaluation with all derivatives.

    Attributes:
        n_synergies: n_s.
        clearance: Whether it includes the clearances of links.
        median_ms: Median time of a full evaluation [ms].
        kinematics_ms: Median time of Pinocchio's bare kinematics of the same state [ms]: forward kinematics,
            joint and frame Jacobians, and kinematic Hessians of the contact frames.
        ratio: Their ratio.
    """

    n_synergies: int
    clearance: bool
    median_ms: float
    kinematics_ms: float
    ratio: float


@dataclass(frozen=True)
class ProblemResult:
    """One random problem, planned with one call.

    Attributes:
        case: The problem.
        object: The object as text.
        direction: Task direction.
        feasible: Whether every violation, recomputed, is below 1e-6 in SI units.
        max_violation: The largest of them.
        penetration: Deepest overlap of links with the object or with each other by coal on the exact geometry, but
            for pairs that are meant to overlap [m].
        iterations: Iterations of phase two from the start that gave the grasp.
        phase_one_iterations: Iterations of its phase one.
        evaluations: Evaluations over all starts, preparation included.
        starts_tried: Starts tried.
        starts_feasible: Starts that ended feasible.
        force_norm: F [N].
        force_norm_floor: Floor of F at the contacts [N].
        angle_deg: Angle between task and ellipsoid [degrees].
        cpu_s: Processor time of the call on one core [s].
        cpu_per_grasp_s: Processor time per feasible start [s].
    """

    case: BenchmarkCase
    object: str
    direction: tuple[float, float, float]
    feasible: bool
    max_violation: float
    penetration: float
    iterations: int
    phase_one_iterations: int
    evaluations: int
    starts_tried: int
    starts_feasible: int
    force_norm: float
    force_norm_floor: float
    angle_deg: float
    cpu_s: float
    cpu_per_grasp_s: float


def evaluation_speed(
    hand: str, n_synergies: int, *, clearance: bool = False, states: int = 50, repeats: int = 20
) -> EvaluationSpeed:
    """Measure full evaluations against bare kinematics at random states.

    Args:
        hand: Hand by name or description file.
        n_synergies: n_s.
        clearance: Whether links keep clear.
        states: Number of random states.
        repeats: Evaluations of each; the fastest counts.

    Returns:
        Medians over the states.
    """
    rng = np.random.default_rng(0)
    problem = BenchmarkCase(0, n_synergies, hand, clearance=clearance).problem()
    full, bare = [], []
    for _ in range(states):
        start = random_start(problem, rng)
        evaluator = StateEvaluator(problem, start.palm_pose)
        x = evaluator.pack(start.joint_angles, start.palm_pose, rng.normal(0.0, 1e-4, n_synergies))
        kinematics = _bare_kinematics(problem, start.joint_angles)
        # Every time another state: what follows from the posture alone is kept as long as that is the same.
        full.append(fastest(evaluator.evaluate, x + APART * np.arange(repeats)[:, None]))
        bare.append(fastest(kinematics, [None] * repeats))
    median, kinematics_ms = 1e3 * statistics.median(full), 1e3 * statistics.median(bare)
    return EvaluationSpeed(n_synergies, clearance, median, kinematics_ms, median / kinematics_ms)


def plan_case(case: BenchmarkCase, cpu_limit_s: float, enough: int, solver: str = "slsqp") -> ProblemResult:
    """Plan one random problem with one call.

    Args:
        case: The problem.
        cpu_limit_s: Processor time after which the search ends with what it has [s].
        enough: Feasible grasps after which it ends.
        solver: What solves phase two.

    Returns:
        The result.
    """
    problem, options = case.problem(), PlannerOptions(enough=enough, solver=solver)
    began = time.process_time()
    grasp = plan_grasp(
        problem,
        seed=case.seed,
        options=replace(options, starts=max(options.starts, STARTS_EACH * enough)),
        cancel=lambda: time.process_time() - began > cpu_limit_s,
    )
    cpu_s = time.process_time() - began
    search = grasp.search
    assert search is not None
    return ProblemResult(
        case=case,
        object=str(problem.grasp_object),
        direction=tuple(problem.tasks[0].direction[:3].tolist()),
        feasible=grasp.feasible,
        max_violation=grasp.max_violation,
        penetration=max(grasp.overlap("link_object"), grasp.overlap("self_collision")),
        iterations=search.iterations,
        phase_one_iterations=search.phase_one_iterations,
        evaluations=search.evaluations,
        starts_tried=search.starts_tried,
        starts_feasible=search.starts_feasible,
        force_norm=grasp.force_norm,
        force_norm_floor=grasp.force_norm_floor,
        angle_deg=grasp.alignments[0][0],
        cpu_s=cpu_s,
        cpu_per_grasp_s=cpu_s / max(search.starts_feasible, 1),
    )


def plan_cases(
    cases: Sequence[BenchmarkCase], *, cpu_limit_s: float, enough: int, workers: int, solver: str = "slsqp"
) -> Iterator[ProblemResult]:
    """Plan random problems, in worker processes if there is more than one.

    Args:
        cases: The problems.
        cpu_limit_s: Processor time for each [s].
        enough: Feasible grasps after which a search ends.
        workers: Worker processes.
        solver: What solves phase two.

    Yields:
        Results in the order of the cases.
    """
    if workers <= 1:
        yield from (plan_case(case, cpu_limit_s, enough, solver) for case in cases)
        return
    settings = {"cpu_limit_s": cpu_limit_s, "enough": enough, "solver": solver}
    function = JobFunction(f"{__name__}:case_benchmark", settings)
    yield from answers_in_order(function, cases, workers)


def case_benchmark(
    cpu_limit_s: float, enough: int, solver: str
) -> Callable[[BenchmarkCase, JobContext], ProblemResult]:
    """Return what answers a job of the benchmark, in the worker process."""
    return lambda case, _: plan_case(case, cpu_limit_s, enough, solver)


def summarise(results: Sequence[ProblemResult]) -> dict[str, float]:
    """Return success, the deepest penetration and medians over the feasible results."""
    found = [result for result in results if result.feasible]
    summary: dict[str, float] = {"problems": len(results), "feasible": len(found)}
    for name in ("iterations", "phase_one_iterations", "cpu_s", "cpu_per_grasp_s", "force_norm", "angle_deg"):
        values = [float(getattr(result, name)) for result in found]
        summary[f"median_{name}"] = statistics.median(values) if values else float("nan")
    summary["max_penetration"] = max((result.penetration for result in found), default=float("nan"))
    tried = sum(result.starts_tried for result in results)
    summary["start_success_share"] = sum(result.starts_feasible for result in results) / max(tried, 1)
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


def fastest(
    function: Callable[[Any], object], arguments: Iterable[Any], clock: Callable[[], float] = time.perf_counter
) -> float:
    """Return the shortest time of a call with one of the arguments [s].

    Args:
        function: What is called.
        arguments: What with, once each.
        clock: What tells the time [s].
    """
    best = float("inf")
    for argument in arguments:
        began = clock()
        function(argument)
        best = min(best, clock() - began)
    return best


def _bare_kinematics(problem: GraspProblem, q: np.ndarray) -> Callable[[object], None]:
    """Return a call of Pinocchio's kinematics for the contact frames: FK, Jacobians, kinematic Hessians."""
    model, frames = problem.hand.model, problem.frames
    data, full = model.createData(), problem.hand.full_configuration(q)

    def kinematics(_: object) -> None:
        pin.computeJointJacobians(model, data, full)
        pin.updateFramePlacements(model, data)
        pin.computeJointKinematicHessians(model, data, full)
        for frame in frames:
            pin.getFrameJacobian(model, data, frame.frame_id, pin.LOCAL_WORLD_ALIGNED)
            pin.getJointKinematicHessian(model, data, frame.joint_id, pin.LOCAL_WORLD_ALIGNED)

    return kinematics
