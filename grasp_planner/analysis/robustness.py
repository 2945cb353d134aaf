"""Robustness of contacts and of a grasp as [Pozzi2017] has it: how well the best commanded forces keep their limits.

PCR = n_c / min V: every contact sticks. PGR: the largest over all states of the contacts, each stuck, sliding (only its
normal spring is left) or detached, that still hold the object: ker(K Gᵀ) = 0.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..exceptions import InvalidValueError
from ..model.compliance import weighted_right_inverse
from ..model.quasi_static import CompliantGrasp
from ..model.subspaces import commanded_forces
from ..spatial import Array
from ..values import Value
from .friction_cost import ContactLimits, least_friction_cost

State = Literal["stuck", "sliding", "detached"]
STATES: tuple[State, ...] = ("stuck", "sliding", "detached")


@dataclass(frozen=True, eq=False, repr=False)
class Robustness(Value):
    """The robustness of a grasp.

    Attributes:
        value: n / V of the n contacts that touch [N²]; 0 where no forces hold the object.
        states: The state of each contact.
        forces: The best forces [N], of shape (n_c, 3).
    """

    value: float
    states: tuple[State, ...]
    forces: Array


def contact_robustness(
    springs: CompliantGrasp, normals: Array, limits: ContactLimits, wrench: npt.ArrayLike = (0.0,) * 6
) -> Robustness:
    """Return PCR, the potential contact robustness.

    Args:
        springs: The grasp, hard fingers.
        normals: Unit normals into the object, of shape (n_c, 3).
        limits: What the contacts bear.
        wrench: w_ext on the object [N, N m].

    Returns:
        The robustness with all contacts stuck.
    """
    states = tuple[State, ...](STATES[0] for _ in normals)
    return state_robustness(springs, normals, limits, states, wrench) or Robustness(
        0.0, states, np.zeros(np.shape(normals))
    )


def grasp_robustness(
    springs: CompliantGrasp,
    normals: Array,
    limits: ContactLimits,
    wrench: npt.ArrayLike = (0.0,) * 6,
    *,
    stuck: int | None = None,
) -> Robustness:
    """Return PGR, the potential grasp robustness, of all 3^n_c states or of those with so many contacts stuck.

    Args:
        springs: The grasp, hard fingers.
        normals: Unit normals into the object, of shape (n_c, 3).
        limits: What the contacts bear.
        wrench: w_ext on the object [N, N m].
        stuck: The heuristic for many contacts: only states with exactly so many of them stuck; all by default.

    Returns:
        The best state.
    """
    n_c = len(normals)
    if stuck is not None and not 0 <= stuck <= n_c:
        raise InvalidValueError("stuck", stuck, f"0 to {n_c}")
    tried: Iterable[tuple[State, ...]] = itertools.product(STATES, repeat=n_c)
    apart = tuple[State, ...](STATES[2] for _ in normals)
    best = Robustness(0.0, apart, np.zeros((n_c, 3)))
    for states in tried:
        if stuck is not None and states.count("stuck") != stuck:
            continue
        found = state_robustness(springs, normals, limits, states, wrench)
        if found is not None and found.value > best.value:
            best = found
    return best


def state_robustness(
    springs: CompliantGrasp,
    normals: Array,
    limits: ContactLimits,
    states: tuple[State, ...],
    wrench: npt.ArrayLike = (0.0,) * 6,
) -> Robustness | None:
    """Return n / V with the contacts in given states; None where they do not hold the object.

    Args:
        springs: The grasp, hard fingers.
        normals: Unit normals into the object, of shape (n_c, 3).
        limits: What the contacts bear.
        states: The state of each contact.
        wrench: w_ext on the object [N, N m].

    Returns:
        The robustness.
    """
    kept = _kept(normals, states)
    reduced = CompliantGrasp(
        springs.grasp @ kept,
        kept.T @ springs.jacobian,
        springs.basis,
        kept.T @ springs.contact_compliance @ kept,
        springs.joint_compliance,
        springs.synergy_compliance,
    )
    if np.linalg.matrix_rank(reduced.grasp) < 6:
        return None
    share = weighted_right_inverse(reduced.grasp, reduced.stiffness) @ -np.asarray(wrench, dtype=float)
    counted = np.array([{"stuck": [1, 1, 1], "sliding": [1, 1, 0], "detached": [0, 0, 0]}[s] for s in states], float)
    basis = kept @ commanded_forces(reduced)
    found = least_friction_cost(kept @ share, basis, normals, limits, counted=counted)
    touching = sum(state != "detached" for state in states)
    return Robustness(touching / found.value, states, found.forces)


def _kept(normals: Array, states: tuple[State, ...]) -> Array:
    """Return the orthonormal directions in which contacts still have a spring, of shape (3 n_c, n)."""
    columns = []
    for i, (normal, state) in enumerate(zip(normals, states, strict=True)):
        directions = {"stuck": np.eye(3), "sliding": normal[None], "detached": np.zeros((0, 3))}[state]
        for direction in directions:
            column = np.zeros(3 * len(states))
            column[3 * i : 3 * i + 3] = direction
            columns.append(column)
    return np.array(columns).reshape(-1, 3 * len(states)).T
