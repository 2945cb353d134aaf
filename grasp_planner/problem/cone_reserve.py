"""What the search keeps off the edge of a friction cone where normals of the true surface are judged."""

from __future__ import annotations

import numpy as np

from ..spatial import Array
from .problem import GraspProblem

NORMAL_ERROR = 0.005
"""By how much a normal of the triangles differs from the smooth one where the edge requirement holds [rad]."""


def cone_reserve(problem: GraspProblem) -> Array:
    """Return what is taken off μ of every contact, of shape (n_c,): zero where distances are exact or not judged.

    A normal that is off by δ takes δ (1 + μ²) of μ away at most.
    """
    exact = problem.grasp_object.distance_error == 0.0 or problem.clearance.link_object != "geometry"
    return (0.0 if exact else NORMAL_ERROR) * (1.0 + np.square(problem.friction))
