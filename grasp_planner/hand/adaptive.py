"""Hands whose one motor winds up a tendon: what their URDF writes as mimics of a wire is a tendon against springs.

A joint that moves no geometry and bends three fingers or more at once stands for a tendon or its motor. No gear bends
them: each finger stops at what it touches while the others go on. So the mimics become free joints, the tendon's
moment arms their multipliers [Catalano2014]: without contacts the hand closes as its URDF says.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .description import CouplingDescription, TendonDescription, TendonsDescription
from .fingers import Finger
from .motion import HandMotion

FINGERS, JOINTS = 3, 2
"""Fewest fingers that a tendon bends, and fewest joints of each."""
ARM = 0.01
"""Median moment arm of a tendon [m]; only the arms relative to each other are in the URDF."""
SPRING = 1.0
"""Stiffness of the spring of each joint [N m/rad]: that of the makers' own model of such a hand [PisaSoftHand]."""
LARGEST = 400.0
"""Largest tension [N]."""
ROLLING = 0.999
"""Cosine between the axes of two hinges from which on they are one rolling joint."""


@dataclass(frozen=True)
class Adaptive:
    """A hand whose fingers one tendon bends against springs.

    Attributes:
        couplings: What takes the place of the mimics, by joint.
        tendons: The tendon.
        compliance: C_q of each joint [rad/(N m)].
        said: What was decided, in one line.
    """

    couplings: dict[str, CouplingDescription | Literal["free", "fixed"]]
    tendons: TendonsDescription
    compliance: float
    said: str


def find_adaptive(motion: HandMotion, fingers: tuple[Finger, ...]) -> Adaptive | None:
    """Return how one tendon bends the fingers of a hand; None if it is no such hand.

    Args:
        motion: Its joints, coupled as its URDF says.
        fingers: Its fingers.
    """
    solid = {int(entry.parentJoint) for entry in motion.collision_model.geometryObjects}
    names, slides = tuple(motion.model.names), motion.slides()
    for k, driver in enumerate(motion.joints):
        moved = int(motion.model.getJointId(driver))
        pulled = [joint for joint in range(1, motion.model.njoints) if joint != moved and motion.coupling[joint - 1, k]]
        if solid & set(motion.model.subtrees[moved].tolist()) or any(slides[joint - 1] for joint in pulled):
            continue
        second = {joint: first for joint in pulled if (first := _rolls_on(motion, solid, joint)) in pulled}
        hinges = [joint for joint in pulled if joint not in second]
        if sum(len(set(finger.chain) & set(hinges)) >= JOINTS for finger in fingers) < FINGERS:
            continue
        gains = motion.coupling[:, k]
        usual = float(np.median(np.abs(gains[[joint - 1 for joint in hinges]])))
        start = motion.coupling @ motion.open + motion.offset
        lower, upper = motion.model.lowerPositionLimit, motion.model.upperPositionLimit
        rest = {names[j]: round(float(np.clip(start[j - 1], lower[j - 1], upper[j - 1])), 9) for j in hinges}
        couplings: dict[str, CouplingDescription | Literal["free", "fixed"]] = {driver: "fixed"}
        for joint in pulled:
            rolls = joint in second
            couplings[names[joint]] = _following(motion, k, second[joint], joint) if rolls else "free"
        arms = {names[j]: round(ARM * float(gains[j - 1]) / usual, 6) for j in hinges}
        return Adaptive(
            couplings=couplings,
            tendons=TendonsDescription(
                motors={driver: TendonDescription(arms=arms, limit=LARGEST)},
                rest={name: angle for name, angle in rest.items() if angle != 0.0},
            ),
            compliance=1.0 / SPRING,
            said=f"joint {driver} moves no link and bends {len(hinges)} joints of {len(fingers)} fingers: taken as a "
            "tendon against springs, not as a gear",
        )
    return None


def _rolls_on(motion: HandMotion, solid: set[int], joint: int) -> int:
    """Return the joint right before one about an axis parallel to its, with no geometry between; 0 if there is none."""
    first = int(motion.model.parents[joint])
    axes = motion.axes(motion.open)
    return first if first and first not in solid and abs(axes[first - 1] @ axes[joint - 1]) > ROLLING else 0


def _following(motion: HandMotion, k: int, first: int, joint: int) -> CouplingDescription:
    """Return how the second hinge of a rolling joint follows the first."""
    ratio = float(motion.coupling[joint - 1, k] / motion.coupling[first - 1, k])
    offset = float(motion.offset[joint - 1] - ratio * motion.offset[first - 1])
    return CouplingDescription(joint=tuple(motion.model.names)[first], ratio=ratio, offset=offset)
