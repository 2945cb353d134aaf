"""Where an object may be touched: inside of a box or a ball, or outside of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..checks import finite_array
from ..exceptions import InvalidValueError
from ..spatial import Array
from ..values import Value, exact_text

ALLOWED = "box,x,y,z,x,y,z (two corners, the lower first) or sphere,x,y,z,radius, in metres"
COUNTS = {"box": 6, "sphere": 4}
"""How many numbers describe a zone."""


@dataclass(frozen=True, eq=False, repr=False)
class Zone(Value):
    """A box or a ball in the frame of a mesh's file.

    Attributes:
        shape: ``box`` or ``sphere``.
        numbers: Lower and upper corner, or centre and radius [m], of shape (6,) or (4,).
        allowed: Whether contacts have to be inside; outside otherwise.
        name: Part of the file that the box is around; empty if it was given.
    """

    shape: str
    numbers: Array
    allowed: bool = True
    name: str = ""

    def __post_init__(self) -> None:
        name = f"object mesh.{self.key}"
        if self.shape not in COUNTS:
            raise InvalidValueError(name, self.shape, ALLOWED)
        numbers = finite_array(name, self.numbers, (COUNTS[self.shape],))
        size = numbers[3:] - numbers[:3] if self.shape == "box" else numbers[3:]
        if not (size > 0.0).all():
            raise InvalidValueError(name, self.text, ALLOWED)
        object.__setattr__(self, "numbers", numbers)

    @classmethod
    def parse(cls, text: str, allowed: bool = True) -> Zone:
        """Return the zone of a text such as ``box,-0.02,-0.02,0,0.02,0.02,0.1`` or ``sphere,0,0,0.1,0.03``.

        Raises:
            InvalidValueError: If it is none.
        """
        shape, *rest = (part.strip() for part in text.split(","))
        try:
            numbers = [float(part) for part in rest]
        except ValueError:
            numbers = []
        if shape not in COUNTS or len(numbers) != COUNTS[shape]:
            raise InvalidValueError(f"object mesh.{'region' if allowed else 'forbid'}", text, ALLOWED)
        return cls(shape, np.array(numbers), allowed)

    @property
    def key(self) -> str:
        """The key of the text form of an object."""
        return "region" if self.allowed else "forbid"

    @property
    def text(self) -> str:
        """The text form, which :meth:`parse` reads back."""
        return self.name or ",".join([self.shape, *(exact_text(float(number)) for number in self.numbers)])

    def margins(self, points: Array) -> tuple[Array, Array]:
        """Return how far points are on the right side.

        Args:
            points: Points in the frame of the zone [m], of shape (n, 3).

        Returns:
            Margins [m], not negative on the right side, of shape (n, k), and their gradients, of shape (n, k, 3): to
            each face of a box to stay in, otherwise one.
        """
        if self.shape == "sphere":
            arms = points - self.numbers[:3]
            length = np.linalg.norm(arms, axis=1, keepdims=True)
            sign = -1.0 if self.allowed else 1.0
            away = arms / np.maximum(length, 1e-12)
            return sign * (length - self.numbers[3]), sign * away[:, None]
        low, high = self.numbers[:3], self.numbers[3:]
        inside = np.hstack([points - low, high - points])
        slopes = np.broadcast_to(np.vstack([np.eye(3), -np.eye(3)]), (len(points), 6, 3))
        return (inside, slopes) if self.allowed else _outside(inside)


def _outside(inside: Array) -> tuple[Array, Array]:
    """Return the distance from a box of points, negative inside, with gradients; of depths behind its six faces."""
    depth = np.minimum(inside[:, :3], inside[:, 3:])
    side = np.where(inside[:, :3] < inside[:, 3:], -1.0, 1.0)
    over = np.maximum(-depth, 0.0)
    length = np.linalg.norm(over, axis=1, keepdims=True)
    nearest = np.eye(3)[np.argmin(depth, axis=1)]
    away = np.where(length > 0.0, over / np.maximum(length, 1e-12), nearest)
    distance = np.where(length > 0.0, length, -depth.min(axis=1, keepdims=True))
    return distance, (away * side)[:, None]
