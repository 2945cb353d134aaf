"""What a problem requires of a grasp, by how much the grasp fails it, and the sentence that says so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..exceptions import InvalidValueError
from ..judge.posed_grasp import PosedGrasp
from ..judge.surface_check import FOOTPRINT, SPREAD
from ..problem.term import Unit
from ..terms.registry import judged_requirements

NOTICED_OVERLAP, NOTICED_FORCE = 1e-5, 1e-2
"""Overlap [m] and disturbance [N] below which there is none to speak of."""
BENT = float(np.radians(5.0))
"""Angle between the normals under a fingertip from which it is on a rounded edge [rad]."""


@dataclass(frozen=True, repr=False)
class Violation:
    """By how much a grasp violates one requirement.

    Attributes:
        name: Name of the requirement.
        value: The violation, 0 if it is met.
        unit: Its unit.
    """

    name: str
    value: float
    unit: Unit

    def __repr__(self) -> str:
        return f"Violation({self.text})"

    @property
    def text(self) -> str:
        """Name, value and unit."""
        return f"{self.name} {self.unit.text(self.value)}"


def all_violations(grasp: PosedGrasp) -> tuple[Violation, ...]:
    """Return the violation of every requirement of a grasp's problem.

    Args:
        grasp: The grasp.

    Returns:
        The violations, in the order of the registry.

    Raises:
        InvalidValueError: If a requirement of the user's gives no number.
    """
    found = []
    for term in judged_requirements(grasp.problem):
        value = term.violation(grasp)
        try:
            found.append(Violation(term.name, float(value), term.unit))
        except (TypeError, ValueError):
            raise InvalidValueError(f"violation of {term.name}", value, "one number, 0 if it is met") from None
    return tuple(found)


def not_asked(grasp: PosedGrasp) -> tuple[str, ...]:
    """Return what a grasp's problem did not ask for and the grasp does not have, in words."""
    options, found = grasp.problem.clearance, []
    overlap = max(
        grasp.overlap("link_object") if options.link_object != "geometry" else 0.0,
        grasp.overlap("self_collision") if not options.self_collision else 0.0,
    )
    if overlap > NOTICED_OVERLAP:
        found.append(f"links may overlap: {1e3 * overlap:.3g} mm")
    if not grasp.problem.loads.disturbed:
        held = grasp.passive_margin.size
        found.append(f"holds a push of only {held:.2g} N" if held > NOTICED_FORCE else "holds no disturbance")
    return tuple(found)


def on_edges(grasp: PosedGrasp) -> str:
    """Return which fingertips are on an edge that a finger can't rest on, or on a rounded one, in words."""
    radius = grasp.problem.grasp_object.edge_radius
    if np.isinf(radius):
        return ""
    spread = grasp.problem.grasp_object.normal_spread(grasp.surface_contacts.points, FOOTPRINT)
    names = [frame.name for frame in grasp.problem.frames]
    if (spread > SPREAD).any():
        found = [
            f"{name} {np.degrees(angle):.0f}°" for name, angle in zip(names, spread, strict=True) if angle > SPREAD
        ]
        return f"on an edge: {', '.join(found)}"
    rounded = [name for name, angle in zip(names, spread, strict=True) if angle > BENT]
    return f"on an edge rounded by {1e3 * radius:.3g} mm: {', '.join(rounded)}" if radius and rounded else ""


def verdict(grasp: PosedGrasp, status: str, failures: Sequence[Violation], missing: Sequence[str]) -> str:
    """Return the sentence about a grasp.

    Args:
        grasp: The grasp.
        status: Its status.
        failures: What it violates.
        missing: What was not asked for, in words.

    Returns:
        One sentence.
    """
    if status == "feasible":
        note = "" if grasp.stability.stable else f"; but {grasp.stability.text}"
        edges = f"; {found}" if (found := on_edges(grasp)) else ""
        open_points = f"; not asked for: {', '.join(missing)}" if missing else ""
        return f"feasible: every requirement is met and the contacts are force-closed{note}{edges}{open_points}"
    parts = [f"{failure.text} ({on_edges(grasp)})" if failure.name == "edge" else failure.text for failure in failures]
    if not grasp.force_closed:
        parts.append("not force-closed")
    return f"{status}: " + ", ".join(parts)
