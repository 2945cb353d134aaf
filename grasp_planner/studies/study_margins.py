"""Static margins of a grasp that a study compares with the load at which it is lost in simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..analysis.ladder import palm_errors
from ..analysis.tolerance import least_tolerance
from ..exceptions import GraspPlannerError
from ..grasp.grasp import Grasp
from ..judge.margins import UNBOUNDED
from ..model.compliance import softened
from ..simulate import Simulation

Margin = Callable[[Grasp], float | None]


def least_friction_share(grasp: Grasp) -> float:
    """Return the least share of friction that is left at a contact, 1 − |f_t| / (μ f_n)."""
    usable = grasp.problem.friction * np.maximum(grasp.normal_forces, 1e-12)
    return float((grasp.friction_margins / usable).min())


def joint_spring_stiffness(grasp: Grasp) -> float:
    """Return the least stiffness [N/m] of the held object against translation by the joint springs alone.

    The least eigenvalue of G_t (J C_q Jᵀ)⁺ G_tᵀ, without the geometric terms of the preload.
    """
    jacobian = grasp.hand_jacobian
    compliance = softened(jacobian, grasp.problem.joint_compliance) @ jacobian.T
    springs = np.linalg.pinv(compliance, rcond=1e-9, hermitian=True)
    linear = grasp.grasp_matrix[:3]
    return float(np.linalg.eigvalsh(linear @ springs @ linear.T).min())


def least_push(grasp: Grasp) -> float:
    """Return the least passive margin [N] over forces along ±x, ±y, ±z: the directions that are simulated."""
    along = np.hstack([np.vstack([np.eye(3), -np.eye(3)]), np.zeros((6, 3))])
    return min(margin.size for margin in grasp.passive_margins_along(along))


def task_margin(grasp: Grasp, *, passive: bool) -> float | None:
    """Return the least margin [N, N m] along a task, passive or re-squeezed; None if all tasks are motions."""
    found = grasp.margins.passive_tasks if passive else grasp.margins.active_tasks
    sizes = [margin.size for margin in found if margin is not None]
    return min(sizes) if sizes else None


CLOSING_MARGINS: dict[str, Margin] = {
    "closing: holds": lambda grasp: float(grasp.closing.holds),
    "closing: pushes held": lambda grasp: float(np.isfinite(grasp.closing.pushes).sum()),
    "closing: − motion under a push [m]": lambda grasp: -float(grasp.closing.pushes.max()),
    "closing: − motion at rest [m]": lambda grasp: -grasp.closing.displacement,
    "closing: − touches off the plan [m]": lambda grasp: -float(grasp.closing.mismatch.max()),
    "closing: − the same as a force [N]": lambda grasp: -float(grasp.closing.mismatch_force.max()),
    "closing: least share of friction": lambda grasp: (
        1.0 - float(grasp.closing.cone_use.max()) if grasp.closing.rests else -math.inf
    ),
    "closing: share of torque left": lambda grasp: 1.0 - grasp.closing.torque_use,
    "closing: − slip [m]": lambda grasp: -float(grasp.closing.slip.max()),
    "closing, object free: holds": lambda grasp: float(bool(grasp.closing.holds_free)),
    "closing, object free: palms off held": lambda grasp: float(sum(each.holds for each in palm_errors(grasp))),
}
"""Margins of the quasi-static closing, its certificate; without a state of rest, the least there is."""

MARGINS: dict[str, Margin] = {
    "F [N]": lambda grasp: grasp.force_norm,
    "F / floor": lambda grasp: grasp.force_norm / grasp.force_norm_floor,
    "least normal force [N]": lambda grasp: float(grasp.normal_forces.min()),
    "least friction slack [N]": lambda grasp: float(grasp.friction_margins.min()),
    "least friction share": least_friction_share,
    "force-closure margin": lambda grasp: grasp.force_closure_margin,
    "passive, worst direction [N]": lambda grasp: grasp.passive_margin.size,
    "passive, six pushes [N]": least_push,
    "passive, along the task [N]": lambda grasp: task_margin(grasp, passive=True),
    "re-squeezed, worst direction [N]": lambda grasp: grasp.margins.active.size,
    "re-squeezed, along the task [N]": lambda grasp: task_margin(grasp, passive=False),
    "least stiffness, preload [N/m]": lambda grasp: grasp.stability.smallest,
    "least stiffness, no preload [N/m]": lambda grasp: grasp.stability.without_preload,
    "least stiffness, joint springs [N/m]": joint_spring_stiffness,
    "finger stiffness": lambda grasp: grasp.stability.finger_stiffness,
    "least shift withstood [m]": lambda grasp: least_tolerance(grasp, "m"),
    "least turn withstood [rad]": lambda grasp: least_tolerance(grasp, "rad"),
    "task transmission": lambda grasp: min(grasp.transmission_ratios),
    **CLOSING_MARGINS,
}
"""Margins by name, with units; add yours here. Larger should be better."""


def grasp_as_simulated(found: Simulation) -> Grasp:
    """Return the grasp that was simulated: squeezed, with the protocol's mass, friction and gravity."""
    grasp, problem = found.grasp, found.grasp.problem
    model = replace(problem.parameters, friction=found.friction)
    if not found.protocol.gravity:
        model = replace(model, gravity=np.zeros(3))
    thing = problem.grasp_object
    if thing.mass != found.mass:
        thing = replace(thing, mass=found.mass)  # type: ignore[call-arg]
    tested = replace(problem, parameters=model, grasp_object=thing)
    if tested == problem:
        return grasp
    return Grasp(tested, grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma, grasp.contact_forces, grasp.search)


def static_margins(grasp: Grasp) -> dict[str, float | None]:
    """Return all :data:`MARGINS` of a grasp.

    Args:
        grasp: The grasp.

    Returns:
        Margins by name; None where undefined, :data:`~grasp_planner.judge.margins.UNBOUNDED` where nothing bounds them.
    """
    return {name: _value(margin, grasp) for name, margin in MARGINS.items()}


def _value(margin: Margin, grasp: Grasp) -> float | None:
    """Return a margin, None where it is undefined."""
    try:
        value = margin(grasp)
    except (GraspPlannerError, np.linalg.LinAlgError, ZeroDivisionError):
        return None
    if value is None or math.isnan(value):
        return None
    return float(value) if math.isfinite(value) else math.copysign(UNBOUNDED, value)
