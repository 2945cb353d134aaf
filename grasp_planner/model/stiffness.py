"""The stiffness with which a grasp holds its object: matrix, principal axes, centre of compliance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..exceptions import InvalidValueError
from ..spatial import Array, skew
from ..values import Value
from .quasi_static import CompliantGrasp, Preload, quasi_static_maps

NOTHING = 1e-13
"""Stiffnesses below this share of the largest, in SI units, count as none."""


@dataclass(frozen=True, eq=False, repr=False)
class PrincipalStiffness(Value):
    """Principal axes of a stiffness about its centre of compliance; [Lipkin1992].

    Attributes:
        centre: Where a force moves the object most nearly without turning it [m], of shape (3,).
        translational: Stiffnesses against a shift [N/m] with the rotation free, rising, of shape (3,).
        translational_axes: Their unit axes, by columns, of shape (3, 3).
        rotational: Stiffnesses against a turn [N m/rad] with the object held at the centre, rising, of shape (3,).
        rotational_axes: Their unit axes, by columns, of shape (3, 3).
    """

    centre: Array
    translational: Array
    translational_axes: Array
    rotational: Array
    rotational_axes: Array


def grasp_stiffness(springs: CompliantGrasp) -> Array:
    """Return K_o with Δw = K_o Δu for a slow wrench on the object, the references held; [Malvezzi2015].

    Without preload it is G K Gᵀ, K the springs in series, singular along the motions that no contact resists; with
    preload it follows from the same linear system, and need be neither symmetric nor positive.

    Args:
        springs: The grasp.

    Returns:
        K_o, of shape (6, 6), in N/m, N and N m/rad.
    """
    if springs.preload == Preload():
        return np.asarray(springs.grasp @ springs.stiffness @ springs.grasp.T)
    return np.linalg.inv(quasi_static_maps(springs).wrench.object_motion)


def principal_stiffness(stiffness: Array) -> PrincipalStiffness:
    """Return principal stiffnesses, their axes and the centre of compliance of the symmetric part of a stiffness.

    With the compliance C = K_o⁻¹ split into 3 × 3 blocks, a force F at a point r turns the object by
    (C_wv + C_ww r×) F. The centre is the r at which this coupling is symmetric: the centre of compliance where one
    exists, and otherwise the unique centre of [Lipkin1992].

    Args:
        stiffness: K_o, of shape (6, 6), about the origin.

    Returns:
        What there is to know about it.

    Raises:
        InvalidValueError: If the symmetric part is not positive definite.
    """
    symmetric = 0.5 * (stiffness + stiffness.T)
    values = np.linalg.eigvalsh(symmetric)
    if values[0] <= NOTHING * values[-1]:
        raise InvalidValueError("stiffness", "not positive definite", "one with which the object is held")
    compliance = np.linalg.inv(symmetric)
    turning, coupling = compliance[3:, 3:], compliance[3:, :3]
    # The antisymmetric part of C_wv + C_ww r× has the axial vector a + (tr(C_ww) I − C_ww) r, C_ww being symmetric.
    axial = np.array(
        [coupling[2, 1] - coupling[1, 2], coupling[0, 2] - coupling[2, 0], coupling[1, 0] - coupling[0, 1]]
    )
    centre = -np.linalg.solve(np.trace(turning) * np.eye(3) - turning, axial)
    about = moved_stiffness(symmetric, centre)
    shifts, shift_axes = np.linalg.eigh(np.linalg.inv(np.linalg.inv(about)[:3, :3]))
    turns, turn_axes = np.linalg.eigh(about[3:, 3:])
    return PrincipalStiffness(centre, shifts, shift_axes, turns, turn_axes)


def moved_stiffness(stiffness: Array, point: Array) -> Array:
    """Return a stiffness K_o about another point [m]: twists and wrenches taken there instead of at the origin."""
    # Twist at the point: v_p = v + ω × p, so u = T u_p with v = v_p + p × ω.
    move = np.eye(6)
    move[:3, 3:] = skew(point[None])[0]
    return np.asarray(move.T @ stiffness @ move)
