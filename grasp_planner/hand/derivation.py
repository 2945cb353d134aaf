"""From a plain URDF to a hand description: what a URDF does not say is derived from its geometry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import coal
import numpy as np

from ..exceptions import FileFormatError
from ..spatial import Array
from .adaptive import Adaptive, find_adaptive
from .closing import Closing, find_closing
from .closing_synergies import CLOSING
from .description import (
    CollisionDescription,
    ComplianceDescription,
    ContactDescription,
    HandDescription,
    PalmDescription,
    SynergyFiles,
)
from .finger_names import finger_names
from .fingers import Finger, find_fingers
from .fingertips import Fingertip
from .motion import HandMotion
from .opposition import Opposition, find_opposition
from .pads import find_fingertips
from .palm_guess import PalmGuess, guess_palm
from .tendons import TENDONS
from .urdf_file import UrdfFile

ROD_COMPLIANCE = 1e-3
"""Default compliance of a joint that slides [m/N]: that of a turning one at a lever of 10 cm."""
BALL = 0.3
"""Radius of a ball as a share of the fingers' length, between them where a tendon has half closed them."""
OPPOSED = "opposed"
"""Name of the contact set of a hand that has more fingers than hold something."""
FEW = 3
"""Number of fingers below which wide pads give two contacts each."""


@dataclass(frozen=True)
class FingerReport:
    """One chain of joints from the palm to a tip.

    Attributes:
        name: Name guessed from the links.
        joints: Its moving joints from the palm outwards.
        tips: Where it is likely to touch an object.
    """

    name: str
    joints: tuple[str, ...]
    tips: tuple[Fingertip, ...]

    @property
    def tip(self) -> Fingertip:
        """Its first contact."""
        return self.tips[0]


@dataclass(frozen=True)
class Derivation:
    """What was derived from a URDF.

    Attributes:
        description: The description that follows.
        fingers: Its fingers, the opposing one first.
        palm: Its palm.
        closing: How it closes.
        opposition: Which of its fingers hold something between them.
        said: What was left out or decided, one line each.
    """

    description: HandDescription
    fingers: tuple[FingerReport, ...]
    palm: PalmGuess
    closing: Closing
    opposition: Opposition
    said: tuple[str, ...]

    def first_object(self) -> str:
        """Return what a first grasp is planned of, as text: a ball for a tendon, which turns no finger by itself."""
        if self.description.tendons is None:
            return self.opposition.first_object()
        return f"sphere:radius={BALL * self.closing.length():.3f},mass=0.1"


def derive(urdf: UrdfFile, file_name: str) -> Derivation:
    """Derive the description of a hand.

    Args:
        urdf: The URDF.
        file_name: How the description names it.

    Returns:
        The description and what it rests on.

    Raises:
        FileFormatError: If it has no finger.
        InvalidValueError: If limits of coupled joints leave one no range.
    """
    motion = HandMotion.of(urdf)
    fingers, said = find_fingers(motion)
    if not fingers:
        raise FileFormatError(urdf.path, "has no finger: no moving chain of joints ends in a link with geometry")
    closing = find_closing(motion, fingers)
    few = len(fingers) < FEW
    tips = [find_fingertips(closing, index, double=few) for index in range(len(fingers))]
    opposition = find_opposition(closing, tips)
    palm = guess_palm(closing)
    model = motion.model
    chains = [tuple(model.names[joint] for joint in finger.chain) for finger in closing.fingers]
    names = finger_names([(chain, tip[0].link) for chain, tip in zip(chains, tips, strict=True)])
    reports = tuple(FingerReport(*entry) for entry in zip(names, chains, tips, strict=True))
    if few:
        said = (*said, f"{len(fingers)} finger{'s' * (len(fingers) > 1)}: a wide pad gives two contacts")
    if len(fingers) > 1:
        said = (*said, f"finger {names[0]} opposes the others ({closing.opposition:.2f} of 1)")
    contact_sets = {"sphere": _contacts(reports)}
    if len(opposition.fingers) < len(fingers):
        holding = [reports[index] for index in opposition.fingers]
        contact_sets = {OPPOSED: _contacts(holding)} | contact_sets
        said = (*said, f"contact set {OPPOSED}: {', '.join(finger.name for finger in holding)} hold an object")
    adaptive = find_adaptive(motion, closing.fingers)
    description = HandDescription(
        name=urdf.name,
        urdf=file_name,
        joints=_joint_order(motion, closing.fingers),
        locked=dict(urdf.locked),
        palm=PalmDescription(
            link=palm.link,
            normal=_rounded(palm.normal),
            closing_axis=_rounded(palm.closing_axis),
            grasp_centre=_rounded(palm.grasp_centre, 4),
        ),
        compliance=ComplianceDescription(joint=_compliance(motion)),
        contact_sets=contact_sets,
        synergies=SynergyFiles(default=CLOSING),
        collision=CollisionDescription(ignore=_never_checked(closing)),
    )
    if adaptive is not None:
        said = (*said, adaptive.said)
        changed = {
            "joints": _freed_order(closing, adaptive),
            "couplings": adaptive.couplings,
            "tendons": adaptive.tendons,
            "compliance": ComplianceDescription(joint=adaptive.compliance),
            "synergies": SynergyFiles(default=TENDONS),
        }
        description = description.model_copy(update=changed)
    return Derivation(description, reports, palm, closing, opposition, said)


def _freed_order(closing: Closing, adaptive: Adaptive) -> tuple[str, ...]:
    """Return the independent joints of a hand with a tendon, finger by finger from the palm outwards."""
    names, couplings = tuple(closing.motion.model.names), adaptive.couplings
    chains = (names[joint] for finger in closing.fingers for joint in finger.chain)
    order = dict.fromkeys(name for name in (*chains, *names[1:]) if couplings.get(name) == "free")
    others = (name for name in closing.motion.joints if name not in couplings)
    return (*order, *others)


def _joint_order(motion: HandMotion, fingers: tuple[Finger, ...]) -> tuple[str, ...]:
    """Return the independent joints finger by finger from the palm outwards: no name decides their order."""
    order: list[int] = []
    for finger in fingers:
        for joint in finger.chain:
            order += [int(k) for k in np.flatnonzero(motion.coupling[joint - 1]) if k not in order]
    order += [k for k in range(len(motion.joints)) if k not in order]
    return tuple(motion.joints[k] for k in order)


def _compliance(motion: HandMotion) -> float | dict[str, float]:
    """Return default compliances: one number, or one for each joint where some slide."""
    slides = {name for name, slide in zip(tuple(motion.model.names)[1:], motion.slides(), strict=True) if slide}
    usual = 0.1
    if not slides & set(motion.joints):
        return usual
    return {name: ROD_COMPLIANCE if name in slides else usual for name in motion.joints}


def _contacts(fingers: Sequence[FingerReport]) -> dict[str, ContactDescription]:
    """Return the contacts by name."""
    found = {}
    for finger in fingers:
        for number, tip in enumerate(finger.tips):
            name = finger.name if len(finger.tips) == 1 else f"{finger.name}_{'ab'[number]}"
            found[name] = ContactDescription(
                frame=tip.frame, radius=tip.radius, offset=tip.offset, normal=tip.normal, patch=tip.patch
            )
    return found


def _never_checked(closing: Closing) -> tuple[tuple[str, str], ...]:
    """Return the pairs of links that are neighbours in a chain, share a joint, or overlap with the hand open."""
    model, geometry = closing.motion.model, closing.motion.collision_model
    poses = closing.motion.poses(closing.rest)
    solid = {int(entry.parentJoint) for entry in geometry.geometryObjects}
    entries = [(model.frames[e.parentFrame].name, int(e.parentJoint), e) for e in geometry.geometryObjects]
    placed = []
    for _, joint, entry in entries:
        pose = poses[joint] * entry.placement
        placed.append(coal.Transform3s(np.array(pose.rotation), np.array(pose.translation)))
    pairs: list[tuple[str, str]] = []
    request, result = coal.CollisionRequest(), coal.CollisionResult()
    for j, (second, after, b) in enumerate(entries):
        for i, (first, before, a) in enumerate(entries[:j]):
            if first == second or (first, second) in pairs or (second, first) in pairs:
                continue
            near = before == after or before == _carrier(model, solid, after) or after == _carrier(model, solid, before)
            result.clear()
            if near or coal.collide(a.geometry, placed[i], b.geometry, placed[j], request, result):
                pairs.append((first, second))
    return tuple(pairs)


def _carrier(model: Any, solid: set[int], joint: int) -> int:
    """Return the nearest joint before one that carries geometry, 0 for the palm; −1 before the palm."""
    if joint == 0:
        return -1
    joint = int(model.parents[joint])
    while joint > 0 and joint not in solid:
        joint = int(model.parents[joint])
    return joint


def _rounded(vector: Array, digits: int = 6) -> tuple[float, float, float]:
    """Return three numbers rounded."""
    x, y, z = (round(float(value), digits) + 0.0 for value in vector)
    return x, y, z
