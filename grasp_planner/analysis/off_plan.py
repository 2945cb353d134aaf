"""Errors: palm, size, friction, mass and joints other than planned, and a grasp whose palm and object are so."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..checks import positive
from ..grasp.grasp import Grasp
from ..objects import Box, Capsule, Cylinder, GraspObject, Sphere
from ..spatial import Array, Pose, rotation_exp


@dataclass(frozen=True)
class Errors:
    """How far things are from the plan.

    Attributes:
        palm: Length of the palm's displacement, its direction random [m].
        turn_deg: Angle of the palm's rotation, its axis random [degrees].
        radius: How much the object's surface lies farther out or, as often, in [m].
        friction: Factor on μ.
        mass: Factor on the object's mass.
        joint_friction: Dry friction of every joint [N m].
    """

    palm: float = 0.0
    turn_deg: float = 0.0
    radius: float = 0.0
    friction: float = 1.0
    mass: float = 1.0
    joint_friction: float = 0.0

    def __post_init__(self) -> None:
        for name in ("palm", "turn_deg", "radius", "joint_friction"):
            positive(f"errors {name}", getattr(self, name), zero_allowed=True)
        for name in ("friction", "mass"):
            positive(f"errors {name}", getattr(self, name))

    @property
    def random(self) -> bool:
        """Whether they differ from sample to sample."""
        return self.palm > 0.0 or self.turn_deg > 0.0 or self.radius > 0.0


def off_plan(grasp: Grasp, errors: Errors, sign: float, rng: np.random.Generator) -> Grasp:
    """Return a grasp whose palm and object are off the plan; friction, mass and joints stay as planned.

    Args:
        grasp: The grasp.
        errors: How far.
        sign: 1 for a larger object, −1 for a smaller one.
        rng: Source of the directions.
    """
    way, axis = rng.normal(size=(2, 3))
    shift = errors.palm * way / np.linalg.norm(way)
    turn = np.radians(errors.turn_deg) * axis / np.linalg.norm(axis)
    return grown(palm_moved(grasp, shift, turn), sign * errors.radius)


def palm_moved(grasp: Grasp, shift: Array, turn: Array) -> Grasp:
    """Return a grasp with its palm shifted [m] and turned about its own origin [rad], both in O and of shape (3,)."""
    pose = grasp.palm_pose
    moved = Pose(rotation_exp(turn) @ pose.rotation, pose.translation + shift)
    return replace(grasp, palm_pose=moved, search=None)


def grown(grasp: Grasp, by: float) -> Grasp:
    """Return a grasp of an object whose surface lies farther out [m]."""
    problem = replace(grasp.problem, grasp_object=resized(grasp.problem.grasp_object, by))
    return replace(grasp, problem=problem, search=None)


def resized(grasp_object: GraspObject, by: float) -> GraspObject:
    """Return an object whose surface lies farther out [m]; other objects than simple ones stay as they are."""
    if isinstance(grasp_object, Sphere | Cylinder | Capsule):
        return replace(grasp_object, radius=grasp_object.radius + by)
    if isinstance(grasp_object, Box):
        x, y, z = (edge + 2.0 * by for edge in (grasp_object.x, grasp_object.y, grasp_object.z))
        return replace(grasp_object, x=x, y=y, z=z)
    return grasp_object
