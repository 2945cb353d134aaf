"""What stands for a mesh in the search: capsules where they fit it, otherwise its convex hull with few corners."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from .capsule_fit import FittedCapsules, fit_capsules
from .hull_fit import FittedHull, fit_hull, hull_points

FITS = 1.2e-3
"""How far capsules may stand out of the hull of a mesh [m]; beyond that the hull itself is taken."""
FINEST, ALONG = 1e-3, 40
"""Spacing of points on the hull [m], and most of them along its longest side."""


def fit_mesh(mesh: Any) -> FittedCapsules | FittedHull:
    """Return what holds a mesh and is cheap to measure from.

    Args:
        mesh: coal mesh.

    Returns:
        Capsules if they stand out of its hull by 1.2 mm at most, otherwise the hull.
    """
    hull = fit_hull(mesh)
    spacing = max(FINEST, float(np.ptp(hull.corners, axis=0).max()) / ALONG)
    capsules = fit_capsules(hull_points(hull, spacing))
    if capsules.error > FITS:
        return hull
    return replace(capsules, radii=capsules.radii + hull.rim, error=capsules.error + hull.error)
