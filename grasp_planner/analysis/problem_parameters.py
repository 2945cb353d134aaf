"""The parameters of a planning problem that may be off: friction, mass, size, compliances, pose of the object."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from ..grasp.grasp import Grasp
from ..problem.parameters import plain_compliance
from ..problem.problem import GraspProblem
from ..spatial import Array, readonly


@dataclass(frozen=True)
class Parameter:
    """A parameter of a planning problem.

    Attributes:
        name: Its name.
        unit: Its unit; empty for factors.
        value: Its value now.
        scale: A change that counts as large.
        apply: The problem with the parameter changed by some amount.
        palm: Change of the palm's chart (translation, rotation vector) per unit, for an object moved while the
            palm stays, of shape (6,); None where the palm is free to follow.
    """

    name: str
    unit: str
    value: float
    scale: float
    apply: Callable[[float], GraspProblem]
    palm: Array | None = None


def parameters_of(grasp: Grasp) -> tuple[Parameter, ...]:
    """Return the parameters of a grasp's problem.

    ``object x`` … move the object in the world and keep the palm, gravity and tasks there; ``object rx`` … turn it
    about its centre and let the palm follow (``palm held``: keep it). If the object only moves and the palm
    follows, nothing changes but the palm.

    Args:
        grasp: The grasp.

    Returns:
        The parameters.
    """
    # The synergies are handed on, not read from their file anew in every changed problem.
    given = grasp.problem
    problem = replace(given, synergy_set=None, synergy_space=given.all_synergies)
    model = problem.parameters
    shape, mass = problem.grasp_object, problem.grasp_object.mass
    stiffness, c_q = model.contact_stiffness, problem.joint_compliance

    def with_model(**changes: object) -> GraspProblem:
        return replace(problem, parameters=replace(model, **changes))  # type: ignore[arg-type]

    found = [
        *_friction(problem),
        Parameter("mass", "kg", mass, mass, lambda p: replace(problem, grasp_object=replace(shape, mass=mass + p))),  # type: ignore[call-arg]
        Parameter("object size", "", 1.0, 1.0, lambda p: replace(problem, grasp_object=shape.resized(1.0 + p))),
        Parameter(
            "joint compliance", "", 1.0, 1.0, lambda p: with_model(joint_compliance=plain_compliance((1.0 + p) * c_q))
        ),
        Parameter(
            "contact stiffness", "N/m", stiffness, stiffness, lambda p: with_model(contact_stiffness=stiffness + p)
        ),
        Parameter(
            "structural compliance",
            "m/N",
            model.structural_compliance,
            model.structural_compliance,
            lambda p: with_model(structural_compliance=model.structural_compliance + p),
        ),
    ]
    position = np.array(grasp.palm_pose.translation)
    for name, axis in zip("xyz", np.eye(3), strict=True):
        shift = np.concatenate([-axis, np.zeros(3)])
        turn = np.concatenate([-np.cross(axis, position), -axis])
        held = f"object {name} (palm held)", f"object r{name} (palm held)"
        found.append(Parameter(held[0], "m", 0.0, 0.01, lambda p: given, shift))
        found.append(Parameter(f"object r{name}", "rad", 0.0, 0.1, _turned(problem, axis)))
        found.append(Parameter(held[1], "rad", 0.0, 0.1, _turned(problem, axis), turn))
    return tuple(found)


def _friction(problem: GraspProblem) -> tuple[Parameter, ...]:
    """Return the coefficient of friction, or a factor on those of all contacts; nothing where it does not count."""
    given = problem.parameters.friction
    if not problem.contact_model.has_friction:
        return ()

    def apply(change: float) -> GraspProblem:
        friction = given + change if isinstance(given, float) else tuple(((1.0 + change) * problem.friction).tolist())
        return replace(problem, parameters=replace(problem.parameters, friction=friction))

    if isinstance(given, float):
        return (Parameter("friction μ", "", given, given, apply),)
    return (Parameter("friction of all contacts", "", 1.0, 1.0, apply),)


def _turned(problem: GraspProblem, axis: Array) -> Callable[[float], GraspProblem]:
    """Return how the problem looks, in O, when the object turns and gravity, tasks and listed loads do not."""

    def apply(angle: float) -> GraspProblem:
        inverse = np.array(pin.exp3(-angle * axis))
        both = np.kron(np.eye(2), inverse)
        gravity = readonly(inverse @ problem.parameters.gravity)
        wrenches = tuple(tuple((both @ np.array(wrench)).tolist()) for wrench in problem.loads.wrenches)
        return replace(
            problem,
            parameters=replace(problem.parameters, gravity=gravity),
            tasks=tuple(replace(task, direction=both @ task.direction) for task in problem.tasks),
            loads=replace(problem.loads, wrenches=wrenches),
        )

    return apply
