"""The last step of a default search: joints are taken off their stops where the task does not suffer.

A joint on its stop has no motion left to squeeze with, yet the best task often lies exactly there. So the best task is
sought once more with every range shorter at both ends, from the grasp that was found.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..grasp.grasp import Grasp
from ..optimisation.nlp import solve_nlp
from .attempt import WORTH_POLISHING
from .phase_one import polish
from .program import GraspProgram, joint_bounds
from .ranking import serves_nearly

STOP_RESERVE = math.radians(2.1)
"""How far from its stops a joint is held [rad]: two degrees, and a little that a last correction may take."""
MORE_COST = 2.0
"""Factor by which the objective may grow for a free joint."""
MORE_FORCE = 1e-4
"""Share of F by which a last correction may leave its bound."""
MORE_SLIP = 2e-4
"""How much farther a finger may slide while the hand closes [m]."""
MOST_ITERATIONS, TOLERANCE = 60, 1e-4
"""How long, and to what accuracy, the task is sought off the stops: what is found differs little, or not at all."""
ROUNDING = 1e-3
"""Share of the reserve that counts as rounding."""


def off_stops(grasp: Grasp, most_force: float, check: Callable[[], None], *, closing: bool) -> Grasp:
    """Return a grasp with its joints off their stops, or the grasp itself where that costs too much.

    Args:
        grasp: A feasible grasp of a problem without weights.
        most_force: F that the best task may take [N].
        check: Called at every iteration; may raise to stop.
        closing: Whether a grasp that closes from an open hand has to go on doing so as surely.

    Returns:
        A feasible grasp near it with no joint within two degrees of a stop, F within the bound, every task within
        five degrees of what it was and the objective at most twice as large; the grasp itself if none was found, or
        none is needed.
    """
    if kept_reserve(grasp) > 0.0:
        return grasp
    bound = max(most_force, grasp.force_norm)
    try:
        moved = _sought(grasp, bound, check)
    except (ValueError, FloatingPointError, np.linalg.LinAlgError):
        return grasp  # no optimum on the way there
    kept = moved.feasible and kept_reserve(moved) > 0.0 and moved.force_norm <= bound * (1.0 + MORE_FORCE)
    if not kept or not serves_nearly(moved, grasp, MORE_COST):
        return grasp
    return grasp if closing and not _closes_as_surely(moved, grasp) else moved


def _closes_as_surely(moved: Grasp, grasp: Grasp) -> bool:
    """Return whether a grasp closes no worse than another one: with fingers that hardly slide more."""
    after, before = moved.closing, grasp.closing
    if not before.holds:
        return True
    steady = after.holds_free or not before.holds_free
    return after.holds and steady and float(after.slip.max()) <= float(before.slip.max()) + MORE_SLIP


def _sought(grasp: Grasp, most_force: float, check: Callable[[], None]) -> Grasp:
    """Return where the search for the best task ends with every range shorter at both ends."""
    program = GraspProgram(grasp.problem, grasp.palm_pose)
    start = program.pack(grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma, grasp.contact_forces)
    z = solve_nlp(
        program.build("two", program.objective_scale(start), most_force, reserve=STOP_RESERVE),
        start,
        max_iterations=MOST_ITERATIONS,
        tolerance=TOLERANCE,
        callback=lambda _: check(),
    ).z
    moved = program.grasp(z, grasp.search)
    if moved.feasible or program.merit(z) >= WORTH_POLISHING:
        return moved
    return program.grasp(polish(program, z, check), grasp.search)


def kept_reserve(grasp: Grasp) -> float:
    """Return the reserve before their stops that all joints of a grasp keep [rad]: all of it or 0; 0 with weights.

    A joint with a short range keeps less, see :func:`~grasp_planner.planning.program.joint_bounds`.
    """
    if grasp.problem.parameters.weighted:
        return 0.0
    lower, upper = joint_bounds(grasp.problem.hand, (1.0 - ROUNDING) * STOP_RESERVE)
    q = grasp.joint_angles
    return STOP_RESERVE if bool(np.all((q >= lower) & (q <= upper))) else 0.0
