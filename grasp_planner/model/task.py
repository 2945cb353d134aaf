"""What the grasp is for: task directions, transmission ratios, the task index C and the force ellipsoid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..checks import finite_array
from ..exceptions import InvalidValueError
from ..spatial import Array, readonly
from .task_direction import TaskDirection, TaskKind


def object_synergy_map(grasp: Array, synergy_jacobian: Array) -> Array:
    """Return H_s = (G⁺)ᵀ J_s: synergy velocities to the twist of the object.

    [Mavrogiannis2014] eq. (21), (22): ν = H_s σ̇; its transpose maps wrenches to synergy forces (23).

    Args:
        grasp: G, of shape (6, 3 n_c), of rank 6.
        synergy_jacobian: J_s, of shape (3 n_c, n_s).

    Returns:
        H_s, of shape (6, n_s).
    """
    return np.linalg.solve(grasp @ grasp.T, grasp @ synergy_jacobian)


def force_transmission_ratio(h_s: Array, direction: Array) -> float:
    """Return α(d) = [dᵀ H_s H_sᵀ d]^(−1/2), wrench along d per unit of synergy force; eq. (26).

    Infinite where the structure of the hand resists d and its motors need not.

    Args:
        h_s: H_s, of shape (6, n_s).
        direction: Unit wrench direction d, of shape (6,).

    Returns:
        α.
    """
    length = float(np.linalg.norm(h_s.T @ direction))
    return math.inf if length == 0.0 else 1.0 / length


def velocity_transmission_ratio(h_s: Array, direction: Array) -> float:
    """Return β(d) = [dᵀ (H_s H_sᵀ)⁻¹ d]^(−1/2), twist along d per unit of synergy velocity; eq. (27).

    Args:
        h_s: H_s, of shape (6, n_s).
        direction: Unit twist direction d, of shape (6,).

    Returns:
        β.

    Raises:
        InvalidValueError: If n_s < 6 or H_s lacks rank 6: then only twists in its range are possible; use
            :func:`restricted_velocity_ratio`.
    """
    n_s = h_s.shape[1]
    if n_s < 6:
        raise InvalidValueError("n_synergies", n_s, "at least 6 for a twist task (β needs rank H_s = 6)")
    if np.linalg.matrix_rank(h_s) < 6:
        raise InvalidValueError("H_s", f"rank {np.linalg.matrix_rank(h_s)}", "rank 6 for β")
    return float((direction @ np.linalg.solve(h_s @ h_s.T, direction)) ** -0.5)


def restricted_velocity_ratio(h_s: Array, direction: Array, *, tolerance: float = 1e-9) -> float:
    """Return β restricted to the range of H_s: 0 for twists the synergies can't produce.

    With n_s < 6 this is the only sense in which β exists: ‖H_s⁺ d‖⁻¹ for d in the range.

    Args:
        h_s: H_s, of shape (6, n_s).
        direction: Unit twist direction d, of shape (6,).
        tolerance: Largest part of d outside the range that is ignored.

    Returns:
        β, or 0 if d has a part outside the range.
    """
    sigma_dot, *_ = np.linalg.lstsq(h_s, direction, rcond=None)
    if float(np.linalg.norm(h_s @ sigma_dot - direction)) > tolerance:
        return 0.0
    return 1.0 / float(np.linalg.norm(sigma_dot))


def transmission_ratios(h_s: Array, directions: Array, *, tolerance: float = 1e-9) -> tuple[Array, Array]:
    """Return α and β for many directions at once, eq. (26), (27); β restricted to the range of H_s.

    Args:
        h_s: H_s, of shape (6, n_s).
        directions: Unit directions d, of shape (k, 6): of wrenches for α, of twists for β.
        tolerance: Largest part of d outside the range that is ignored by β.

    Returns:
        α, infinite where the structure resists d alone, and β, zero where the synergies can't move along d, both of
        shape (k,).
    """
    directions = finite_array("directions", directions, (len(directions), 6))
    left, values, _ = np.linalg.svd(h_s, full_matrices=False)
    kept = values > tolerance * max(float(values.max(initial=0.0)), 1e-300)
    inside, sizes = directions @ left[:, kept], values[kept]
    forces = np.linalg.norm(inside * sizes, axis=1)
    outside = np.linalg.norm(directions - inside @ left[:, kept].T, axis=1) > tolerance
    motors = np.linalg.norm(inside / sizes, axis=1)
    with np.errstate(divide="ignore"):
        return 1.0 / forces, np.where(outside | (motors == 0.0), 0.0, 1.0 / np.where(motors > 0.0, motors, 1.0))


def transmission_ratio(h_s: Array, task: TaskDirection) -> float:
    """Return α or β of a task direction."""
    ratio = velocity_transmission_ratio if task.is_motion else force_transmission_ratio
    return ratio(h_s, task.direction)


def task_index(h_s: Array, tasks: Sequence[TaskDirection]) -> float:
    """Return C = Σ w_i α_i⁻² + Σ w_j β_j⁻², small when the task is transmitted well; eq. (28).

    Args:
        h_s: H_s, of shape (6, n_s).
        tasks: Task directions with weights.

    Returns:
        C.
    """
    return sum(task.weight * transmission_ratio(h_s, task) ** -2 for task in tasks)


@dataclass(frozen=True)
class Ellipsoid:
    """The ellipsoid xᵀ A x = 1 of unit synergy effort, in a 3-D section; choice A9.

    Attributes:
        axes: Unit axes as columns, of shape (3, 3), longest first.
        lengths: Half lengths 1/√eigenvalue, of shape (3,), longest first; infinite where A is singular.
        major_dimension: Dimension of the eigenspace of the longest axis.
        degenerate: Whether that axis is unbounded or not unique.
    """

    axes: Array
    lengths: Array
    major_dimension: int
    degenerate: bool

    def angle_deg(self, direction: Array) -> float:
        """Return the angle between a direction and the eigenspace of the longest axis [degrees].

        Args:
            direction: Unit direction, of shape (3,).

        Returns:
            Angle in [0, 90].
        """
        major = self.axes[:, : self.major_dimension]
        inside = float(np.linalg.norm(major.T @ direction))
        outside = float(np.linalg.norm(direction - major @ (major.T @ direction)))
        return math.degrees(math.atan2(outside, inside))


def transmission_ellipsoid(h_s: Array, kind: TaskKind, *, tolerance: float = 1e-9) -> Ellipsoid:
    """Return a 3-D section of the force ellipsoid (25) or the velocity ellipsoid (24).

    Args:
        h_s: H_s, of shape (6, n_s).
        kind: ``force``, ``torque``, or ``twist`` (linear velocities; needs rank H_s = 6).
        tolerance: Eigenvalues closer than this, relative to the largest, count as equal.

    Returns:
        The ellipsoid; degenerate where A is singular, for instance with n_s < 3.
    """
    core = h_s @ h_s.T
    if kind == "twist":
        if np.linalg.matrix_rank(h_s) < 6:
            raise InvalidValueError("H_s", f"rank {np.linalg.matrix_rank(h_s)}", "rank 6 for the velocity ellipsoid")
        section = np.linalg.inv(core)[:3, :3]
    else:
        section = core[:3, :3] if kind == "force" else core[3:, 3:]
    values, vectors = np.linalg.eigh(section)
    floor = tolerance * max(float(values[-1]), 1e-300)
    dimension = int(np.count_nonzero(values <= values[0] + floor))
    lengths = np.full(3, math.inf)
    np.divide(1.0, np.sqrt(np.maximum(values, 0.0)), out=lengths, where=values > floor)
    unbounded = bool(values[0] <= floor)
    return Ellipsoid(readonly(vectors), readonly(lengths), dimension, unbounded or dimension > 1)


def alignment_deg(h_s: Array, task: TaskDirection) -> tuple[float, bool]:
    """Return the angle between a task direction and the longest axis of its ellipsoid, and the degenerate flag.

    Args:
        h_s: H_s, of shape (6, n_s).
        task: The task direction; of a twist the linear part counts, or, if zero, the angle is not defined (NaN).

    Returns:
        Angle [degrees] and whether the ellipsoid is degenerate along it.
    """
    part = task.direction[3:] if task.kind == "torque" else task.direction[:3]
    length = float(np.linalg.norm(part))
    if length == 0.0:
        return math.nan, True
    ellipsoid = transmission_ellipsoid(h_s, task.kind)
    return ellipsoid.angle_deg(part / length), ellipsoid.degenerate
