"""The headline of simulation: a hand closes from open around a free object, everything a little off; what survives.

The hand goes through the references that were planned; palm, size, friction, mass and joints are other than planned.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..checks import positive, positive_whole
from ..grasp.grasp import Grasp
from ..objects import Box, Capsule, Cylinder, GraspObject, Sphere
from ..spatial import Pose, rotation_exp
from .protocol import PROTOCOLS, Protocol
from .run import simulate_grasp

GATE = 0.02
"""Deepest overlap with which a simulation off the plan still begins [m]: the planned posture is then not reached."""


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


ERRORS = {
    "as planned": Errors(),
    "palm 2 mm, 2°": Errors(palm=2e-3, turn_deg=2.0),
    "radius ± 1 mm": Errors(radius=1e-3),
    "μ × 0.75": Errors(friction=0.75),
    "mass × 1.5": Errors(mass=1.5),
    "joint friction 10 N mm": Errors(joint_friction=0.01),
    "all at once": Errors(2e-3, 2.0, 1e-3, 0.75, 1.5, 0.01),
}
"""The rows of the table."""


@dataclass(frozen=True)
class Survival:
    """A row of the table.

    Attributes:
        name: What was off.
        survived: Simulations in which the hand closed and all pushes were held.
        tried: Simulations.
        worst: What the first simulation that failed says; empty if none did.
    """

    name: str
    survived: int
    tried: int
    worst: str


def survival(grasp: Grasp, *, seed: int = 0, samples: int = 4) -> tuple[Survival, ...]:
    """Close a hand around a free object, with errors of each kind and with all at once.

    Args:
        grasp: The grasp.
        seed: Seed of the random errors.
        samples: Simulations of every row whose errors are random; of the others there is one.

    Returns:
        The rows.

    Raises:
        SimulationDependencyError: If MuJoCo is not installed.
        InvalidValueError: If hand or object can't be simulated.
    """
    positive_whole("samples", samples)
    rng, rows = np.random.default_rng(seed), []
    for name, errors in ERRORS.items():
        count, survived, worst = samples if errors.random else 1, 0, ""
        for sample in range(count):
            found = simulate_grasp(
                off_plan(grasp, errors, 1.0 if sample % 2 == 0 else -1.0, rng),
                _protocol(grasp, errors),
                ladder=False,
                path=grasp.closing.path,
            )
            survived += found.passed
            worst = worst or ("" if found.passed else found.verdict)
        rows.append(Survival(name, survived, count, worst))
    return tuple(rows)


def off_plan(grasp: Grasp, errors: Errors, sign: float, rng: np.random.Generator) -> Grasp:
    """Return a grasp whose palm and object are off the plan.

    Args:
        grasp: The grasp.
        errors: How far.
        sign: 1 for a larger object, −1 for a smaller one.
        rng: Source of the directions.
    """
    way, axis = rng.normal(size=(2, 3))
    turn = rotation_exp(np.radians(errors.turn_deg) * axis / np.linalg.norm(axis))
    moved = grasp.palm_pose.translation + errors.palm * way / np.linalg.norm(way)
    problem = replace(grasp.problem, grasp_object=resized(grasp.problem.grasp_object, sign * errors.radius))
    return replace(grasp, problem=problem, palm_pose=Pose(turn @ grasp.palm_pose.rotation, moved), search=None)


def resized(grasp_object: GraspObject, by: float) -> GraspObject:
    """Return an object whose surface lies farther out [m]; other objects than simple ones stay as they are."""
    if isinstance(grasp_object, Sphere | Cylinder | Capsule):
        return replace(grasp_object, radius=grasp_object.radius + by)
    if isinstance(grasp_object, Box):
        x, y, z = (edge + 2.0 * by for edge in (grasp_object.x, grasp_object.y, grasp_object.z))
        return replace(grasp_object, x=x, y=y, z=z)
    return grasp_object


def _protocol(grasp: Grasp, errors: Errors) -> Protocol:
    """Return the protocol with friction, mass and joints off the plan."""
    return replace(
        PROTOCOLS["free"],
        friction=None if errors.friction == 1.0 else errors.friction * float(grasp.problem.friction.min()),
        mass=errors.mass * grasp.problem.grasp_object.mass,
        joint_friction=errors.joint_friction,
        gate=GATE,
        torques=False,
    )
