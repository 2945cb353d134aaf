"""What can be chosen on the page: synergy sets of a hand, ranges of sizes."""

from __future__ import annotations

from typing import Any

from ..exceptions import GraspPlannerError
from ..hand.hand import Hand


def usable_synergy_sets(hand: Hand) -> tuple[str, ...]:
    """Return the names of the hand's synergy sets that can be read."""
    found = []
    for name in hand.synergy_set_names:
        try:
            hand.synergies(name)
        except GraspPlannerError:
            continue
        found.append(name)
    return tuple(found)


def size_range(name: str) -> dict[str, Any]:
    """Return range and step of a size, by its name."""
    if name == "mass":
        return {"min": 0.001, "max": 20.0, "step": 0.01}
    if name == "size":
        return {"min": 0.1, "max": 10.0, "step": 0.01}
    if name == "caps":
        return {"min": 0.0, "max": 1.0, "step": 1.0}
    return {"min": 1e-4, "max": 1.0, "step": 0.001}
