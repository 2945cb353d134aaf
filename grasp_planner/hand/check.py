"""What a plain URDF says about a hand: fingers, tips, couplings, limits, and what it leaves open."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import pinocchio as pin

from ..exceptions import GraspPlannerError
from .fingertips import Fingertip, find_fingertip
from .palm_guess import PalmGuess, guess_palm
from .urdf_checks import joint_defects, joint_range, mesh_defects, parse_robot
from .urdf_file import UrdfFile, read_urdf, read_urdf_text, second_opinion


@dataclass(frozen=True)
class JointReport:
    """One moving joint.

    Attributes:
        name: Its name.
        lower: Lower limit [rad]; NaN if there is none.
        upper: Upper limit [rad]; NaN if there is none.
        mimics: Joint it follows; empty if it is independent.
    """

    name: str
    lower: float
    upper: float
    mimics: str = ""


@dataclass(frozen=True)
class FingerReport:
    """One chain of joints from the palm to a tip.

    Attributes:
        name: Name guessed from the links.
        joints: Its moving joints from the palm outwards.
        tip: Where it is likely to touch an object.
    """

    name: str
    joints: tuple[str, ...]
    tip: Fingertip


@dataclass(frozen=True)
class HandCheck:
    """Everything found about a URDF.

    Attributes:
        path: The file.
        name: Name of the robot.
        errors: What keeps it from being used, one line each.
        missing: What a URDF can't say and a person has to, one line each.
        joints: Moving joints in the order of the model.
        fingers: Fingers found; empty if there are errors.
        palm: The palm; None if there are errors.
        ignored: Pairs of links with collision geometry that are neighbours in a chain.
        urdf: The loaded file; None if there are errors.
    """

    path: Path
    name: str
    errors: tuple[str, ...]
    missing: tuple[str, ...] = ()
    joints: tuple[JointReport, ...] = ()
    fingers: tuple[FingerReport, ...] = ()
    palm: PalmGuess | None = None
    ignored: tuple[tuple[str, str], ...] = ()
    urdf: UrdfFile | None = None

    @property
    def usable(self) -> bool:
        """Whether a description can be proposed."""
        return not self.errors


def check_hand(path: Path) -> HandCheck:
    """Look at a URDF and report what kind of hand it is.

    Args:
        path: URDF file.

    Returns:
        The findings; defects of the URDF are listed, not raised.

    Raises:
        FileFormatError: If it can't be read at all, is no XML, or declares entities.
    """
    text = read_urdf_text(path)
    robot = parse_robot(path, text)
    name = robot.get("name") or path.stem
    joints = _moving_joints(robot)
    errors = [*joint_defects(robot), *mesh_defects(path, text, robot)]
    if not errors:
        try:
            urdf = read_urdf(path)
            second_opinion(path)
            return _analysed(path, name, joints, urdf)
        except GraspPlannerError as error:
            errors.append(str(error).removeprefix(f"{path}: "))
    return HandCheck(path, name, tuple(errors), joints=joints)


def _moving_joints(robot: ET.Element) -> tuple[JointReport, ...]:
    """Return the joints that move, as the file lists them."""
    reports = []
    for joint in robot.findall("joint"):
        if joint.get("type") == "fixed":
            continue
        mimic = joint.find("mimic")
        lower, upper = joint_range(joint)
        reports.append(
            JointReport(joint.get("name", ""), lower, upper, "" if mimic is None else mimic.get("joint", ""))
        )
    return tuple(reports)


def _analysed(path: Path, name: str, joints: tuple[JointReport, ...], urdf: UrdfFile) -> HandCheck:
    """Return the findings about a URDF that loads."""
    model = urdf.model
    order = {joint: index for index, joint in enumerate(model.names)}
    joints = tuple(sorted(joints, key=lambda joint: order[joint.name]))
    leaves = [joint for joint in range(1, model.njoints) if len(model.subtrees[joint]) == 1]
    fingers = []
    for leaf in leaves:
        chain = [model.names[joint] for joint in model.supports[leaf] if joint > 0]
        fingers.append((tuple(chain), find_fingertip(urdf, leaf)))
    if len({chain[0] for chain, _ in fingers}) < len(fingers) and len(fingers) > 1:
        trunk = fingers[0][0][0]
        reason = (
            f"fingers branch off behind the moving joint {trunk!r}: cut the URDF at the palm, which has to be its root"
        )
        return HandCheck(path, name, (reason,), joints=joints)
    names = _finger_names([(chain, tip.link) for chain, tip in fingers])
    reports = tuple(FingerReport(label, *entry) for label, entry in zip(names, fingers, strict=True))
    palm = guess_palm(urdf, [model.getFrameId(tip.frame, pin.FrameType.BODY) for _, tip in fingers])
    missing: tuple[str, ...] = (
        "synergies: plan with them all independent, or make a set with scripts/make_native_synergies.py",
        "palm: normal, closing_axis and grasp_centre are guesses from how the fingers close: look at the picture",
        "contact frames and radii are guesses from the last links' geometry",
        "compliance: the numbers are those of [Mavrogiannis2014], not of this hand",
        "remark1: name the abduction joints of neighbouring fingers, if they can cross",
    )
    if len(fingers) < 3:
        missing = (
            f"only {len(fingers)} fingers found, a grasp needs three contacts: name more contact frames",
            *missing,
        )
    return HandCheck(path, name, (), missing, joints, reports, palm, _neighbours(urdf), urdf)


def _neighbours(urdf: UrdfFile) -> tuple[tuple[str, str], ...]:
    """Return pairs of links with collision geometry whose joints follow each other, or that one joint carries."""
    model = urdf.model
    links = {entry.parentFrame: entry.parentJoint for entry in urdf.collision_model.geometryObjects}
    pairs = []
    for first, joint in sorted(links.items()):
        for second, other in sorted(links.items()):
            related = joint == other or model.parents[other] == joint
            if first != second and related and not (joint == other and first > second):
                pairs.append((model.frames[first].name, model.frames[second].name))
    return tuple(pairs)


def _finger_names(fingers: list[tuple[tuple[str, ...], str]]) -> list[str]:
    """Return short, different names of fingers from the names of their joints and last links."""
    known = ("thumb", "index", "middle", "ring", "little", "pinky")
    shorts = []
    for chain, link in fingers:
        same = [len(set(letters)) == 1 for letters in zip(*chain, strict=False)]
        length = same.index(False) if False in same else len(same)
        shared = chain[0][:length].rstrip("_-. 0123456789") if len(chain) > 1 else ""
        shorts.append(next((word for word in known if word in link.lower()), shared or link))
    names = [short if shorts.count(short) == 1 else link for short, (_, link) in zip(shorts, fingers, strict=True)]
    return [re.sub(r"[^A-Za-z0-9_-]", "_", name) for name in names]
