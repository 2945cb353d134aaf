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


def dies(problem: GraspProblem, *, seed: int, options: PlannerOptions) -> Grasp:
    """End the process on one seed, always."""
    if seed == BAD_SEED:
        os.kill(os.getpid(), signal.SIGKILL)
    return quick(problem, seed=seed, options=options)


def dies_once(problem: GraspProblem, *, seed: int, options: PlannerOptions) -> Grasp:
    """End the process on one seed, the first time."""
    marker = Path(os.environ["BATCH_TEST_MARKER"])
    if seed == BAD_SEED and not marker.exists():
        marker.touch()
        os._exit(9)
    return quick(problem, seed=seed, options=options)


def fails(problem: GraspProblem, *, seed: int, options: PlannerOptions) -> Grasp:
    """Raise on one seed."""
    if seed == BAD_SEED:
        raise RuntimeError("on purpose")
    return quick(problem, seed=seed, options=options)
