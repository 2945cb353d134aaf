"""The table an object stands on in simulation: where it is, and whether the object stands under the plan's gravity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..exceptions import InvalidValueError
from ..objects import Box, Capsule, Cylinder, EllipsoidObject, GraspObject, Sphere
from ..objects.resting import UPRIGHT, resting_poses
from ..problem.problem import GraspProblem
from ..spatial import Array


def table_height(problem: GraspProblem) -> float:
    """Return how far the table is below the centre of mass, opposite to the plan's gravity [m].

    Args:
        problem: The problem; whether it was planned with a table does not matter.

    Raises:
        InvalidValueError: If the object does not stand under the gravity of the plan.
    """
    thing, gravity = problem.grasp_object, problem.parameters.gravity
    up = -gravity / max(float(np.linalg.norm(gravity)), 1e-12)
    stands = isinstance(thing, Sphere) or any(float(pose.up @ up) >= UPRIGHT for pose in resting_poses(thing))
    if not gravity.any() or not stands:
        raise InvalidValueError("object", thing.text, "one that stands on a table under the plan's gravity")
    return depth(thing, -up)


def with_table(problem: GraspProblem) -> GraspProblem:
    """Return the problem with the table its object stands on as the ground, for checks of overlaps."""
    return replace(problem, clearance=replace(problem.clearance, ground=-table_height(problem)))


def depth(thing: GraspObject, way: Array) -> float:
    """Return how far an object reaches from its centre of mass along a unit vector [m]."""
    if isinstance(thing, Sphere):
        return thing.radius
    if isinstance(thing, Capsule):
        return float(thing.radius + 0.5 * thing.height * abs(way[2]))
    if isinstance(thing, Cylinder):
        return float(thing.radius * np.hypot(way[0], way[1]) + 0.5 * thing.height * abs(way[2]))
    if isinstance(thing, EllipsoidObject):
        return float(np.linalg.norm(np.array([thing.x, thing.y, thing.z]) * way))
    if isinstance(thing, Box):
        return float((thing.half_extents - thing.edge) @ np.abs(way) + thing.edge)
    return float((np.asarray(thing.mesh.vertices) @ way).max())
