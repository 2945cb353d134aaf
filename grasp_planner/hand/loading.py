"""A hand from its description file or from a plain URDF: kinematics, coupling, contacts and palm, checked once."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pinocchio as pin

from ..checks import finite_array, unit_vector
from ..exceptions import InvalidValueError, NameNotFoundError
from ..spatial import Pose, readonly
from .check import HandCheck, derived_hand
from .contact_frame import frame_index
from .coupling import joint_coupling, joint_limits
from .description import HandDescription, find_hand, read_hand_description
from .hand import Hand
from .source import hand_source
from .urdf_file import UrdfFile, find_robot_file, read_urdf, repaired_urdf

URDF_ENDINGS = (".urdf", ".xacro")
"""Endings of files whose description is derived."""
LOCKS = re.compile(r"(?P<path>.+\.(?:urdf|xacro|toml)|\w+):(?P<locks>[^=]+=.*)", re.IGNORECASE | re.DOTALL)
"""A file with joints that are to be fixed, as text: ``arm.urdf:wrist=0.3,elbow=1``."""


def load_hand(name_or_path: str | Path = "dlr_hit_ii_right", locked: Mapping[str, float] | None = None) -> Hand:
    """Load a hand.

    Args:
        name_or_path: Name of a hand of the package, or path of a description file (TOML) or of a URDF, whose
            description is then derived; a path may be followed by joints to lock, ``arm.urdf:wrist=0.3,elbow=1``.
        locked: Values of joints of a URDF that are to be fixed [rad or m], by name; a wrist or an arm before the
            palm that is not named is locked at zero.

    Returns:
        The hand; what was repaired and derived is in its ``findings``.

    Raises:
        NameNotFoundError: If there is no such hand, or the description names a joint or link that does not exist.
        FileFormatError: If the description or the URDF is malformed.
        InvalidValueError: If joint limits or the coupling are unusable.
    """
    return loaded_hand(name_or_path, locked).hand


@dataclass(frozen=True)
class LoadedHand:
    """A hand with what was found on the way.

    Attributes:
        hand: The hand.
        first_object: Text of an object in size for a hand whose description was derived; empty for others.
    """

    hand: Hand
    first_object: str = ""


def locked_joints(texts: Iterable[str]) -> dict[str, float]:
    """Return the joints to be fixed with their values [rad or m], from texts NAME=VALUE.

    Raises:
        InvalidValueError: If a text is not of that form.
    """
    locked = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            locked[name.strip()] = float(value)
        except ValueError:
            raise InvalidValueError("lock", text, "NAME=VALUE with a number in rad or m") from None
    return locked


def loaded_hand(name_or_path: str | Path, locked: Mapping[str, float] | None = None) -> LoadedHand:
    """Load a hand, with a first object in size for it.

    Args:
        name_or_path: As in :func:`load_hand`.
        locked: As there.

    Returns:
        The hand and what was found.

    Raises:
        NameNotFoundError, FileFormatError, InvalidValueError: As there.
    """
    text = None if isinstance(name_or_path, Path) else LOCKS.fullmatch(name_or_path)
    path = find_hand(name_or_path if text is None else text["path"])
    locks = ({} if text is None else locked_joints(text["locks"].split(","))) | dict(locked or {})
    if path.suffix.lower() in URDF_ENDINGS:
        robot = repaired_urdf(path, locks, find_palm=True)
        urdf, derived = derived_hand(robot)
        palm, fingers = derived.description.palm, ", ".join(finger.name for finger in derived.fingers)
        facts = (
            f"fingers: {fingers}",
            f"palm {palm.link}: normal {list(palm.normal)}, closing axis {list(palm.closing_axis)}",
            *derived.said,
        )
        lines = (*(f"repair: {line}" for line in robot.repairs), *(f"derived: {line}" for line in facts))
        hand = hand_of(derived.description, urdf, path)
        return LoadedHand(replace(hand, findings=lines), derived.first_object())
    description = read_hand_description(path)
    file = find_robot_file(description.urdf, path.parent)
    urdf = read_urdf(file, description.locked | locks, description.couplings)
    hand = hand_of(description.model_copy(update={"locked": urdf.locked}), urdf, path)
    return LoadedHand(replace(hand, findings=tuple(f"repair: {line}" for line in urdf.repairs)))


def checked_hand(check: HandCheck) -> LoadedHand:
    """Return the hand of a check without errors, which has read the URDF and derived its description already."""
    assert check.urdf is not None and check.derived is not None
    return LoadedHand(hand_of(check.derived.description, check.urdf, check.path), check.derived.first_object())


def hand_of(description: HandDescription, urdf: UrdfFile, path: Path) -> Hand:
    """Return the hand of a description and its URDF.

    Args:
        description: The description.
        urdf: The URDF it names.
        path: The file that is loaded; relative paths start from its folder.

    Returns:
        The hand.

    Raises:
        NameNotFoundError: If the description names a joint or link that does not exist.
        InvalidValueError: If joint limits or the coupling are unusable.
    """
    model = urdf.model
    coupling, offset = joint_coupling(model, description.joints, urdf.mimics)
    palm_in_root = _palm_placement(model, description.palm.link)
    lower, upper = joint_limits(model, description.joints, coupling, offset)
    hand = Hand(
        description=description,
        folder=path.parent,
        model=model,
        collision_model=urdf.collision_model,
        coupling=readonly(coupling),
        coupling_offset=readonly(offset),
        lower=readonly(lower),
        upper=readonly(upper),
        palm_in_root=palm_in_root,
        palm_normal=unit_vector("palm.normal", description.palm.normal),
        closing_axis=unit_vector("palm.closing_axis", description.palm.closing_axis),
        grasp_centre=finite_array("palm.grasp_centre", description.palm.grasp_centre, (3,)),
        source=hand_source(path, description, urdf.path, urdf.collision_model),
    )
    _ = hand.joint_compliance, hand.tendons  # checked now and not in the middle of a search
    return hand


def _palm_placement(model: Any, link: str) -> Pose:
    """Return the pose of the palm link in the root frame; the palm has to be fixed to the root."""
    index = frame_index(model, link)
    if index is None:
        raise NameNotFoundError("link", link, (f.name for f in model.frames if f.type == pin.FrameType.BODY))
    frame = model.frames[index]
    if frame.parentJoint != 0:
        raise InvalidValueError("palm.link", link, "a link fixed to the root of the URDF")
    return Pose.of(frame.placement)
