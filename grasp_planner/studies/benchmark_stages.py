"""The stages of a search, measured one by one: batches of starts, growth with what is asked, the way to an optimum."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from ..grasp.grasp import Grasp
from ..multistart.pool import Pool
from ..multistart.problem_rows import BatchedProblem
from ..multistart.states import States
from ..objects import MeshObject, parse_object
from ..optimisation.kkt import kkt_residual
from ..optimisation.newton import solve_newton
from ..optimisation.nlp import NlpSolution, solve_nlp
from ..planning.attempt import Attempt, AttemptSolver
from ..planning.planner import plan_grasp, plan_grasps
from ..planning.pooled_starts import pooled_starts, random_states
from ..problem.clearance_options import ClearanceOptions
from ..problem.load_cases import LoadCases
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from .benchmark import fastest, plan_cases
from .benchmark_problems import BenchmarkCase

WIDTHS = (1, 16, 64, 256)
"""Starts in a batch."""
ROUNDS = 4
"""Starts of a measured pool, as a multiple of its width."""
REPEATS = 5
"""Evaluations of a batch; the fastest counts."""
SEVERAL, TRIED = 16, 200
"""Different grasps of a problem from which the best is taken, and the most starts they may take."""
MOST_STARTS, NEARLY = 10, 1e-2
"""Starts from which phase two is tried, and the largest scaled violation of one that it is measured from."""
CELLS, FINER = 100, 0.5
"""Cells of a usual grid along the longest side of a mesh, and the size of the finer grid's cells against them."""


@dataclass(frozen=True)
class BatchSpeed:
    """Cost of a batch of starts, processor time of one core.

    Attributes:
        asked: What the problem asks for: ``plain``, ``links``, ``links, loads``, ``three contacts`` or a mesh.
        width: Starts in the batch.
        evaluation_us: Time of an evaluation of all rows with their derivatives, per start [µs].
        iteration_us: Time of an iteration of phase one, its solve and the refilling included, per start [µs].
        found: Starts that became feasible, of those taken.
        taken: Starts taken.
        ms_per_found: Time per feasible start [ms]; not a number if none became so.
    """

    asked: str
    width: int
    evaluation_us: float
    iteration_us: float
    found: int
    taken: int
    ms_per_found: float


@dataclass(frozen=True)
class SolverRun:
    """Phase two from one start by one solver.

    Attributes:
        iterations: Its iterations.
        residual: What the best multipliers leave of the objective's gradient at its end.
        objective: The scaled objective there.
        violation: Largest scaled violation there.
        seconds: Processor time [s].
    """

    iterations: int
    residual: float
    objective: float
    violation: float
    seconds: float


@dataclass(frozen=True)
class OptimalitySpeed:
    """Phase two from the same start by both solvers.

    Attributes:
        slsqp: By SLSQP.
        newton: By SLSQP roughly, then with second derivatives.
        verification_ms: Processor time of judging the grasp [ms].
    """

    slsqp: SolverRun
    newton: SolverRun
    verification_ms: float


@dataclass(frozen=True)
class Found:
    """Grasps of a problem, each judged feasible; not a number where there are none.

    Attributes:
        seconds: Processor time until they were there [s].
        force: F of the one that takes the least [N].
    """

    seconds: float
    force: float


@dataclass(frozen=True)
class GraspTimes:
    """Grasps of a problem.

    Attributes:
        point: The first grasp as phase one found it.
        first: The first grasp that phase two is through with.
        several: 16 different grasps as phase one found them.
    """

    point: Found
    first: Found
    several: Found


@dataclass(frozen=True)
class Throughput:
    """Problems planned in a time, by the clock.

    Attributes:
        solver: What solved phase two.
        enough: Feasible grasps asked of each problem.
        workers: Worker processes.
        problems: Problems planned.
        feasible: Feasible grasps found.
        seconds: Time it took, processes started before [s].
    """

    solver: str
    enough: int
    workers: int
    problems: int
    feasible: int
    seconds: float


def batch_speed(asked: str, problem: GraspProblem, width: int) -> BatchSpeed:
    """Measure a batch of random starts of a problem.

    Args:
        asked: What it asks for, as text.
        problem: A problem whose forces come from springs.
        width: Starts in the batch.
    """
    rng = np.random.default_rng(0)
    batched = BatchedProblem(problem)

    def make(number: int) -> States:
        return random_states(batched, number, rng)

    evaluation = fastest(batched.rows, [make(width) for _ in range(REPEATS)], clock=time.process_time)
    pool = Pool(batched, width)
    began = time.process_time()
    found = sum(1 for _ in pool.search(make, ROUNDS * width, lambda: None))
    spent = time.process_time() - began
    return BatchSpeed(
        asked=asked,
        width=width,
        evaluation_us=1e6 * evaluation / width,
        iteration_us=1e6 * spent / max(pool.count.evaluations, 1),
        found=found,
        taken=pool.count.starts,
        ms_per_found=1e3 * spent / found if found else float("nan"),
    )


def batch_speeds(hand: str, n_synergies: int, widths: Sequence[int] = WIDTHS) -> Iterator[BatchSpeed]:
    """Measure batches of all widths, and how the widest one grows with what is asked.

    Args:
        hand: Hand by name or description file.
        n_synergies: n_s.
        widths: Starts in the batches, the widest last.

    Yields:
        Plain problems of all widths; then, of the widest, links, load cases, fewer contacts, and a mesh with two grids.
    """
    case = BenchmarkCase(0, n_synergies, hand, clearance=True, loads=True)
    full = case.problem()
    plain = replace(full, clearance=ClearanceOptions.off(), loads=LoadCases.off())
    for width in widths:
        yield batch_speed("plain", plain, width)
    three = tuple(frame.name for frame in full.frames[:3])
    mesh = replace(case, object_kind="mesh-wrist").problem()
    thing = mesh.grasp_object
    assert isinstance(thing, MeshObject)
    fine = parse_object(f"{thing.text},resolution={FINER * thing.loaded.longest_side / CELLS:.2g}")
    grown = {
        "three contacts": replace(plain, contacts=three),
        "links": replace(full, loads=LoadCases.off()),
        "links, loads": full,
        "mesh, links, loads": mesh,
        "mesh of half the cells, links, loads": replace(mesh, grasp_object=fine),
    }
    for asked, problem in grown.items():
        yield batch_speed(asked, problem, widths[-1])


def optimality_speed(case: BenchmarkCase) -> OptimalitySpeed | None:
    """Solve phase two of a random problem by both solvers from the first start that comes so far; None if none does.

    Args:
        case: The problem.
    """
    problem, options = case.problem(), PlannerOptions()
    solver = AttemptSolver(problem, options, None, lambda: None)
    starts = islice(pooled_starts(problem, np.random.default_rng(case.seed)), MOST_STARTS)
    attempts = (Attempt.at(index, problem, start) for index, start in enumerate(starts))
    attempt = next((each for each in attempts if solver.prepare(each) and each.merit < NEARLY), None)
    if attempt is None:
        return None
    program = solver.program_of(attempt, "two")

    def run(solve: Callable[..., NlpSolution]) -> SolverRun:
        began = time.process_time()
        solution = solve(program, attempt.z, max_iterations=options.max_iterations)
        spent, z = time.process_time() - began, solution.z
        end = program.point(z)
        return SolverRun(
            iterations=solution.iterations,
            residual=kkt_residual(program, z),
            objective=end.objective,
            violation=float(end.violation.max(initial=0.0)),
            seconds=spent,
        )

    slsqp, newton = run(solve_nlp), run(solve_newton)
    copies = [attempt.grasp(0, options) for _ in range(REPEATS)]  # a grasp is judged once
    verification = fastest(lambda fresh: fresh.feasible, copies, clock=time.process_time)
    return OptimalitySpeed(slsqp, newton, verification_ms=1e3 * verification)


def grasp_times(case: BenchmarkCase) -> GraspTimes:
    """Measure how long grasps of a random problem take.

    Args:
        case: The problem.
    """
    problem, options = case.problem(), PlannerOptions(enough=1)
    points = PlannerOptions(enough=1, solver="none", starts=TRIED)

    def found(plan: Callable[[], Sequence[Grasp]], least: int = 1) -> Found:
        began = time.process_time()
        grasps = [grasp for grasp in plan() if grasp.feasible]
        if len(grasps) < least:
            return Found(float("nan"), float("nan"))
        return Found(time.process_time() - began, min(grasp.force_norm for grasp in grasps))

    return GraspTimes(
        point=found(lambda: [plan_grasp(problem, seed=case.seed, options=points)]),
        first=found(lambda: [plan_grasp(problem, seed=case.seed, options=options)]),
        several=found(lambda: plan_grasps(problem, SEVERAL, seed=case.seed, options=points), SEVERAL),
    )


def throughput(
    cases: Sequence[BenchmarkCase], workers: int, *, solver: str, enough: int, cpu_limit_s: float
) -> Throughput:
    """Measure how many problems a second are planned.

    Args:
        cases: The problems; the first of them are planned once more, before the clock starts.
        workers: Worker processes.
        solver: What solves phase two.
        enough: Feasible grasps after which a search ends.
        cpu_limit_s: Processor time for each [s].
    """
    warm = [*cases[:workers], *cases]
    answers = plan_cases(warm, cpu_limit_s=cpu_limit_s, enough=enough, workers=workers, solver=solver)
    for _ in range(workers):
        next(answers)
    began = time.perf_counter()
    found = sum(result.starts_feasible for result in answers)
    return Throughput(solver, enough, workers, len(cases), found, time.perf_counter() - began)
