"""Closing the hand: along one synergy until every fingertip touches, and the way into a given grasp."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..grasp.grasp import Grasp
from ..model.contacts import find_contacts, fingertip_positions
from ..spatial import Array

Mask = npt.NDArray[np.bool_]

OPENING = 0.035
"""How far the fingertips move away from the object before they close [m]."""
REACH = 1.6
"""Largest change of a synergy coordinate while closing [rad]."""
BISECTIONS = 30
"""Halvings to find where a fingertip touches."""


@dataclass(frozen=True)
class ClosingPath:
    """Postures from open to closed.

    Attributes:
        postures: q [rad], of shape (n, n_q).
        touched: Names of the contacts that were reached.
        missed: Names of the contacts that were not: the synergy or a joint limit ended first.
    """

    postures: Array
    touched: tuple[str, ...]
    missed: tuple[str, ...]


def gap_slopes(grasp: Grasp) -> Array:
    """Return the change of every gap per synergy coordinate [m/rad], of shape (n_c, n_s)."""
    jacobian = grasp.configuration.contact_jacobian(grasp.problem.frames, grasp.contacts.points)
    by_sigma = (jacobian @ grasp.problem.synergies.basis).reshape(len(grasp.contacts.gaps), 3, -1)
    return -np.einsum("ij,ijk->ik", grasp.contacts.normals, by_sigma)


def close_along(grasp: Grasp, synergy: int, steps: int = 45) -> ClosingPath:
    """Return the way the hand closes along one synergy: each finger stops where its fingertip touches.

    The hand first opens along the same synergy. A finger that has stopped stays while the others go on, as
    the joint springs of a soft hand allow.

    Args:
        grasp: Where the hand is now.
        synergy: Index of the synergy.
        steps: Number of postures.

    Returns:
        The postures and which contacts were reached.
    """
    problem, hand = grasp.problem, grasp.problem.hand
    direction = problem.synergies.basis[:, synergy]
    slope = float(gap_slopes(grasp)[:, synergy].mean())
    closing = -np.sign(slope) or 1.0
    opening = min(OPENING / max(abs(slope), 1e-3), REACH)
    begin = np.clip(grasp.joint_angles - closing * opening * direction, hand.lower, hand.upper)
    moves = moved_joints(grasp)
    # A finger that this synergy would open into the object stays where it is.
    own = moves[_gaps(grasp, begin) < 0.0].any(axis=0)
    q, stopped = np.where(own, grasp.joint_angles, begin), np.zeros(len(moves), dtype=bool)
    postures = [q]
    for _ in range(steps - 1):
        free = ~moves[stopped].any(axis=0)
        step = closing * (opening + REACH) / (steps - 1) * direction * free
        following = np.clip(q + step, hand.lower, hand.upper)
        q, stopped = _advance(grasp, q, following, stopped, moves)
        postures.append(q)
        if stopped.all():
            break
    names = [frame.name for frame in problem.frames]
    return ClosingPath(
        postures=np.array(postures),
        touched=tuple(name for name, there in zip(names, stopped, strict=True) if there),
        missed=tuple(name for name, there in zip(names, stopped, strict=True) if not there),
    )


def approach(grasp: Grasp, steps: int = 45) -> Array:
    """Return the way into a grasp: from a hand opened along all its synergies, slowing down at the end.

    Args:
        grasp: The grasp to end in.
        steps: Number of postures.

    Returns:
        Postures q [rad], the grasp's own last, of shape (steps, n_q).
    """
    hand, slopes = grasp.problem.hand, gap_slopes(grasp)
    n_s = slopes.shape[1]
    # Open all fingertips alike, with small motions: damped least squares.
    damping = 1e-4 * np.eye(n_s)
    opening = np.linalg.solve(slopes.T @ slopes + damping, slopes.T @ np.full(len(slopes), OPENING))
    opening *= min(1.0, REACH / max(float(np.abs(opening).max()), 1e-9))
    away = grasp.problem.synergies.basis @ opening
    share = (1.0 + np.cos(np.linspace(0.0, np.pi, steps))) / 2.0
    path = np.clip(grasp.joint_angles + share[:, None] * away, hand.lower, hand.upper)
    path[-1] = grasp.joint_angles
    return path


def moved_joints(grasp: Grasp) -> Mask:
    """Return which joints move which contact, of shape (n_c, n_q)."""
    hand = grasp.problem.hand
    rows = []
    for frame in grasp.problem.frames:
        chain = [hand.model.joints[joint].idx_v for joint in hand.model.supports[frame.joint_id].tolist()[1:]]
        rows.append(np.abs(hand.coupling[chain]).sum(axis=0) > 0.0)
    return np.array(rows)


def _gaps(grasp: Grasp, q: Array) -> Array:
    """Return the gaps at another posture [m], of shape (n_c,)."""
    problem = grasp.problem
    centres = fingertip_positions(problem.hand, problem.frames, q, grasp.palm_pose)
    return find_contacts(centres, problem.radii, problem.grasp_object).gaps


def _advance(grasp: Grasp, q: Array, following: Array, stopped: Mask, moves: Mask) -> tuple[Array, Mask]:
    """Move on, but each finger only to where it touches; return the posture and which fingers have stopped."""
    stopped, following = stopped.copy(), following.copy()
    before, after = _gaps(grasp, q), _gaps(grasp, following)
    for contact in np.flatnonzero(~stopped & (after <= 0.0) & (after < before)):
        low, high = 0.0, 1.0
        for _ in range(BISECTIONS):
            middle = (low + high) / 2.0
            outside = _gaps(grasp, q + middle * (following - q))[contact] > 0.0
            low, high = (middle, high) if outside else (low, middle)
        own = moves[contact]
        following[own] = (q + high * (following - q))[own]
        stopped[contact] = True
    return following, stopped
