"""Rows of residuals with their derivatives, for a batch of states."""

from __future__ import annotations

from dataclasses import dataclass

from ..spatial import Array


@dataclass(frozen=True)
class Rows:
    """The residuals of one requirement.

    Attributes:
        name: Name of the requirement.
        value: Residuals in its unit: zero (an equality) or not negative where it is met, of shape (B, m).
        derivative: Their derivatives by x, of shape (B, m, n_x).
        equality: Whether it is an equality.
    """

    name: str
    value: Array
    derivative: Array
    equality: bool = False
