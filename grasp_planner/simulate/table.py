"""The table an object stands on in simulation: where it is, and whether the object stands under the plan's gravity."""

from __future__ import annotations

from dataclasses import replace

from ..exceptions import InvalidValueError
from ..objects import Sphere
from ..objects.resting import UPRIGHT, resting_poses
from ..problem.problem import GraspProblem


def table_height(problem: GraspProblem) -> float:
    """Return how far the table is below the centre of mass, opposite to the plan's gravity [m].

    Args:
        problem: The problem; whether it was planned with a table does not matter.

    Raises:
        InvalidValueError: If the object does not stand under the gravity of the plan.
    """
    thing, up = problem.grasp_object, problem.up
    stands = isinstance(thing, Sphere) or any(float(pose.up @ up) >= UPRIGHT for pose in resting_poses(thing))
    if not problem.parameters.gravity.any() or not stands:
        raise InvalidValueError("object", thing.text, "one that stands on a table under the plan's gravity")
    return thing.reach(-up)


def with_table(problem: GraspProblem) -> GraspProblem:
    """Return the problem with the table its object stands on as the ground, for checks of overlaps."""
    return replace(problem, clearance=replace(problem.clearance, ground=-table_height(problem)))
