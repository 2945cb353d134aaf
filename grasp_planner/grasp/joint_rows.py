"""The joints of a grasp as rows of a table: what command line, page and exported page tell of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .grasp import Grasp

AT_LIMIT = 1e-3
"""Distance from a joint limit at which a joint is said to be at it [rad]."""


@dataclass(frozen=True)
class JointRow:
    """One joint of a grasp, in the units in which people read it.

    Attributes:
        name: Name of the joint.
        angle: Angle q [°].
        reference: Where the motors alone would put it, q_r [°].
        torque: Torque τ of the contact forces [mN m].
        at_limit: Whether q is at a limit of the joint, or beyond it.
    """

    name: str
    angle: float
    reference: float
    torque: float
    at_limit: bool


def joint_rows(grasp: Grasp) -> tuple[JointRow, ...]:
    """Return a row for every joint of a grasp's hand, in the hand's order."""
    hand = grasp.problem.hand
    columns = (hand.joint_names, grasp.joint_angles, grasp.reference_joint_angles, grasp.joint_torques)
    return tuple(
        JointRow(
            name=name,
            angle=math.degrees(q),
            reference=math.degrees(reference),
            torque=1e3 * float(torque),
            at_limit=bool(min(q - lower, upper - q) < AT_LIMIT),
        )
        for name, q, reference, torque, lower, upper in zip(*columns, hand.lower, hand.upper, strict=True)
    )
