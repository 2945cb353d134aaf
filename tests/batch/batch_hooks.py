"""Planners for tests of the machinery, where planning itself is beside the point; workers import them by name."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

from grasp_planner import Grasp, GraspProblem, PlannerOptions, standard_start
from grasp_planner.grasp.search_report import SearchReport

BAD_SEED = 3


def quick(problem: GraspProblem, *, seed: int, options: PlannerOptions) -> Grasp:
    """Return the standard start, whatever it is worth."""
    start = standard_start(problem)
    angles = start.joint_angles + 1e-3 * seed
    return Grasp(problem, angles, start.palm_pose, start.delta_sigma, search=SearchReport(seed, time_s=0.001))


def slow(problem: GraspProblem, *, seed: int, options: PlannerOptions) -> Grasp:
    """Take a little time."""
    time.sleep(0.05)
    return quick(problem, seed=seed, options=options)


def hangs(problem: GraspProblem, *, seed: int, options: PlannerOptions) -> Grasp:
    """Hang on one seed."""
    while seed == BAD_SEED:
        time.sleep(1.0)
    return quick(problem, seed=seed, options=options)


def ends_in_any_way(problem: GraspProblem, *, seed: int, options: PlannerOptions) -> Grasp:
    """End as the seed says: die, die the first time only, hang, take all memory, raise, or answer."""
    marker = Path(os.environ["BATCH_TEST_MARKER"])
    first = seed == 2 and not marker.exists()
    if first:
        marker.touch()
    if seed == 1 or first:
        os.kill(os.getpid(), signal.SIGKILL)
    if seed == BAD_SEED:
        return hangs(problem, seed=seed, options=options)
    if seed == 4:
        kept = []
        while len(kept) < 50:  # never more than 2.5 GB, should nobody stop it
            kept.append(b"1" * 50_000_000)
            time.sleep(0.05)
    if seed == 5:
        raise RuntimeError("on purpose")
    return quick(problem, seed=seed, options=options)
