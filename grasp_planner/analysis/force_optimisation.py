"""The best contact forces at given contacts: exact cones, torque limits, one wrench or a set of them.

Second-order cone programs, solved by Clarabel. The cost V that keeps away from all limits is minimised by Newton's
method in :mod:`grasp_planner.analysis.friction_cost`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..exceptions import InvalidValueError, NameNotFoundError
from ..model.contact_model import ContactModel
from ..model.force_closure import HARD, solve_cone_program
from ..spatial import Array
from ..values import Value
from .friction_cost import BestForces

Aim = Literal["norm", "largest", "normal_sum"]
AIMS: tuple[Aim, ...] = ("norm", "largest", "normal_sum")


@dataclass(frozen=True, eq=False, repr=False)
class ForceProblem(Value):
    """Contacts that have to balance a wrench.

    Attributes:
        grasp: G, of shape (6, d n_c); d is 3 for hard fingers.
        normals: Unit normals into the object, of shape (n_c, 3).
        friction: μ, one number or one for each contact.
        wrench: w_ext on the object [N, N m], of shape (6,): G f = −w_ext.
        basis: E, of shape (d n_c, k), orthonormal: f may only differ from ``particular`` by E y; any internal force
            by default.
        particular: f₀ with G f₀ = −w_ext, of shape (d n_c,), where there is a basis.
        jacobian: J, of shape (d n_c, n_q), where torques are limited.
        torque_limits: Largest |τ| of τ = Jᵀ f [N m], of shape (n_q,).
        min_normal: Least normal force [N].
        max_normal: Largest normal force [N].
        response: R, of shape (d n_c, 6): a disturbance Δw changes f by −R Δw, springs alone.
        disturbances: Δw, of shape (n_k, 6): f − R Δw has to keep all limits for every one of them.
        model: What the contacts transmit; for others than hard fingers the forces f are intensities λ [N].
    """

    grasp: Array
    normals: Array
    friction: float | Array
    wrench: Array
    basis: Array | None = None
    particular: Array | None = None
    jacobian: Array | None = None
    torque_limits: Array | None = None
    min_normal: float = 0.0
    max_normal: float = np.inf
    response: Array | None = None
    disturbances: Array | None = None
    model: ContactModel = HARD

    @cached_property
    def covectors(self) -> Array:
        """ν of every contact, for hard fingers the normals, of shape (n_c, d)."""
        return self.model.covectors(self.normals)


def best_forces(problem: ForceProblem, aim: Aim = "norm") -> BestForces | None:
    """Return the forces of least norm √Σ‖f_i‖², least largest max_i ‖f_i‖, or least sum of normal forces.

    Args:
        problem: What to hold, and within which limits.
        aim: What to make small.

    Returns:
        The forces, or None if none keep all limits.

    Raises:
        NameNotFoundError: If there is no such aim.
        InvalidValueError: If a disturbance is given without a response, or limits of torques without J.
    """
    if aim not in AIMS:
        raise NameNotFoundError("aim", str(aim), AIMS)
    _check(problem)
    m, d = problem.covectors.size, problem.model.dimension
    # Variables (y, t) with f = f₀ + E y; t is above what is to be small.
    basis = np.eye(m) if problem.basis is None else problem.basis
    fixed = np.zeros(m) if problem.particular is None else problem.particular
    k = basis.shape[1]
    moves = np.hstack([basis, np.zeros((m, 1))])
    # Without a basis the balance is a constraint; with one, f₀ has it and E keeps it.
    balances = 6 if problem.basis is None else 0
    equality, right = (problem.grasp @ moves)[:balances], -problem.wrench[:balances]
    rows, offsets = _limits(problem, moves, fixed)
    top = np.eye(k + 1)[-1:]
    cost: Array = np.array(top[0])
    if aim == "norm":
        rows.append(np.vstack([top, moves]))
        offsets.append(np.append(0.0, fixed))
    elif aim == "largest":
        for i in range(len(problem.normals)):
            part = slice(d * i, d * i + d)
            rows.append(np.vstack([top, moves[part]]))
            offsets.append(np.append(0.0, fixed[part]))
    else:
        cost[:] += problem.covectors.ravel() @ moves  # t has no part: it stays at 0
        rows.append(top)
        offsets.append(np.zeros(1))
    found = solve_cone_program(cost, equality, right, rows, offsets)
    if found is None:
        return None
    forces = (fixed + basis @ found[:k]).reshape(-1, d)
    sizes = np.linalg.norm(forces, axis=1)
    value = {"norm": np.linalg.norm(sizes), "largest": sizes.max(), "normal_sum": (forces * problem.covectors).sum()}
    return BestForces(forces, float(value[aim]), found[:k])


def _limits(problem: ForceProblem, moves: Array, fixed: Array) -> tuple[list[Array], list[Array]]:
    """Return rows and offsets of every limit, for the undisturbed forces and for each disturbance."""
    m, (n_c, d) = problem.covectors.size, problem.covectors.shape
    # Without friction nothing is tangential, and any μ > 0 says that contacts press.
    friction = problem.friction if problem.model.has_friction else 1.0
    cones = problem.model.cone_rows(problem.normals, friction, m)
    normal = np.zeros((n_c, m))
    for i, covector in enumerate(problem.covectors):
        normal[i, d * i : d * i + d] = covector
    changes: list[Array] = [np.zeros(m)]
    if problem.disturbances is not None and problem.response is not None:
        changes += [-problem.response @ case for case in problem.disturbances]
    rows: list[Array] = []
    offsets: list[Array] = []

    def above(matrix: Array, nominal: npt.ArrayLike) -> None:
        for row, value in zip(matrix @ moves, np.asarray(nominal), strict=True):
            rows.append(row[None])
            offsets.append(np.array([value]))

    for change in changes:
        nominal = fixed + change
        rows += [cone @ moves for cone in cones]
        offsets += [cone @ nominal for cone in cones]
        if problem.min_normal > 0.0:
            above(normal, normal @ nominal - problem.min_normal)
        if np.isfinite(problem.max_normal):
            above(-normal, problem.max_normal - normal @ nominal)
        if problem.torque_limits is not None and problem.jacobian is not None:
            limited = np.isfinite(problem.torque_limits)
            torques, most = problem.jacobian.T[limited], problem.torque_limits[limited]
            above(-torques, most - torques @ nominal)
            above(torques, most + torques @ nominal)
    return rows, offsets


def _check(problem: ForceProblem) -> None:
    """Refuse problems that lack a part."""
    pairs: Sequence[tuple[str, object, str, object]] = (
        ("disturbances", problem.disturbances, "response", problem.response),
        ("torque_limits", problem.torque_limits, "jacobian", problem.jacobian),
        ("basis", problem.basis, "particular", problem.particular),
    )
    for field, given, needed, other in pairs:
        if given is not None and other is None:
            raise InvalidValueError(field, "given", f"given together with {needed}")
    if problem.grasp.shape != (6, problem.covectors.size):
        raise InvalidValueError("G", problem.grasp.shape, f"of shape (6, {problem.covectors.size})")
