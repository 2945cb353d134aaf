"""Post-optimality ([Mavrogiannis2014] section V): how the best grasp changes with the parameters of its problem.

At a KKT point dx*/dp and dλ/dp follow from the KKT system of the active constraints. Derivatives by x are analytic;
those by parameters, and the Hessian of the Lagrangian, are central differences of analytic gradients. The validity
radius is how far a parameter may change until the active set does, or the predicted change of F is off by 5 %.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..grasp.grasp import Grasp
from ..optimisation.kkt import KKT_ITERATIONS, KktPoint, kkt_change, kkt_point
from ..optimisation.lagrangian import lagrangian_gradient
from ..optimisation.nlp import solve_nlp
from ..problem.problem import GraspProblem
from ..spatial import Array
from .optimality_program import OptimalityProgram
from .problem_parameters import Parameter, parameters_of
from .validity import Prediction, validity

PARAMETER_STEP = 1e-4
"""Step of the central differences by parameters, relative to their scale."""
SETTLING_ITERATIONS, SETTLING_TOLERANCE = 600, 1e-12
"""How the solver is begun anew at a planned grasp: plans end before they have settled."""
QUICK_ROUNDS = ((20, 6), (40, 6))
"""Iterations of the solver and of Newton's method that settle all but plans that ended far from an optimum."""
SETTLED = 1e-6
"""Relative gradient of the Lagrangian up to which an optimum counts as one."""
NOT_SETTLED = ((0.0, "no optimum was found nearby"),) * 2
FOLLOWS = 1e-6
"""Relative mismatch of the active constraints above which no neighbouring grasp keeps all of them."""
CANNOT_FOLLOW = ((0.0, "the palm is held and the motors are too few"),) * 2


@dataclass(frozen=True)
class Sensitivity:
    """How the optimum answers one parameter.

    Attributes:
        name: Name of the parameter.
        unit: Its unit.
        value: Its value.
        d_force_norm: dF*/dp [N per unit].
        d_task_index: dC*/dp [per unit].
        d_objective: dz*/dp, of the objective [per unit].
        d_joint_angles: dq*/dp [rad per unit], of shape (n_q,).
        d_palm: Change of the palm in O per unit, translation [m] and rotation vector [rad], of shape (6,).
        d_delta_sigma: dδσ*/dp [rad per unit], of shape (n_s,).
        down: Largest decrease for which the active set stays and F changes by dF*/dp to 5 %, ≥ 0; examined up to half
            the parameter's scale.
        up: Largest increase.
        ends_down: What ends it: a constraint that becomes active or that stops being so, or the curvature.
        ends_up: The same for the increase.
        follows: Whether a neighbouring grasp keeps all active constraints; if not, the derivatives are not a number.
    """

    name: str
    unit: str
    value: float
    d_force_norm: float
    d_task_index: float
    d_objective: float
    d_joint_angles: Array
    d_palm: Array
    d_delta_sigma: Array
    down: float
    up: float
    ends_down: str
    ends_up: str
    follows: bool


@dataclass(frozen=True)
class PostOptimality:
    """The optimum near a grasp and its sensitivities.

    Attributes:
        grasp: The grasp moved to the KKT point.
        stationarity: What is left of the gradient there, relative.
        active: Names of the active inequalities, with their multipliers (of the scaled program).
        flat: Directions along which the optimum is not unique.
        curvature: Least curvature along the active constraints relative to the largest; > 0 at a strict minimum.
        sensitivities: One for each parameter.
    """

    grasp: Grasp
    stationarity: float
    active: tuple[tuple[str, float], ...]
    flat: int
    curvature: float
    sensitivities: tuple[Sensitivity, ...]

    def sensitivity(self, name: str) -> Sensitivity:
        """Return the sensitivity to a parameter by its name."""
        return next(found for found in self.sensitivities if found.name == name)


def optimum_near(grasp: Grasp) -> Grasp:
    """Return the grasp at the KKT point near a planned one, for its own problem.

    Args:
        grasp: A feasible grasp.

    Returns:
        The grasp; not necessarily feasible if none is near.
    """
    program = OptimalityProgram(grasp)
    return _grasp_at(grasp, program, _settled(program, ((SETTLING_ITERATIONS, KKT_ITERATIONS),)).z)


def _settled(program: OptimalityProgram, rounds: Sequence[tuple[int, int]] = QUICK_ROUNDS) -> KktPoint:
    """Return the KKT point near the program's start: SQP begun anew with a fine tolerance, then Newton's method.

    Args:
        program: The program.
        rounds: Most iterations of both, round after round until it has settled.
    """
    nlp, z = program.nlp(), program.z
    for solver, newton in rounds:
        z = solve_nlp(nlp, z, max_iterations=solver, tolerance=SETTLING_TOLERANCE).z
        found = kkt_point(program.evaluate, z, iterations=newton)
        if found.stationarity <= SETTLED:
            break
        z = found.z
    return found


def _grasp_at(grasp: Grasp, program: OptimalityProgram, z: Array) -> Grasp:
    """Return the grasp at scaled variables."""
    return program.base.grasp(z, grasp.search)


def post_optimality(grasp: Grasp, parameters: Sequence[Parameter] | None = None) -> PostOptimality:
    """Return the optimum near a planned grasp and how it answers the parameters of its problem.

    Args:
        grasp: A feasible grasp, as planned.
        parameters: The parameters; all of :func:`parameters_of` if left out.

    Returns:
        The optimum and the sensitivities.
    """
    program = OptimalityProgram(grasp)
    found = _settled(program)
    best = _grasp_at(grasp, program, found.z)
    names = program.names()
    first_inequality = found.point.n_equalities
    active = [
        (names[k], float(value))
        for k, value in zip(found.active, found.multipliers, strict=True)
        if k >= first_inequality
    ]
    flatness = kkt_change(found, np.zeros(len(found.z)), np.zeros(len(found.point.residuals)))
    chosen = parameters_of(best) if parameters is None else parameters
    return PostOptimality(
        grasp=best,
        stationarity=found.stationarity,
        active=tuple(sorted(active, key=lambda entry: -entry[1])),
        flat=flatness.flat,
        curvature=flatness.curvature,
        sensitivities=tuple(_sensitivity(program, found, names, parameter) for parameter in chosen),
    )


def _sensitivity(program: OptimalityProgram, found: KktPoint, names: list[str], parameter: Parameter) -> Sensitivity:
    """Return the sensitivity to one parameter."""
    layout, scale = program.layout, program.base.scale
    step = PARAMETER_STEP * parameter.scale
    d_gradient, d_residuals, d_costs = _by_parameter(program, found, parameter.apply, step)
    free = None
    moved = np.zeros(layout.size)
    if parameter.palm is not None:
        # The palm's own variables move as told; the others answer.
        moved[layout.pose] = parameter.palm / scale[layout.pose]
        d_gradient = d_gradient + found.hessian @ moved
        d_residuals = d_residuals + found.point.jacobian @ moved
        free = np.setdiff1d(np.arange(layout.size), np.arange(layout.size)[layout.pose])
    change = kkt_change(found, d_gradient, d_residuals, free)
    follows = change.mismatch <= FOLLOWS
    d_z = change.z + moved if follows else np.full(layout.size, np.nan)
    state, d_x = program.base.state(found.z), d_z * scale
    objective, problem = program.base.objective, program.base.problem
    by_x = [each.cost.gradient(problem, state) @ d_x for each in objective.terms]
    d_values = [float(fixed + moving) for fixed, moving in zip(d_costs, by_x, strict=True)]
    d_force, d_task = d_values[:2]
    (down, ends_down), (up, ends_up) = CANNOT_FOLLOW
    if found.stationarity > SETTLED:
        (down, ends_down), (up, ends_up) = NOT_SETTLED
    elif follows:
        rates = d_residuals + found.point.jacobian @ change.z
        told = Prediction(program, found, names, parameter, d_z, change.multipliers, rates, d_force, free)
        (down, ends_down), (up, ends_up) = validity(told)
    return Sensitivity(
        name=parameter.name,
        unit=parameter.unit,
        value=parameter.value,
        d_force_norm=d_force,
        d_task_index=d_task,
        d_objective=objective.total(d_values),
        d_joint_angles=_fixed(d_x[layout.joints]),
        d_palm=_fixed(d_x[layout.pose]),
        d_delta_sigma=_fixed(d_x[layout.displacement]),
        down=down,
        up=up,
        ends_down=ends_down,
        ends_up=ends_up,
        follows=follows,
    )


def _fixed(values: Array) -> Array:
    """Return a read-only copy; not-a-numbers stay."""
    copy = np.array(values)
    copy.setflags(write=False)
    return copy


def _by_parameter(
    program: OptimalityProgram, found: KktPoint, apply: Callable[[float], GraspProblem], step: float
) -> tuple[Array, Array, Array]:
    """Return ∂/∂p at fixed x and λ of the Lagrangian's gradient, of the constraints and of all costs, F and C first."""
    sides = []
    for shift in (step, -step):
        problem = apply(shift)
        if problem is program.base.problem:
            zero = np.zeros(len(program.base.objective.terms))
            return np.zeros(len(found.z)), np.zeros(len(found.point.residuals)), zero
        there = program.at(problem)
        point, state = there.evaluate(found.z), there.state(found.z)
        gradient = lagrangian_gradient(point, found.active, found.multipliers)
        costs = [each.cost.value(problem, state) for each in program.base.objective.terms]
        sides.append((gradient, point.residuals, np.array(costs)))
    up, down = sides
    first, second, third = ((a - b) / (2.0 * step) for a, b in zip(up, down, strict=True))
    return first, second, third
