"""Where hand and object meet: contact points, normals, gaps, the grasp matrix and the hand Jacobian.

The clear versions, one formula each; :mod:`grasp_planner.evaluation.state` evaluates the same things with derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..exceptions import InvalidValueError
from ..hand.configuration import HandConfiguration
from ..hand.contact_frame import ContactFrame
from ..hand.hand import Hand
from ..objects import GraspObject
from ..spatial import Array, Pose, skew
from ..values import Value


@dataclass(frozen=True, eq=False, repr=False)
class Contacts(Value):
    """n_c contacts of a hand with an object, in the object frame O.

    Attributes:
        points: Contact points c_i [m], of shape (n_c, 3).
        normals: Unit normals n_i INTO the object, of shape (n_c, 3).
        gaps: Signed distance between fingertip and object [m], of shape (n_c,).
    """

    points: Array
    normals: Array
    gaps: Array


def find_contacts(centres: Array, radii: Array, grasp_object: GraspObject) -> Contacts:
    """Return the contacts of fingertips with an object (choice A8).

    For a fingertip sphere of radius r around p: gap = φ(p) − r, n = −∇φ(p), c = p + r n; r = 0 is the point
    fingertip of [Mavrogiannis2014].

    Args:
        centres: Fingertip centres p_i in O [m], of shape (n_c, 3).
        radii: Fingertip radii r_i [m], of shape (n_c,).
        grasp_object: The object.

    Returns:
        Contact points, normals into the object and gaps.
    """
    surface = grasp_object.sample(centres)
    normals = -surface.gradient / np.linalg.norm(surface.gradient, axis=1, keepdims=True)
    return Contacts(centres + radii[:, None] * normals, normals, surface.distance - radii)


def grasp_matrix(points: Array) -> Array:
    """Return the grasp matrix G: contact forces to the wrench on the object, ``g = G f``.

    [Mavrogiannis2014] eq. (2), (11): block i is [I; skew(c_i)], hard-finger contacts; the transpose maps the
    object's twist to the velocities of the contact points.

    Args:
        points: Contact points in O [m], of shape (n_c, 3).

    Returns:
        G, of shape (6, 3 n_c), force rows first.
    """
    n_c = len(points)
    upper = np.tile(np.eye(3), (1, n_c))
    lower = skew(points).transpose(1, 0, 2).reshape(3, 3 * n_c)
    return np.vstack([upper, lower])


def hand_jacobian(hand: Hand, frames: tuple[ContactFrame, ...], q: Array, palm_in_object: Pose, points: Array) -> Array:
    """Return the hand Jacobian J of the contact points, palm fixed, from Pinocchio's frame Jacobians.

    [Mavrogiannis2014] eq. (3), (5): velocities of the points of the links that are in contact, in O, by the
    independent joint velocities. Joint torques are ``τ = Jᵀ f`` (1).

    Args:
        hand: The hand.
        frames: Contact frames that touch, n_c of them.
        q: Independent joint angles [rad], of shape (n_q,).
        palm_in_object: Pose of the palm frame in O.
        points: Contact points in O [m], of shape (n_c, 3).

    Returns:
        J [m/rad], of shape (3 n_c, n_q).
    """
    return HandConfiguration(hand, q, palm_in_object).contact_jacobian(frames, points)


def fingertip_positions(hand: Hand, frames: tuple[ContactFrame, ...], q: Array, palm_in_object: Pose) -> Array:
    """Return the points of contact frames in O by Pinocchio's forward kinematics.

    Args:
        hand: The hand.
        frames: Contact frames, n_c of them.
        q: Independent joint angles [rad], of shape (n_q,).
        palm_in_object: Pose of the palm frame in O.

    Returns:
        Positions in O [m], of shape (n_c, 3).
    """
    return HandConfiguration(hand, q, palm_in_object).contact_centres(frames)


def synergy_jacobian(jacobian: Array, basis: Array) -> Array:
    """Return J_s = J S, the Jacobian by synergy velocities; [Mavrogiannis2014] eq. (6).

    Args:
        jacobian: J, of shape (3 n_c, n_q).
        basis: Synergy matrix S, of shape (n_q, n_s).

    Returns:
        J_s, of shape (3 n_c, n_s).
    """
    if jacobian.shape[1] != basis.shape[0]:
        raise InvalidValueError("basis", basis.shape, f"({jacobian.shape[1]}, n_s): one row per joint")
    return jacobian @ basis
