"""Robustness of contacts and of a grasp as [Pozzi2017] has it: how well the best commanded forces keep their limits.

PCR = n_c / min V: every contact sticks. PGR: the largest over all states of the contacts, each stuck, sliding (only its
normal spring is left) or detached, that still hold the object: ker(K Gᵀ) = 0. Since 3^n_c states are many, heuristics
H1 to H4 try fewer. For other contact models than hard fingers give covectors ν for the normals.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from ..exceptions import InvalidValueError, NameNotFoundError
from ..model.compliance import weighted_right_inverse
from ..model.friction import friction_angles
from ..model.quasi_static import CompliantGrasp
from ..model.subspaces import commanded_forces
from ..spatial import Array
from ..values import Value
from .friction_cost import ContactLimits, least_friction_cost

Heuristic = Literal["all", "H1", "H2", "H3", "H4"]
State = Literal["stuck", "sliding", "detached"]
STATES: tuple[State, ...] = ("stuck", "sliding", "detached")
NEAR_DEG = 1.0
"""How near to its normal or to its cone a force of PCR has to be for H1 to settle that the contact slides [degrees]."""


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
        springs: The grasp.
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
    heuristic: Heuristic = "all",
    stuck: int = 2,
    directions: Array | None = None,
) -> Robustness:
    """Return PGR, the potential grasp robustness: the best of all 3^n_c states, or of those a heuristic tries.

    Args:
        springs: The grasp.
        normals: Unit normals into the object, of shape (n_c, 3).
        limits: What the contacts bear.
        wrench: w_ext on the object [N, N m].
        heuristic: Which states are tried, see :func:`candidate_states`; H1 takes the forces of PCR.
        stuck: For H2 and H3, how many contacts are stuck.
        directions: As for :func:`state_robustness`.

    Returns:
        The best state.

    Raises:
        NameNotFoundError: If there is no such heuristic.
        InvalidValueError: If more contacts are to be stuck than there are.
    """
    angles = None
    if heuristic == "H1":
        angles = friction_angles(contact_robustness(springs, normals, limits, wrench).forces, normals)
    apart = tuple[State, ...](STATES[2] for _ in normals)
    best = Robustness(0.0, apart, np.zeros(np.shape(normals)))
    for states in candidate_states(len(normals), heuristic, stuck=stuck, angles=angles, friction=limits.friction):
        found = state_robustness(springs, normals, limits, states, wrench, directions)
        if found is not None and found.value > best.value:
            best = found
    return best


def candidate_states(
    n_c: int, heuristic: Heuristic = "all", *, stuck: int = 2, angles: Array | None = None, friction: float = 0.8
) -> Iterator[tuple[State, ...]]:
    """Yield the states of n_c contacts that a heuristic tries.

    ``all``: 3^n_c. ``H1``: contacts whose force of PCR is within one degree of the normal or of the cone slide, the
    others in all states. ``H2``: so many stuck, the others detached. ``H3``: so many stuck, the others sliding or
    detached. ``H4``: two stuck, two or three sliding, the others detached; all for three contacts or fewer.
    [Pozzi2017], numbered as in SynGrasp's fork.

    Args:
        n_c: Number of contacts.
        heuristic: Its name.
        stuck: For H2 and H3.
        angles: For H1, the angle between force and normal of every contact [rad], of shape (n_c,).
        friction: For H1, μ.

    Yields:
        The state of every contact.

    Raises:
        NameNotFoundError: If there is no such heuristic.
        InvalidValueError: If more contacts are to be stuck than there are, or H1 has no angles.
    """
    if heuristic not in get_args(Heuristic):
        raise NameNotFoundError("heuristic", str(heuristic), get_args(Heuristic))
    if heuristic in ("H2", "H3") and not 0 <= stuck <= n_c:
        raise InvalidValueError("stuck", stuck, f"0 to {n_c}")
    allowed = [STATES] * n_c
    if heuristic == "H1":
        if angles is None:
            raise InvalidValueError("angles", "missing", "given for H1")
        near = math.radians(NEAR_DEG)
        slides = (np.asarray(angles) < near) | (math.atan(friction) - np.asarray(angles) < near)
        allowed = [("sliding",) if each else STATES for each in slides]
    for states in itertools.product(*allowed):
        counts = [states.count(state) for state in STATES]
        if (
            (heuristic == "H2" and (counts[0] != stuck or counts[1]))
            or (heuristic == "H3" and counts[0] != stuck)
            or (heuristic == "H4" and n_c > 3 and (counts[0] != 2 or counts[1] not in (2, 3)))
        ):
            continue
        yield states


def state_robustness(
    springs: CompliantGrasp,
    normals: Array,
    limits: ContactLimits,
    states: tuple[State, ...],
    wrench: npt.ArrayLike = (0.0,) * 6,
    directions: Array | None = None,
) -> Robustness | None:
    """Return n / V with the contacts in given states; None where they do not hold the object.

    Args:
        springs: The grasp.
        normals: Unit normals into the object, of shape (n_c, 3).
        limits: What the contacts bear.
        states: The state of each contact.
        wrench: w_ext on the object [N, N m].
        directions: Unit directions in which sliding contacts still press, for the springs alone, of shape (n_c, 3); the
            normals by default. SynGrasp's fork has the z axis of the base there and lays the force along the normal.

    Returns:
        The robustness.
    """
    reduced = reduced_springs(springs, kept_directions(normals if directions is None else directions, states))
    if np.linalg.matrix_rank(reduced.grasp) < 6:
        return None
    share = weighted_right_inverse(reduced.grasp, reduced.stiffness) @ -np.asarray(wrench, dtype=float)
    counted, laid = counted_limits(states), kept_directions(normals, states)
    found = least_friction_cost(laid @ share, laid @ commanded_forces(reduced), normals, limits, counted=counted)
    touching = sum(state != "detached" for state in states)
    return Robustness(touching / found.value, states, found.forces)


def counted_limits(states: tuple[State, ...]) -> Array:
    """Return which of the three limits of V count for contacts in given states, of shape (n_c, 3)."""
    return np.array([{"stuck": [1, 1, 1], "sliding": [1, 1, 0], "detached": [0, 0, 0]}[s] for s in states], float)


def reduced_springs(springs: CompliantGrasp, kept: Array) -> CompliantGrasp:
    """Return a grasp of which only some contact directions are left, of shape (d n_c, n)."""
    return CompliantGrasp(
        springs.grasp @ kept,
        kept.T @ springs.jacobian,
        springs.basis,
        kept.T @ springs.contact_compliance @ kept,
        springs.joint_compliance,
        springs.synergy_compliance,
    )


def kept_directions(normals: Array, states: tuple[State, ...]) -> Array:
    """Return the orthonormal directions in which contacts still have a spring, of shape (d n_c, n)."""
    columns, d = [], np.shape(normals)[1]
    for i, (normal, state) in enumerate(zip(normals, states, strict=True)):
        directions = {"stuck": np.eye(d), "sliding": normal[None], "detached": np.zeros((0, d))}[state]
        for direction in directions:
            column = np.zeros(d * len(states))
            column[d * i : d * i + d] = direction
            columns.append(column)
    return np.array(columns).reshape(-1, d * len(states)).T
