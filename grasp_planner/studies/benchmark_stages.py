"""The stages of a search, measured one by one: batches of starts, growth with what is asked, the way to an optimum."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..analysis.kkt import kkt_point
from ..analysis.optimality_program import OptimalityProgram
from ..multistart.pool import Pool
from ..multistart.problem_rows import BatchedProblem
from ..multistart.states import States
from ..objects import MeshObject, parse_object
from ..planning.planner import plan_grasp
from ..planning.pooled_starts import random_states
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
class OptimalitySpeed:
    """What is left to an optimum where a search ends, and the way there by second derivatives.

    Attributes:
        iterations: Iterations of the search's phases of least force and best task.
        stationarity: |∇f − Σ λ ∇c| / |∇f| with the best multipliers where the search ended.
        newton_iterations: Steps to the optimum by convex quadratic programs with second derivatives.
        newton_stationarity: The same measure there.
        gain: Part of the objective that these steps took off.
        search_s: Processor time of the search until its first grasp [s].
        newton_s: Processor time of these steps [s].
        verification_ms: Processor time of judging the grasp [ms].
    """

    iterations: int
    stationarity: float
    newton_iterations: int
    newton_stationarity: float
    gain: float
    search_s: float
    newton_s: float
    verification_ms: float


@dataclass(frozen=True)
class Throughput:
    """Problems planned in a time, by the clock.

    Attributes:
        workers: Worker processes.
        problems: Problems planned.
        feasible: Feasible grasps found.
        seconds: Time it took, processes started before [s].
    """

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
    """Plan a random problem and go on to the optimum by second derivatives; None if no grasp was found.

    Args:
        case: The problem.
    """
    began = time.process_time()
    grasp = plan_grasp(case.problem(), seed=case.seed, options=PlannerOptions(enough=1))
    search_s = time.process_time() - began
    copies = [replace(grasp, search=grasp.search) for _ in range(REPEATS)]  # a grasp is judged once
    verification = fastest(lambda fresh: fresh.feasible, copies, clock=time.process_time)
    if not grasp.feasible or grasp.search is None:
        return None
    program = OptimalityProgram(grasp)
    before = kkt_point(program.evaluate, program.z, iterations=0)
    began = time.process_time()
    after = kkt_point(program.evaluate, program.z)
    return OptimalitySpeed(
        iterations=grasp.search.iterations,
        stationarity=before.stationarity,
        newton_iterations=after.iterations,
        newton_stationarity=after.stationarity,
        gain=1.0 - after.point.objective / before.point.objective,
        search_s=search_s,
        newton_s=time.process_time() - began,
        verification_ms=1e3 * verification,
    )


def throughput(cases: Sequence[BenchmarkCase], workers: int, *, enough: int, cpu_limit_s: float) -> Throughput:
    """Measure how many problems a second are planned.

    Args:
        cases: The problems; the first of them are planned once more, before the clock starts.
        workers: Worker processes.
        enough: Feasible grasps after which a search ends.
        cpu_limit_s: Processor time for each [s].
    """
    warm = [*cases[:workers], *cases]
    answers = plan_cases(warm, cpu_limit_s=cpu_limit_s, enough=enough, workers=workers)
    for _ in range(workers):
        next(answers)
    began = time.perf_counter()
    found = sum(result.starts_feasible for result in answers)
    return Throughput(workers, len(cases), found, time.perf_counter() - began)
