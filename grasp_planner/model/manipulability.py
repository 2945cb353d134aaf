"""How a compliant hand moves its object, and what forces it takes: ratios by direction, as 6-D ellipsoids.

With rotations measured as lengths at L, a unit of motor motion moves the object by at most the root of the largest
ratio. D. Prattichizzo et al., "On the manipulability ellipsoids of underactuated robotic hands with compliance", 2012.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy import linalg

from ..exceptions import NameNotFoundError
from ..spatial import Array
from ..values import Value
from .quasi_static import RANK, CompliantGrasp
from .subspaces import UNMOVED, homogeneous_solution, rigid_body_motions

References = Literal["held", "least"]
"""What the references of the motors do under a wrench on the object."""


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


def force_manipulability(
    springs: CompliantGrasp, length: float = 1.0, *, references: References = "held"
) -> Manipulability:
    """Return |w|²/|σ|² of slow wrenches on the object and the motor forces that answer them.

    A wrench alone does not say what the motors feel, since internal forces may be added. Two answers are named:
    ``held``, the motors' references do not move: what one measures by pulling at the object; ``least``, they move such
    that the change has no part in internal forces and rigid motions (:attr:`HomogeneousSolution.least_external`):
    SynGrasp's ``SGforceManipulability`` with the first six columns, which depends on the units.

    Args:
        springs: The grasp.
        length: L [m]: moments count as m/L.
        references: What the motors' references do.

    Returns:
        One direction for each wrench that the motors feel.

    Raises:
        NameNotFoundError: If there is no such answer.
    """
    if references not in get_args(References):
        raise NameNotFoundError("references", str(references), get_args(References))
    found = homogeneous_solution(springs)
    change = found.external if references == "held" else found.least_external
    return _ratios(change["wrench"] / _scale(length)[:, None], change["motor_forces"])


def _scale(length: float) -> Array:
    """Return what a twist is multiplied by."""
    return np.repeat([1.0, length], 3)


def _ratios(outputs: Array, inputs: Array) -> Manipulability:
    """Return the stationary values of |output x|²/|input x|² over x that the inputs see."""
    _, sizes, right = np.linalg.svd(inputs, full_matrices=False)
    seen = right[sizes > max(RANK * float(sizes.max(initial=0.0)), UNMOVED)].T
    ratios, directions = linalg.eigh(seen.T @ outputs.T @ outputs @ seen, seen.T @ inputs.T @ inputs @ seen)
    found = seen @ directions
    moved = outputs @ found
    size = np.maximum(np.linalg.norm(moved, axis=0), 1e-300)
    return Manipulability(ratios, moved / size, inputs @ found / size)
