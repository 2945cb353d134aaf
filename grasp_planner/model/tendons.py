"""What a hand with tendons does where its motors hold: stiffer than with constant tensions, by one clear formula each.

A tendon hand rests where E (q − q₀) = Rᵀ t − Jᵀ f, E = C_q⁻¹ its springs and R its moment arms. Motors that hold their
tensions leave the compliance C_q. Motors that hold their lengths ask R δq = 0, and the tensions change as it takes:
[Catalano2014], adaptive synergies.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..spatial import Array
from .compliance import softened


def held_compliance(joint: npt.ArrayLike, arms: Array) -> Array:
    """Return C_q − C_q Rᵀ (R C_q Rᵀ)⁻¹ R C_q, the compliance of the joints with the lengths of the tendons held.

    It differs from C_q along the synergies C_q Rᵀ only, so that S_⊥ᵀ C_q, which the planned posture obeys, is the same.

    Args:
        joint: C_q [rad/(N m)], a scalar, a diagonal of shape (n_q,) or a matrix of shape (n_q, n_q).
        arms: R [m], of full rank, of shape (n_t, n_q).

    Returns:
        The compliance [rad/(N m)], symmetric positive semidefinite, of shape (n_q, n_q); it maps Rᵀ to zero.
    """
    pulled = softened(arms, joint)  # R C_q
    whole = softened(np.eye(arms.shape[1]), joint)
    found = whole - pulled.T @ np.linalg.solve(pulled @ arms.T, pulled)
    return np.asarray(0.5 * (found + found.T))


def tension_change(joint: npt.ArrayLike, arms: Array) -> Array:
    """Return (R C_q Rᵀ)⁻¹ R C_q, how the tensions of tendons of held length answer torques Jᵀ Δf [N/(N m)].

    Args:
        joint: C_q [rad/(N m)], a scalar, a diagonal of shape (n_q,) or a matrix of shape (n_q, n_q).
        arms: R [m], of full rank, of shape (n_t, n_q).

    Returns:
        The map, of shape (n_t, n_q).
    """
    pulled = softened(arms, joint)
    return np.asarray(np.linalg.solve(pulled @ arms.T, pulled))
