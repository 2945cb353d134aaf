"""What the grasp is for: task directions, transmission ratios, the task index C and the force ellipsoid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from .exceptions import InvalidValueError, NameNotFoundError
from .spatial import Array, positive, readonly, unit_vector

TaskKind = Literal["force", "torque", "twist"]

_AXES = {
    "x": (1, 0, 0, 0, 0, 0),
    "y": (0, 1, 0, 0, 0, 0),
    "z": (0, 0, 1, 0, 0, 0),
    "rx": (0, 0, 0, 1, 0, 0),
    "ry": (0, 0, 0, 0, 1, 0),
    "rz": (0, 0, 0, 0, 0, 1),
}


@dataclass(frozen=True)
class TaskDirection:
    """One direction the grasp has to transmit, with its weight in the task index.

    Attributes:
        kind: ``force`` or ``torque`` (wrench transmission, α) or ``twist`` (motion transmission, β).
        direction: Unit direction in O, linear part first, of shape (6,).
        weight: Weight w_i or w_j in C; [Mavrogiannis2014] eq. (28).
    """

    kind: TaskKind
    direction: Array
    weight: float = 1.0

    def __post_init__(self) -> None:
        if self.kind not in ("force", "torque", "twist"):
            raise NameNotFoundError("task kind", str(self.kind), ("force", "torque", "twist"))
        object.__setattr__(self, "direction", unit_vector(f"{self.kind} direction", self.direction, 6))
        positive("task weight", self.weight)

    @property
    def is_motion(self) -> bool:
        """Whether the direction is a twist (β) and not a wrench (α)."""
        return self.kind == "twist"

    @property
    def text(self) -> str:
        """The text form, which :func:`parse_task` reads back."""
        numbers = ",".join(f"{value:.12g}" for value in self._components())
        return f"{self.kind}:{numbers}" + ("" if self.weight == 1.0 else f"*{self.weight:.12g}")

    def _components(self) -> Array:
        """Return the components that the text form lists."""
        if self.kind == "force":
            return self.direction[:3]
        return self.direction[3:] if self.kind == "torque" else self.direction


def force_task(direction: npt.ArrayLike, weight: float = 1.0) -> TaskDirection:
    """Return the task of exerting a force along a direction in O, of shape (3,)."""
    return TaskDirection("force", np.concatenate([unit_vector("force direction", direction), np.zeros(3)]), weight)


def torque_task(direction: npt.ArrayLike, weight: float = 1.0) -> TaskDirection:
    """Return the task of exerting a torque about a direction in O, of shape (3,)."""
    return TaskDirection("torque", np.concatenate([np.zeros(3), unit_vector("torque direction", direction)]), weight)


def twist_task(direction: npt.ArrayLike, weight: float = 1.0) -> TaskDirection:
    """Return the task of moving the object along a twist in O (v, ω), of shape (6,)."""
    return TaskDirection("twist", unit_vector("twist direction", direction, 6), weight)


def parse_task(text: str) -> TaskDirection:
    """Return the task of a text such as ``force:+y``, ``torque:0,0,1`` or ``twist:+rz*0.5``.

    Args:
        text: ``force|torque|twist``, a colon, then a signed axis (x, y, z; for twists also rx, ry, rz) or
            comma-separated components (3; for twists 3, a translation, or 6), optionally ``*weight``.

    Returns:
        The task direction.

    Raises:
        NameNotFoundError: If the kind or the axis does not exist.
        InvalidValueError: If the direction is zero or malformed, or the weight is not positive.
    """
    kind, colon, rest = text.strip().partition(":")
    if kind not in ("force", "torque", "twist"):
        raise NameNotFoundError("task kind", kind, ("force", "torque", "twist"))
    direction_text, star, weight_text = rest.partition("*")
    if not colon or not direction_text.strip():
        raise InvalidValueError("task", text, "kind:direction, for instance force:+y")
    weight = _number("task weight", weight_text) if star else 1.0
    values = _direction(kind, direction_text.strip())
    if kind == "force":
        return force_task(values[:3], weight)
    if kind == "torque":
        return torque_task(values[:3], weight)
    return twist_task(values, weight)


def _direction(kind: str, text: str) -> Array:
    """Return six numbers of a direction text; forces and torques use the first three."""
    axes = tuple(_AXES) if kind == "twist" else ("x", "y", "z")
    if "," not in text:
        name = text.lstrip("+-")
        if name not in axes or text.count("+") + text.count("-") > 1:
            raise NameNotFoundError("task axis", text, (f"{sign}{axis}" for axis in axes for sign in "+-"))
        return np.array(_AXES[name], dtype=float) * (-1.0 if text.startswith("-") else 1.0)
    numbers = np.array([_number(f"{kind} direction", part) for part in text.split(",")])
    if len(numbers) == 3:
        return np.concatenate([numbers, np.zeros(3)])
    if kind == "twist" and len(numbers) == 6:
        return numbers
    raise InvalidValueError(f"{kind} direction", text, "3 components" + (" or 6" if kind == "twist" else ""))


def _number(field: str, text: str) -> float:
    """Return a finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InvalidValueError(field, text.strip(), "finite numbers")
    return value


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
