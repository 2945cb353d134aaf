"""Improvement: from a planned grasp to one that withstands more, within a budget of grasping force.

[Mavrogiannis2014] names this as future work: a step after the optimisation that makes the grasp robust. Here the
sphere of disturbing forces grows by bisection, each time planned anew from the best grasp so far with the same weights
of F and C and F ≤ (1 + ε) F*.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from .exceptions import InvalidValueError
from .grasp import Grasp
from .planner import PlannerOptions, plan_grasp
from .spatial import positive
from .starts import GraspStart


@dataclass(frozen=True)
class ImprovementStep:
    """One trial.

    Attributes:
        force: Disturbing force to withstand in any direction [N].
        feasible: Whether a grasp was found.
        force_norm: Its F [N].
        task_index: Its C.
    """

    force: float
    feasible: bool
    force_norm: float
    task_index: float


@dataclass(frozen=True)
class Improvement:
    """What the improvement found.

    Attributes:
        before: The grasp it started from.
        after: The grasp that withstands most; the same one if no better was found.
        budget: ε: F of the result is at most (1 + ε) times that of the start.
        steps: The trials in their order.
    """

    before: Grasp
    after: Grasp
    budget: float
    steps: tuple[ImprovementStep, ...]

    @property
    def cost(self) -> float:
        """By how much F grew, relative."""
        return self.after.force_norm / self.before.force_norm - 1.0


def improve_grasp(
    grasp: Grasp, *, budget: float = 0.2, trials: int = 8, starts: int = 3, seed: int = 0, largest: float = 20.0
) -> Improvement:
    """Return a grasp near a planned one that withstands the largest disturbing force from any side.

    Args:
        grasp: A feasible grasp.
        budget: ε ≥ 0: how much larger F may become, relative.
        trials: Most plans.
        starts: Starts of each plan: the best grasp so far, then random ones.
        seed: Seed of the random starts.
        largest: Largest disturbance that is tried [N].

    Returns:
        The improvement.

    Raises:
        InvalidValueError: If the grasp is not feasible, or an argument is out of range.
    """
    positive("budget", budget, zero_allowed=True)
    if not grasp.feasible:
        raise InvalidValueError("grasp", grasp.status, "a feasible one to improve")
    if grasp.problem.parameters.contact_stiffness == 0.0:
        raise InvalidValueError("contact_stiffness", 0.0, "more than 0 N/m where there are disturbances")
    options = PlannerOptions(starts=starts, enough=1, max_iterations=400, tolerance=1e-10)
    loads = replace(grasp.problem.loads, max_force_norm=(1.0 + budget) * grasp.force_norm)
    best, steps = grasp, []
    works, fails = grasp.passive_margin.size, largest
    target = max(2.0 * works, 0.25)
    for _ in range(trials):
        problem = replace(grasp.problem, loads=replace(loads, force=min(target, largest)))
        start = GraspStart(best.joint_angles, best.palm_pose, best.delta_sigma)
        found = plan_grasp(problem, seed=seed, options=options, start=start)
        steps.append(ImprovementStep(target, found.feasible, found.force_norm, found.task_index))
        if found.feasible:
            if found.passive_margin.size > best.passive_margin.size:
                best = found
            works = max(works, target)
        else:
            fails = min(fails, target)
        # Until something fails the target doubles; then the bracket is halved.
        target = 2.0 * works if fails == largest and 2.0 * works < largest else 0.5 * (works + fails)
        if fails - works < 0.02 * fails:
            break
    return Improvement(grasp, best, budget, tuple(steps))
