"""Why no grasp was found: the least-violated point, what binds there, and the smallest change that would help."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from ..grasp.grasp import Grasp
from ..grasp.verdict import Violation
from ..planning.planner import plan_grasp
from ..planning.program import GraspProgram
from ..planning.starts import GraspStart
from ..problem.search_options import PlannerOptions
from ..spatial import Array
from ..values import number_text
from .knobs import Knob, problem_knobs

RESOLUTION = 0.05
"""The bracket of a change is narrowed until its ends differ by this share of the change."""


@dataclass(frozen=True)
class Change:
    """One change, alone, that makes the problem feasible.

    Attributes:
        parameter: What is changed.
        current: Its value now.
        needed: The value closest to it for which a feasible grasp was found.
        unit: Unit of both.
        grasp: That grasp.
    """

    parameter: str
    current: float
    needed: float
    unit: str
    grasp: Grasp

    @property
    def relative(self) -> float:
        """Size of the change relative to the current value (joint limits: relative to 1 rad)."""
        return abs(self.needed - self.current) / (abs(self.current) or 1.0)

    @property
    def text(self) -> str:
        """The change in words."""
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.parameter} {number_text(self.current, 4)} → {number_text(self.needed, 4)}{unit}"


@dataclass(frozen=True)
class Diagnosis:
    """Why a problem has no feasible grasp as far as is known.

    Attributes:
        least_violated: The point of least scaled violation (least squares) found from the best attempt.
        binding: The requirement violated most there, relative to the scale of its unit; None if none is left.
        changes: Single changes that help, smallest relative change first.
        not_enough: Parameters for which no value within reach helped.
        not_tried: Parameters for which there was no time left.
        time_s: Wall time [s].
    """

    least_violated: Grasp
    binding: Violation | None
    changes: tuple[Change, ...]
    not_enough: tuple[str, ...]
    not_tried: tuple[str, ...]
    time_s: float

    @property
    def smallest_change(self) -> Change | None:
        """The change that is smallest relative to its current value."""
        return self.changes[0] if self.changes else None

    @property
    def text(self) -> str:
        """Some lines of plain words and numbers."""
        if self.binding is not None:
            name, amount = self.binding.name, self.binding.unit.text(self.binding.value)
            lines = [f"least violated point: {name} stays violated by {amount}"]
            others = [found.text for found in self.least_violated.failures().values() if found.name != name]
            if others:
                lines.append("also violated there: " + ", ".join(others))
        else:
            lines = ["a point without violations exists, but no force-closed grasp was found from it"]
        if self.changes:
            lines.append("smallest single change that makes it feasible: " + self.changes[0].text)
            lines += ["or: " + change.text for change in self.changes[1:]]
        if self.not_enough:
            lines.append("changing only one of these did not help: " + ", ".join(self.not_enough))
        if self.not_tried:
            lines.append("not tried for lack of time: " + ", ".join(self.not_tried))
        return "\n".join(lines)


def explain_infeasibility(
    attempt: Grasp,
    *,
    seed: int = 0,
    options: PlannerOptions | None = None,
    time_limit_s: float = 60.0,
    only: Sequence[str] | None = None,
    cancel: Callable[[], bool] | None = None,
) -> Diagnosis:
    """Explain why planning found no feasible grasp, and solve for the smallest single change that would do.

    First the scaled violations are minimised in the least-squares sense from the attempt. Then each parameter
    alone is moved outwards until planning succeeds, and the change is narrowed by bisection; every trial is
    planned from the least-violated point and from a few random starts. "Did not help" therefore means: not
    within these starts.

    Args:
        attempt: An infeasible grasp, as ``plan_grasp`` returns it.
        seed: Seed of the trials.
        options: Search options of each trial; a few starts if left out.
        time_limit_s: Wall time after which no further parameter is tried [s].
        only: Beginnings of the names of the parameters to try, for instance ``friction``; all if left out.
        cancel: Polled; True ends the search for changes.

    Returns:
        The diagnosis.
    """
    began = time.perf_counter()
    options = options or PlannerOptions(starts=5, enough=1, max_iterations=120)
    least = least_violated_point(attempt)
    binding = max(least.failures().values(), key=lambda found: found.value * found.unit.scale, default=None)

    def stopped() -> bool:
        return (cancel is not None and cancel()) or time.perf_counter() - began > time_limit_s

    changes, not_enough, not_tried = [], [], []
    for knob in problem_knobs(attempt.problem):
        if only is not None and not knob.name.startswith(tuple(only)):
            continue
        change = None if stopped() else _smallest_change(knob, least, seed, options, stopped)
        if change is not None:
            changes.append(change)
        elif stopped():
            not_tried.append(knob.name)
        else:
            not_enough.append(knob.name)
    changes.sort(key=lambda change: change.relative)
    return Diagnosis(
        least_violated=least,
        binding=binding,
        changes=tuple(changes),
        not_enough=tuple(not_enough),
        not_tried=tuple(not_tried),
        time_s=time.perf_counter() - began,
    )


def least_violated_point(attempt: Grasp) -> Grasp:
    """Minimise the sum of squared scaled violations from a grasp.

    Args:
        attempt: The grasp to start from.

    Returns:
        The least-violated grasp; its forces are internal ones plus the balance of the load, as always.
    """
    program = GraspProgram(attempt.problem, attempt.palm_pose)
    nlp = program.build("one")
    z0 = program.pack(attempt.joint_angles, attempt.palm_pose, attempt.delta_sigma, attempt.contact_forces)
    inside = 1e-9
    free = np.isfinite(nlp.lower)
    lower, upper = nlp.lower.copy(), nlp.upper.copy()
    z0[free] = np.clip(z0[free], lower[free] + inside, upper[free] - inside)

    def residual(z: Array) -> Array:
        return np.concatenate([nlp.equality(z)[0], np.minimum(nlp.inequality(z)[0], 0.0)])

    def jacobian(z: Array) -> Array:
        values, slopes = nlp.inequality(z)
        return np.vstack([nlp.equality(z)[1], slopes * (values < 0.0)[:, None]])

    result = least_squares(residual, z0, jacobian, bounds=(lower, upper), max_nfev=300, xtol=1e-12, ftol=1e-12)
    return program.grasp(result.x)


def _smallest_change(
    knob: Knob, least: Grasp, seed: int, options: PlannerOptions, cancel: Callable[[], bool]
) -> Change | None:
    """Move one parameter outwards until planning succeeds, then narrow the change down."""

    def plan(value: float, near: Grasp) -> Grasp | None:
        problem = knob.apply(value)
        delta_sigma = np.zeros(problem.n_synergies)
        delta_sigma[: near.problem.n_synergies] = near.delta_sigma
        start = GraspStart(near.joint_angles, near.palm_pose, delta_sigma, near.contact_forces)
        grasp = plan_grasp(problem, seed=seed, options=options, start=start, cancel=cancel)
        return grasp if grasp.feasible else None

    fails = knob.current
    for value in knob.steps:
        found = plan(value, least)
        if found is not None:
            break
        fails = value
    else:
        return None
    works = value
    while not knob.whole and abs(works - fails) > RESOLUTION * abs(works - knob.current):
        middle = 0.5 * (works + fails)
        grasp = plan(middle, found)
        if grasp is None:
            fails = middle
        else:
            works, found = middle, grasp
    return Change(knob.name, knob.current, works, knob.unit, found)
