"""The pressure that what is soft or breaks bears under a fingertip, by Hertz's contact of two round bodies.

[Johnson1985], chapter 4: two spheres of relative radius R and contact modulus E* press with f_n on a circle of radius
a = (3 f_n R / 4 E*)^(1/3); the pressure in its middle is p₀ = (6 f_n E*² / π³ R²)^(1/3), one and a half times the mean.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..checks import positive
from ..exceptions import InvalidValueError
from ..values import Value, exact_text

LARGEST = 1e13
"""Largest modulus and pressure that are taken [Pa]: ten times those of diamond."""


@dataclass(frozen=True, eq=False, repr=False)
class PressureLimit(Value):
    """The largest pressure under a contact, and what it takes to tell the pressure.

    Attributes:
        max_pressure: Largest pressure in the middle of a contact [Pa].
        modulus: Contact modulus E* of object and fingertip [Pa]: 1/E* is the sum of (1 − ν²)/E of both; under hard
            fingertips it is E/(1 − ν²) of the object.
        curvature_radius: Smallest radius of curvature of the surface where fingers touch it [m]; infinite for flat.
    """

    max_pressure: float
    modulus: float
    curvature_radius: float = np.inf

    def __post_init__(self) -> None:
        for name in ("max_pressure", "modulus"):
            number = positive(f"object mesh.{name}", getattr(self, name), unit="Pa", at_most=LARGEST)
            object.__setattr__(self, name, number)
        if self.curvature_radius != np.inf:
            positive("object mesh.curvature_radius", self.curvature_radius, unit="m")

    @classmethod
    def of_keys(
        cls, max_pressure: float | None, modulus: float | None, curvature_radius: float | None
    ) -> PressureLimit | None:
        """Return the limit of the keys of an object's text form; None where there are none.

        Raises:
            InvalidValueError: If a number is out of range, or the pressure or the modulus is missing.
        """
        if max_pressure is None and modulus is None and curvature_radius is None:
            return None
        if max_pressure is None or modulus is None:
            given = "max_pressure" if modulus is None else "modulus"
            given = "curvature_radius" if max_pressure is None and modulus is None else given
            missing = "max_pressure [Pa]" if max_pressure is None else "modulus [Pa], E/(1 − ν²) under hard fingertips"
            raise InvalidValueError(f"object mesh.{given}", "alone", f"given with {missing}")
        return cls(max_pressure, modulus, np.inf if curvature_radius is None else curvature_radius)

    def pressure(self, normal_force: float, radius: float) -> float:
        """Return the pressure in the middle of a contact [Pa].

        Args:
            normal_force: f_n [N].
            radius: Radius of the fingertip [m].
        """
        relative = self._relative_radius(radius)
        return float(np.cbrt(6.0 * normal_force * (self.modulus / relative) ** 2) / np.pi)

    def largest_force(self, radius: float) -> float:
        """Return the normal force [N] that reaches the limit under a fingertip of a radius [m]; 0 under a point."""
        relative = self._relative_radius(radius) if radius > 0.0 else 0.0
        return float((np.pi * self.max_pressure) ** 3 * (relative / self.modulus) ** 2 / 6.0)

    def _relative_radius(self, radius: float) -> float:
        """Return R of 1/R = 1/radius + 1/curvature_radius [m]: hollows count as flat, and rods as balls."""
        return 1.0 / (1.0 / radius + 1.0 / self.curvature_radius)

    def resized(self, factor: float) -> PressureLimit:
        """Return the limit of an object whose sizes are multiplied by a factor."""
        return replace(self, curvature_radius=factor * self.curvature_radius)

    @property
    def text(self) -> str:
        """The keys of an object's text form."""
        keys = {"max_pressure": self.max_pressure, "modulus": self.modulus, "curvature_radius": self.curvature_radius}
        return ",".join(f"{key}={exact_text(value)}" for key, value in keys.items() if value < np.inf)
