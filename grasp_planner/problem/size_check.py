"""Whether an object has a size that a hand can hold, and in which unit it was likely given if not."""

from __future__ import annotations

import numpy as np

from ..hand.configuration import HandConfiguration
from ..hand.contact_frame import ContactFrame
from ..hand.hand import Hand
from ..objects import GraspObject

THINNEST, LARGEST = 0.01, 5.0
"""Longest side, and shortest side, of what a hand may hold, in lengths from its palm to its farthest contact."""
UNITS = {"millimetres": 1e-3, "centimetres": 1e-2, "metres": 1e3}
"""Units by the factor that mends them (``metres``: lengths that were divided by 1000)."""


class ObjectSizeWarning(UserWarning):
    """An object is far too large or too small for the hand."""


def size_warning(hand: Hand, frames: tuple[ContactFrame, ...], grasp_object: GraspObject) -> str | None:
    """Say why an object is likely given in a wrong unit.

    Args:
        hand: The hand.
        frames: Its contacts.
        grasp_object: The object.

    Returns:
        One line with a guess at the unit; None if the size is not far off.
    """
    sides = 2.0 * np.asarray(grasp_object.half_extents)
    length = hand_length(hand, frames)
    if _fits(sides, length):
        return None
    unit, factor = min(UNITS.items(), key=lambda entry: abs(np.log(entry[1] * sides.max() / length)))
    guess = f"; are these {unit}? Times {factor:g} it would fit" if _fits(factor * sides, length) else ""
    size = " × ".join(f"{side:.3g}" for side in sides)
    side = "large" if sides.min() > length else "small"
    return f"object {grasp_object.kind} of {size} m is far too {side} for hand {hand.name} ({length:.2g} m long){guess}"


def hand_length(hand: Hand, frames: tuple[ContactFrame, ...]) -> float:
    """Return the distance from the palm to the farthest contact with every joint at its middle [m]."""
    centres = HandConfiguration(hand, 0.5 * (hand.lower + hand.upper)).contact_centres(frames)
    return float(np.linalg.norm(centres, axis=1).max())


def _fits(sides: np.ndarray, length: float) -> bool:
    """Return whether a hand of a length may hold something with these sides."""
    return bool(sides.max() >= THINNEST * length and sides.min() <= LARGEST * length)
