"""The parameters that a problem could do with other values of, each with the values to try."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..problem.parameters import plain_compliance
from ..problem.problem import GraspProblem
from ..spatial import readonly

FRICTION_LIMIT = 2.0
"""Largest coefficient of friction that is tried."""


FACTOR_LIMIT = 3.0
"""Largest factor by which sizes are changed."""


COMPLIANCE_FACTOR_LIMIT = 30.0
"""Largest factor by which the joint compliance is changed."""


LIMIT_WIDENING = 0.6
"""Largest widening of all joint limits [rad]."""


@dataclass(frozen=True)
class Knob:
    """A parameter that may be changed: its value now, the values to try, outwards, and how to set it."""

    name: str
    unit: str
    current: float
    steps: tuple[float, ...]
    apply: Callable[[float], GraspProblem]
    whole: bool = False


def problem_knobs(problem: GraspProblem) -> list[Knob]:
    """Return the parameters that are tried."""
    hand = problem.hand
    knobs = [
        *([_friction_knob(problem)] if problem.contact_model.has_friction else []),
        Knob(
            "number of synergies",
            "",
            problem.n_synergies,
            tuple(range(problem.n_synergies + 1, problem.all_synergies.n_synergies + 1)),
            lambda value: replace(problem, n_synergies=int(value)),
            whole=True,
        ),
        Knob(
            "widening of all joint limits",
            "rad",
            0.0,
            tuple(np.linspace(0.0, LIMIT_WIDENING, 5)[1:]),
            lambda value: replace(
                problem, hand=replace(hand, lower=readonly(hand.lower - value), upper=readonly(hand.upper + value))
            ),
        ),
    ]
    for sign, word in ((1.0, "larger"), (-1.0, "smaller")):
        knobs.append(
            Knob(
                f"size of the object ({word})",
                "times",
                1.0,
                tuple(float(step) for step in np.geomspace(1.0, FACTOR_LIMIT, 7)[1:] ** sign),
                lambda value: replace(problem, grasp_object=problem.grasp_object.resized(value)),
            )
        )
        knobs.append(_compliance_knob(problem, sign, word))
    force = problem.loads.force
    if force > 0.0:
        steps = tuple(np.linspace(force, 0.0, 5)[1:].tolist())
        knobs.append(
            Knob(
                "disturbing force",
                "N",
                force,
                steps,
                lambda value: replace(problem, loads=replace(problem.loads, force=value)),
            )
        )
    return knobs


def _friction_knob(problem: GraspProblem) -> Knob:
    """Return the knob of the coefficient of friction, or of a factor on those of all contacts."""
    given = problem.parameters.friction
    uneven = isinstance(given, tuple)
    current, typical = (1.0, float(np.mean(given))) if isinstance(given, tuple) else (given, 1.0)
    steps = np.linspace(current, max(FRICTION_LIMIT / typical, 1.5 * current), 7)[1:]

    def apply(value: float) -> GraspProblem:
        friction = tuple((value * problem.friction).tolist()) if uneven else value
        return replace(problem, parameters=replace(problem.parameters, friction=friction))

    return Knob("friction of all contacts" if uneven else "friction μ", "times" * uneven, current, tuple(steps), apply)


def _compliance_knob(problem: GraspProblem, sign: float, word: str) -> Knob:
    """Return the knob of the joint compliance, which scales the C_q of every joint."""
    parameters = problem.parameters

    def apply(value: float) -> GraspProblem:
        scaled = plain_compliance(value * problem.joint_compliance)
        return replace(problem, parameters=replace(parameters, joint_compliance=scaled))

    steps = np.geomspace(1.0, COMPLIANCE_FACTOR_LIMIT, 6)[1:] ** sign
    return Knob(f"joint compliance ({word})", "times", 1.0, tuple(steps.tolist()), apply)
