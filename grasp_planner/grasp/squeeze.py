"""More or less internal force at the contacts of a grasp whose forces come from springs."""

from __future__ import annotations

import numpy as np

from ..judge.load_check import command_matrix
from ..spatial import Array
from .grasp import Grasp


def balanced(grasp: Grasp, forces: Array) -> Array:
    """Return the intensities nearest to some that balance the load [N], of shape (n_c, d)."""
    left = grasp.grasp_matrix @ forces.ravel() + grasp.problem.external_wrench
    correction: Array = np.linalg.lstsq(grasp.grasp_matrix, -left, rcond=None)[0]
    return forces + correction.reshape(forces.shape)


def squeezed_forces(grasp: Grasp, forces: Array, factor: float) -> Array:
    """Return intensities after the motors moved to multiply the internal part [N], of shape (n_c, d).

    They change by P Δσ, with the Δσ that comes nearest to (factor − 1) times the internal part: few motors can't
    multiply every internal force, and none but theirs is made.

    Args:
        grasp: The grasp.
        forces: Intensities to begin with [N], of shape (n_c, d).
        factor: Factor of the internal part.
    """
    held = balanced(grasp, forces)
    internal = held - balanced(grasp, np.zeros_like(forces))
    by_motors = command_matrix(grasp.problem, grasp.grasp_matrix, grasp.hand_jacobian)
    moved = np.linalg.lstsq(by_motors, (factor - 1.0) * internal.ravel(), rcond=None)[0]
    return held + (by_motors @ moved).reshape(forces.shape)
