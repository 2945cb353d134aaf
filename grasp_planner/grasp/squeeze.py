"""More or less internal force at the contacts of a grasp whose forces come from springs."""

from __future__ import annotations

import numpy as np

from ..spatial import Array
from .grasp import Grasp


def balanced(grasp: Grasp, forces: Array) -> Array:
    """Return the intensities nearest to some that balance the load [N], of shape (n_c, d)."""
    left = grasp.grasp_matrix @ forces.ravel() + grasp.problem.external_wrench
    correction: Array = np.linalg.lstsq(grasp.grasp_matrix, -left, rcond=None)[0]
    return forces + correction.reshape(forces.shape)


def squeezed_forces(grasp: Grasp, forces: Array, factor: float) -> Array:
    """Return intensities that balance the load, their internal part multiplied [N], of shape (n_c, d)."""
    carrying = balanced(grasp, np.zeros_like(forces))
    return carrying + factor * (balanced(grasp, forces) - carrying)
