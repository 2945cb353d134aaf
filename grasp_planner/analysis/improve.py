"""Improvement: from a planned grasp to one that withstands more, within a budget of grasping force.

[Mavrogiannis2014] names this as future work: a step after the optimisation that makes the grasp robust. Here the
sphere of disturbing forces, or of shifts or turns of the object, grows by bisection, each time planned anew from the
best grasp so far with the same weights of F and C, the same other load cases, F ≤ (1 + ε) F*, and within the hand's
limits: what lies beyond them is not withstood, whether or not the problem asked for them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from ..checks import positive
from ..exceptions import InvalidValueError, NameNotFoundError
from ..grasp.grasp import Grasp
from ..planning.planner import plan_grasp
from ..planning.starts import GraspStart
from ..problem.load_cases import LoadCases
from ..problem.search_options import PlannerOptions
from .tolerance import least_tolerance

Goal = Literal["force", "position", "rotation"]
GOALS: tuple[Goal, ...] = ("force", "position", "rotation")
"""What is to grow: the disturbing force [N], the shift [m] or the turn [rad] of the object that is withstood."""
LARGEST = {"force": 20.0, "position": 5e-3, "rotation": 0.2}
"""Largest disturbance that is tried."""
LEAST = {"force": 0.25, "position": 1e-5, "rotation": 2e-4}
"""First disturbance that is tried where the grasp withstands none."""


@dataclass(frozen=True)
class ImprovementStep:
    """One trial.

    Attributes:
        disturbance: Disturbance to withstand in any direction, in the unit of the goal.
        feasible: Whether a grasp was found.
        force_norm: Its F [N].
        task_index: Its C.
    """

    disturbance: float
    feasible: bool
    force_norm: float
    task_index: float


@dataclass(frozen=True)
class Improvement:
    """What the improvement found.

    Attributes:
        before: The grasp it started from.
        after: The grasp that withstands most; the same one if no better was found.
        goal: What was to grow.
        budget: ε: F of the result is at most (1 + ε) times that of the start.
        steps: The trials in their order.
    """

    before: Grasp
    after: Grasp
    goal: Goal
    budget: float
    steps: tuple[ImprovementStep, ...]

    @property
    def cost(self) -> float:
        """By how much F grew, relative."""
        return self.after.force_norm / self.before.force_norm - 1.0


def withstood(grasp: Grasp, goal: Goal) -> float:
    """Return what a grasp withstands passively in the worst direction: a force [N], a shift [m] or a turn [rad]."""
    if goal == "force":
        return grasp.passive_margin.size
    return least_tolerance(grasp, "m" if goal == "position" else "rad")


def improve_grasp(
    grasp: Grasp, *, goal: Goal = "force", budget: float = 0.2, trials: int = 8, starts: int = 3, seed: int = 0
) -> Improvement:
    """Return a grasp near a planned one that withstands the largest disturbance of a kind from any side.

    Args:
        grasp: A feasible grasp.
        goal: The kind: a disturbing ``force``, or an object that is off in ``position`` or ``rotation``.
        budget: ε ≥ 0: how much larger F may become, relative.
        trials: Most plans.
        starts: Starts of each plan: the best grasp so far, then random ones.
        seed: Seed of the random starts.

    Returns:
        The improvement.

    Raises:
        NameNotFoundError: If there is no such goal.
        InvalidValueError: If the grasp is not feasible, or an argument is out of range.
    """
    positive("budget", budget, zero_allowed=True)
    if goal not in GOALS:
        raise NameNotFoundError("goal", str(goal), GOALS)
    if not grasp.feasible:
        raise InvalidValueError("grasp", grasp.status, "a feasible one to improve")
    if grasp.problem.parameters.contact_stiffness == 0.0:
        raise InvalidValueError("contact_stiffness", 0.0, "more than 0 N/m where there are disturbances")
    options = PlannerOptions(starts=starts, enough=1, max_iterations=400, tolerance=1e-10)
    loads = replace(grasp.problem.loads, max_force_norm=(1.0 + budget) * grasp.force_norm)
    best, most = grasp, withstood(grasp, goal)
    works, fails, largest = most, LARGEST[goal], LARGEST[goal]
    target, steps = max(2.0 * works, LEAST[goal]), []
    for _ in range(trials):
        asked = min(target, largest)
        problem = replace(grasp.problem, loads=_asking(loads, goal, asked))
        start = GraspStart(best.joint_angles, best.palm_pose, best.delta_sigma, best.contact_forces)
        found = plan_grasp(problem, seed=seed, options=options, start=start)
        steps.append(ImprovementStep(asked, found.feasible, found.force_norm, found.task_index))
        if found.feasible:
            if withstood(found, goal) > most:
                best, most = found, withstood(found, goal)
            works = max(works, asked)
        else:
            fails = min(fails, asked)
        # Until something fails the disturbance doubles; then the bracket is halved.
        target = 2.0 * works if fails == largest and 2.0 * works < largest else 0.5 * (works + fails)
        if fails - works < 0.02 * fails:
            break
    return Improvement(grasp, best, goal, budget, tuple(steps))


def _asking(loads: LoadCases, goal: Goal, size: float) -> LoadCases:
    """Return load cases that ask for a disturbance of some size."""
    # The margins count the hand's limits, so the trials have to hold them: else they end at forces that count as lost.
    loads = replace(loads, hand_limits=True)
    if goal == "force":
        return replace(loads, force=size)
    return replace(loads, position_error=size) if goal == "position" else replace(loads, rotation_error=size)
