"""What a compliant grasp does by direction, as ellipsoids in three dimensions: stiffness, motion, force."""

from __future__ import annotations

import math

import numpy as np

from ..exceptions import InvalidValueError
from ..spatial import Array
from .manipulability import kinematic_manipulability
from .quasi_static import RANK, CompliantGrasp, quasi_static_maps
from .stiffness import grasp_stiffness, principal_stiffness
from .task import Ellipsoid


def stiffness_ellipsoid(springs: CompliantGrasp) -> tuple[Array, Ellipsoid] | None:
    """Return the principal stiffnesses against a shift, the object free to turn.

    Args:
        springs: The grasp.

    Returns:
        The centre of compliance [m], of shape (3,), and the ellipsoid [N/m]; None where springs do not hold the object.
    """
    try:
        held = principal_stiffness(grasp_stiffness(springs))
    except InvalidValueError:
        return None
    return held.centre, Ellipsoid(held.translational_axes[:, ::-1], held.translational[::-1], 1, degenerate=False)


def kinematic_ellipsoid(springs: CompliantGrasp) -> tuple[Ellipsoid, bool]:
    """Return where motors of length 1 move the object: the shadow, on shifts, of the ellipsoid of twists.

    The twists are those in which no spring bends (:func:`kinematic_manipulability`); where the contacts leave the
    motors none, those in which springs share the motion, V z.

    Args:
        springs: The grasp.

    Returns:
        The ellipsoid [m per unit of the motors], flat with few motors, and whether no spring bends in it.

    Raises:
        InvalidValueError: If the springs leave the object free to move and no motion is free of them.
    """
    found = kinematic_manipulability(springs)
    rigid = len(found.ratios) > 0
    if rigid:
        moved = (found.object_side * np.sqrt(np.maximum(found.ratios, 0.0)))[:3]
    else:
        moved = quasi_static_maps(springs).commands.object_motion[:3]
    axes, sizes, _ = np.linalg.svd(moved)
    lengths = np.pad(sizes, (0, 3 - len(sizes)))
    most = int(np.count_nonzero(lengths >= (1.0 - RANK) * lengths[0]))
    return Ellipsoid(axes, lengths, most, degenerate=most > 1), rigid


def force_ellipsoid(springs: CompliantGrasp) -> Ellipsoid:
    """Return the forces on the object, without a moment, that motor forces of length 1 answer, references held.

    The section through forces of the wrenches w with |σ| = 1, of which
    :func:`~grasp_planner.model.manipulability.force_manipulability` has the axes.

    Args:
        springs: The grasp.

    Returns:
        The ellipsoid [N per unit of the motors' forces]; infinite along forces that no motor feels.

    Raises:
        InvalidValueError: If the springs leave the object free to move.
    """
    felt = quasi_static_maps(springs).wrench.motor_forces[:, :3]
    values, axes = np.linalg.eigh(felt.T @ felt)
    roots = np.sqrt(np.maximum(values, 0.0))
    lengths = np.full(3, math.inf)
    np.divide(1.0, roots, out=lengths, where=roots > max(RANK**0.5 * float(roots[-1]), 1e-300))
    unbounded = bool(np.isinf(lengths[0]))
    most = int(np.count_nonzero(np.isinf(lengths))) if unbounded else 1
    return Ellipsoid(axes, lengths, most, degenerate=unbounded)
