"""How a compliant hand moves its object, and what forces it takes: ratios by direction, as 6-D ellipsoids.

With rotations measured as lengths at L, a unit of motor motion moves the object by at most the root of the largest
ratio. D. Prattichizzo et al., "On the manipulability ellipsoids of underactuated robotic hands with compliance", 2012.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from ..spatial import Array
from ..values import Value
from .quasi_static import CompliantGrasp, quasi_static_maps
from .subspaces import RANK, rigid_body_motions


@dataclass(frozen=True, eq=False, repr=False)
class Manipulability(Value):
    """Ratios of squares along the principal directions, rising, of shape (k,); directions by columns.

    Attributes:
        ratios: |output|²/|input|².
        object_side: The object's twists or wrenches, unit in the measure of L, of shape (6, k).
        motor_side: What the motors do or feel there, of shape (n_z, k).
    """

    ratios: Array
    object_side: Array
    motor_side: Array


def kinematic_manipulability(springs: CompliantGrasp, length: float = 1.0) -> Manipulability:
    """Return |u|²/|z|² of the motions in which no spring bends.

    Args:
        springs: The grasp.
        length: L [m]: rotations count as L ω.

    Returns:
        One direction for each independent motion of the motors.
    """
    motions = rigid_body_motions(springs)
    return _ratios(_scale(length)[:, None] * motions["object_motion"], motions["synergy_motion"])


def force_manipulability(springs: CompliantGrasp, length: float = 1.0) -> Manipulability:
    """Return |w|²/|σ|² of slow wrenches on the object and the motor forces that answer them, references held.

    Args:
        springs: The grasp.
        length: L [m]: moments count as m/L.

    Returns:
        One direction for each wrench that the motors feel.
    """
    return _ratios(np.diag(1.0 / _scale(length)), quasi_static_maps(springs).wrench.motor_forces)


def _scale(length: float) -> Array:
    """Return what a twist is multiplied by."""
    return np.repeat([1.0, length], 3)


def _ratios(outputs: Array, inputs: Array) -> Manipulability:
    """Return the stationary values of |output x|²/|input x|² over x that the inputs see."""
    _, sizes, right = np.linalg.svd(inputs, full_matrices=False)
    seen = right[sizes > RANK * max(float(sizes.max(initial=0.0)), 1e-300)].T
    ratios, directions = linalg.eigh(seen.T @ outputs.T @ outputs @ seen, seen.T @ inputs.T @ inputs @ seen)
    found = seen @ directions
    moved = outputs @ found
    size = np.maximum(np.linalg.norm(moved, axis=0), 1e-300)
    return Manipulability(ratios, moved / size, inputs @ found / size)
