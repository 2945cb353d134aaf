"""A task: a direction in which a force, torque or motion is to be transmitted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..checks import positive, unit_vector
from ..exceptions import InvalidValueError, NameNotFoundError
from ..spatial import Array
from ..values import Value, exact_text

_AXES = {
    "x": (1, 0, 0, 0, 0, 0),
    "y": (0, 1, 0, 0, 0, 0),
    "z": (0, 0, 1, 0, 0, 0),
    "rx": (0, 0, 0, 1, 0, 0),
    "ry": (0, 0, 0, 0, 1, 0),
    "rz": (0, 0, 0, 0, 0, 1),
}


@dataclass(frozen=True, eq=False, repr=False)
class TaskDirection(Value):
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
        object.__setattr__(self, "weight", positive("task weight", self.weight))

    @property
    def is_motion(self) -> bool:
        """Whether the direction is a twist (β) and not a wrench (α)."""
        return self.kind == "twist"

    @property
    def text(self) -> str:
        """The text form, which :func:`parse_task` reads back."""
        numbers = ",".join(exact_text(value) for value in self._components())
        return f"{self.kind}:{numbers}" + ("" if self.weight == 1.0 else f"*{exact_text(self.weight)}")

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


TaskKind = Literal["force", "torque", "twist"]
