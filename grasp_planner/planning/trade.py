"""What a task is served with against how much force it takes: the front of grasps of which none is better in both.

The grasps that a search found are on it or behind it. From the best of them the bound of F is moved up and down, and
the best task sought anew at each: a front of one family of postures, beside which another search may find others.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from threadpoolctl import threadpool_limits

from ..grasp.grasp import Grasp
from ..optimisation.nlp import solve_nlp
from .off_stops import kept_reserve
from .program import GraspProgram

FACTORS = (1.1, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
"""Bounds of F that are tried, in multiples of the least F found."""
ITERATIONS, TOLERANCE = 80, 1e-8
"""How long the best task is sought at a bound."""
SERVED = 15.0
"""Angle between a task and its ellipsoid up to which it counts as served [degrees]."""
WORTH_TELLING = 10.0
"""By how many degrees more force has to serve a task better to be worth telling."""


def task_angle(grasp: Grasp) -> float:
    """Return the angle between the first task and its ellipsoid's longest axis [degrees]; 180 where there is none."""
    angle = grasp.alignments[0][0]
    return angle if math.isfinite(angle) else 180.0


def trade_front(grasps: Iterable[Grasp]) -> tuple[Grasp, ...]:
    """Return the feasible grasps of which no other has both less F and a smaller angle, by rising F."""
    front: list[Grasp] = []
    for grasp in sorted(
        (each for each in grasps if each.feasible), key=lambda each: (each.force_norm, task_angle(each))
    ):
        if not front or task_angle(grasp) < task_angle(front[-1]):
            front.append(grasp)
    return tuple(front)


def traded_grasps(grasp: Grasp) -> tuple[Grasp, ...]:
    """Return grasps near a planned one with less and with more force, each with the best task that was found there.

    Args:
        grasp: A feasible grasp.

    Returns:
        Feasible grasps; not all bounds have one.
    """
    search = grasp.search
    least = grasp.force_norm if search is None or search.least_force is None else search.least_force
    bounds = [factor * least for factor in FACTORS]
    more = [bound for bound in bounds if bound > grasp.force_norm]
    less = [bound for bound in reversed(bounds) if bound <= grasp.force_norm]
    program = GraspProgram(grasp.problem, grasp.palm_pose)
    first = program.pack(grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma, grasp.contact_forces)
    scale, reserve, found = program.objective_scale(first), kept_reserve(grasp), []
    with threadpool_limits(limits=1):
        for side in (more, less):
            z = first
            for bound in side:
                nlp = program.build("two", scale, bound, reserve=reserve)
                try:
                    there = solve_nlp(nlp, z, max_iterations=ITERATIONS, tolerance=TOLERANCE).z
                except (ValueError, FloatingPointError, np.linalg.LinAlgError):
                    break  # astray: G has lost rank or forces overflow
                moved = program.grasp(there, search)
                if moved.feasible:
                    found.append(moved)
                    z = there
    return tuple(found)


def trade_text(front: tuple[Grasp, ...], chosen: Grasp) -> str | None:
    """Say what a badly served task costs, as ``34° at 17 N, 67° at 3 N``; None where it is served or nothing is better.

    Args:
        front: The front, by rising F.
        chosen: The grasp that was chosen.
    """
    if not front or task_angle(chosen) <= SERVED:
        return None
    best = front[-1]
    if task_angle(chosen) - task_angle(best) < WORTH_TELLING:
        return None
    return ", ".join(f"{task_angle(each):.0f}° at {each.force_norm:.2g} N" for each in (best, chosen))
