"""How much a grasp withstands, in newtons: the largest disturbances before a contact slips or a limit is met.

Passively, the references held: f − s R d leaves the cones and limits at an s that has a closed form. With
re-optimised internal forces, those the synergies can command through the springs (the range of P, whatever law planned
the forces): a second-order cone program in (Δσ, s). The true coefficient of friction and the hand's own limits count,
whatever the problem asks for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model.contact_model import ContactModel
from ..model.contacts import Contacts
from ..model.force_closure import solve_cone_program
from ..model.friction import friction_margins
from ..model.subspaces import range_basis
from ..model.task_direction import TaskDirection
from ..problem.load_cases import sphere_directions
from ..problem.problem import GraspProblem
from ..spatial import Array, readonly
from .load_check import command_matrix, response_matrix

PASSIVE_DIRECTIONS = 2000
"""Directions of a spiral over the sphere among which the worst one is sought, before it is refined."""
ACTIVE_HULL = 0.862
"""What the hull of the 26 sampled directions contains of the sphere; sets of resisted forces are convex."""
SLIPPED = 1e-6
"""How far outside its cone a force counts as slipped already [N]."""
UNBOUNDED = 1e4
"""Disturbances from here on count as any [N, N m]."""


@dataclass(frozen=True)
class Margin:
    """The largest disturbance resisted along one direction.

    Attributes:
        size: Its size [N], or [N m] for a torque; infinite if nothing gives way.
        direction: Its unit direction Δw in O, linear part first, of shape (6,).
        gives_way: What gives way first, such as ``friction at thumb``; empty where that is not computed.
    """

    size: float
    direction: Array
    gives_way: str = ""


@dataclass(frozen=True)
class GraspMargins:
    """Margins of a grasp. A task is resisted when the object meets the reaction −d to what it exerts along d.

    Attributes:
        passive: Worst direction of a force, the references held.
        passive_tasks: The same for the reaction to each task; None for motions.
        active: Worst of 26 directions, internal forces re-optimised through the synergies; any other direction
            has at least 0.86 of it.
        active_tasks: The same for the reaction to each task; None for motions.
    """

    passive: Margin
    passive_tasks: tuple[Margin | None, ...]
    active: Margin
    active_tasks: tuple[Margin | None, ...]


@dataclass(frozen=True)
class Holding:
    """What the margins need to know of a grasp: forces, how they answer, limits.

    Attributes:
        contacts: The contacts.
        model: What they transmit, d intensities; for hard fingers the force.
        names: Their names.
        joint_names: Names of the joints.
        forces: Nominal f, or intensities [N], of shape (n_c, d).
        response: R: a unit of disturbance changes f by −R, of shape (d n_c, 6).
        internal: Orthonormal basis of the internal forces that the synergies command, of shape (d n_c, k).
        jacobian: J [m/rad], of shape (d n_c, n_q).
        friction: μ of every contact, of shape (n_c,).
        max_normal: Largest normal force [N].
        torque_limits: Largest joint torques [N m], of shape (n_q,).
    """

    contacts: Contacts
    model: ContactModel
    names: tuple[str, ...]
    joint_names: tuple[str, ...]
    forces: Array
    response: Array
    internal: Array
    jacobian: Array
    friction: Array
    max_normal: float
    torque_limits: Array


def grasp_margins(held: Holding, tasks: Sequence[TaskDirection], passive: Margin | None = None) -> GraspMargins:
    """Return the margins of a grasp.

    Args:
        held: The grasp.
        tasks: The tasks.
        passive: The passive margin in the worst direction if it is known already.

    Returns:
        The margins; zero where the nominal forces already break a limit, not a number without contact stiffness,
        because then nothing says how the contacts share a disturbance.
    """
    reactions = [_reaction(task) for task in tasks]
    return GraspMargins(
        passive=passive or worst_passive_margin(held),
        passive_tasks=tuple(None if d is None else passive_margins(held, d[None])[0] for d in reactions),
        active=min((_active(held, _force(d)) for d in sphere_directions(edges=True)), key=lambda margin: margin.size),
        active_tasks=tuple(None if d is None else _active(held, d) for d in reactions),
    )


def disturbance_response(problem: GraspProblem, grasp: Array, jacobian: Array) -> Array:
    """Return R = G_K^R, of shape (d n_c, 6), not a number without contact stiffness."""
    if problem.parameters.contact_stiffness > 0.0:
        return response_matrix(problem, grasp, jacobian)
    return np.full((len(jacobian), 6), np.nan)


def commanded_basis(problem: GraspProblem, grasp: Array, jacobian: Array) -> Array:
    """Return an orthonormal basis of the range of P, of shape (d n_c, ≤ n_s); empty without contact stiffness."""
    if problem.parameters.contact_stiffness > 0.0:
        return range_basis(command_matrix(problem, grasp, jacobian))
    return np.zeros((len(jacobian), 0))


def holding(
    problem: GraspProblem, contacts: Contacts, forces: Array, jacobian: Array, response: Array, internal: Array
) -> Holding:
    """Return what the margins need to know of a grasp.

    Args:
        problem: The problem.
        contacts: The contacts.
        forces: Nominal f, or intensities [N], of shape (n_c, d).
        jacobian: J [m/rad], of shape (d n_c, n_q).
        response: R, of shape (d n_c, 6).
        internal: Orthonormal basis of the internal forces that the synergies command, of shape (d n_c, k).

    Returns:
        What they need.
    """
    return Holding(
        contacts=contacts,
        model=problem.contact_model,
        names=tuple(frame.name for frame in problem.frames),
        joint_names=problem.hand.joint_names,
        forces=forces,
        response=response,
        internal=internal,
        jacobian=jacobian,
        friction=problem.friction,
        max_normal=min(problem.loads.max_normal_force or problem.hand.max_normal_force, problem.max_normal_force),
        torque_limits=problem.hand.torque_limits,
    )


def _reaction(task: TaskDirection) -> Array | None:
    """Return the disturbance −d that a task along d meets; None for motions."""
    return None if task.is_motion else -task.direction


def _force(direction: Array) -> Array:
    """Return the wrench of a force at the object's centre, of shape (6,)."""
    return np.concatenate([direction, np.zeros(3)])


def worst_passive_margin(held: Holding) -> Margin:
    """Return the passive margin in the worst direction: of a spiral, then refined around the worst one."""
    index = np.arange(PASSIVE_DIRECTIONS) + 0.5
    height, angle = 1.0 - 2.0 * index / PASSIVE_DIRECTIONS, math.pi * (1.0 + math.sqrt(5.0)) * index
    ring = np.sqrt(1.0 - height**2)
    spiral = np.column_stack([ring * np.cos(angle), ring * np.sin(angle), height])
    spiral = np.vstack([sphere_directions(), spiral])
    directions, reach = spiral, 0.1
    for _ in range(5):
        sizes = passive_scales(held, _wrenches(directions)).min(axis=1)
        best = directions[np.argmin(sizes)]
        directions = np.vstack([best, best + reach * spiral[:200], best + 0.3 * reach * spiral[200:2000:20]])
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        reach *= 0.2
    return passive_margins(held, _wrenches(best[None]))[0]


def _wrenches(directions: Array) -> Array:
    """Return the wrenches of forces at the object's centre, of shape (n_d, 6)."""
    return np.hstack([directions, np.zeros_like(directions)])


def passive_margins(held: Holding, wrenches: Array) -> list[Margin]:
    """Return the passive margins along unit wrenches, of shape (n_d, 6), with what gives way."""
    scales = passive_scales(held, wrenches)
    labels = [
        *(f"friction at {name}" for name in held.names),
        *(f"normal force at {name}" for name in held.names),
        *(f"torque of {name}" for name in held.joint_names),
    ]
    found = []
    for row, wrench in zip(scales, wrenches, strict=True):
        first = int(np.argmin(row))
        found.append(Margin(float(row[first]), readonly(wrench), labels[first] if np.isfinite(row[first]) else ""))
    return found


def passive_scales(held: Holding, wrenches: Array) -> Array:
    """Return the s at which f − s R d meets each limit: cones, normal forces, joint torques.

    Args:
        held: The grasp.
        wrenches: Disturbances d, of shape (n_d, 6).

    Returns:
        Scales ≥ 0, infinite where a limit is never met, of shape (n_d, 2 n_c + n_q).
    """
    normals, forces = held.model.covectors(held.contacts.normals), held.forces
    change = (wrenches @ held.response.T).reshape(len(wrenches), *forces.shape)
    normal, d_normal = np.einsum("ij,ij->i", forces, normals), np.einsum("kij,ij->ki", change, normals)
    tangential = forces - normal[:, None] * normals
    d_tangential = change - d_normal[:, :, None] * normals
    # |f_t − s t|² = μ² (f_n − s r)²: a s² − 2 b s + c = 0.
    squared = held.friction**2
    a = np.einsum("kij,kij->ki", d_tangential, d_tangential) - squared * d_normal**2
    b = np.einsum("kij,ij->ki", d_tangential, tangential) - squared * normal * d_normal
    c = np.minimum(np.einsum("ij,ij->i", tangential, tangential) - squared * normal**2, 0.0)
    outside = friction_margins(forces, normals, held.friction) < -SLIPPED
    cones = np.where(outside, 0.0, _leaving(a, b, np.broadcast_to(c, a.shape)))
    torques, d_torques = held.jacobian.T @ forces.ravel(), change.reshape(len(wrenches), -1) @ held.jacobian
    rising = _until(held.max_normal - normal, -d_normal)
    bound = np.minimum(
        _until(held.torque_limits - torques, -d_torques), _until(held.torque_limits + torques, d_torques)
    )
    return np.hstack([cones, rising, bound])


def _leaving(a: Array, b: Array, c: Array) -> Array:
    """Return the least s ≥ 0 from which a s² − 2 b s + c > 0, for c ≤ 0; infinite if none."""
    scales = np.full(a.shape, np.inf)
    inside = b**2 - a * c
    root = np.sqrt(np.maximum(inside, 0.0))
    ahead = (a > 0.0) & (b >= 0.0)
    scales[ahead] = (b[ahead] + root[ahead]) / a[ahead]
    other = ~ahead & (inside >= 0.0) & (b - root < 0.0)
    scales[other] = c[other] / (b - root)[other]
    return np.where(np.isnan(a), np.nan, scales)


def _until(left: Array, rate: Array) -> Array:
    """Return the s ≥ 0 at which what is left of a limit is used up at a rate; infinite if never."""
    scales = np.full(rate.shape, np.inf)
    np.divide(np.maximum(np.broadcast_to(left, rate.shape), 0.0), rate, out=scales, where=rate > 0.0)
    return np.where(np.isnan(rate), np.nan, scales)


def _active(held: Holding, wrench: Array) -> Margin:
    """Return the margin along a unit wrench with internal forces re-optimised through the synergies.

    Maximise s over (y, s) with f = f₀ + E y − s R d in the cones and within the limits, E the commanded
    internal forces.
    """
    if np.isnan(held.response).any():
        return Margin(math.nan, readonly(wrench))
    nominal = held.forces.ravel()
    moves = np.column_stack([held.internal, -held.response @ wrench])
    in_forces = held.model.cone_rows(held.contacts.normals, held.friction, nominal.size)
    cones, offsets = [rows @ moves for rows in in_forces], [rows @ nominal for rows in in_forces]

    def at_most(row: Array, limit: float) -> None:
        if math.isfinite(limit):
            cones.append(-(row @ moves)[None])
            offsets.append(np.array([limit - row @ nominal]))

    d = held.model.dimension
    for i, covector in enumerate(held.model.covectors(held.contacts.normals)):
        row = np.zeros(nominal.size)
        row[d * i : d * i + d] = covector
        at_most(row, held.max_normal)
    for column, limit in zip(held.jacobian.T, held.torque_limits, strict=True):
        at_most(column, float(limit))
        at_most(-column, float(limit))
    size = moves.shape[1]
    last = np.eye(size)[-1]
    cones.append(-last[None])
    offsets.append(np.array([UNBOUNDED]))
    solution = solve_cone_program(-last, np.zeros((0, size)), np.zeros(0), cones, offsets)
    scale = 0.0 if solution is None else max(0.0, float(solution[-1]))
    return Margin(math.inf if scale > 0.99 * UNBOUNDED else scale, readonly(wrench))
