"""Clearances of a grasp, if it knows them: the least distance of every link, and the pairs worth drawing.

A grasp knows them as ``clearances``, entries with links, distance and nearest points.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...grasp.grasp import Grasp
from ...spatial import Array

DRAWN_BELOW = 0.03
"""Pairs farther apart than this are not drawn [m]."""


def pairs(grasp: Grasp) -> list[Any]:
    """Return the pairs of solids that are meant to keep clear of each other."""
    return [entry for entry in getattr(grasp, "clearances", ()) if not getattr(entry, "exempt", False)]


def link_clearances(grasp: Grasp) -> dict[str, tuple[float, str]]:
    """Return the least clearance of every link [m] and what it is from."""
    least: dict[str, tuple[float, str]] = {}
    for entry in pairs(grasp):
        for link, other in ((entry.link_a, entry.link_b), (entry.link_b, entry.link_a)):
            if link not in least or entry.distance < least[link][0]:
                least[link] = (float(entry.distance), str(other))
    return least


def closest_lines(grasp: Grasp) -> Array:
    """Return lines between the nearest points of the closest pair of each kind in O [m], of shape (n, 2, 3)."""
    least: dict[str, Any] = {}
    for entry in pairs(grasp):
        if entry.distance < DRAWN_BELOW and (entry.kind not in least or entry.distance < least[entry.kind].distance):
            least[entry.kind] = entry
    lines = [[entry.point_a, entry.point_b] for entry in least.values()]
    return np.array(lines, dtype=float).reshape(-1, 2, 3)
