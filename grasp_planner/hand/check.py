"""What a plain URDF says about a hand: fingers, tips, couplings, limits, repairs, and what it leaves open."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from ..exceptions import GraspPlannerError
from .derivation import Derivation, FingerReport, derive
from .description import HandDescription
from .palm_guess import PalmGuess
from .urdf_checks import joint_range
from .urdf_file import RobotText, UrdfFile, build_urdf, read_urdf, repaired_urdf, second_opinion


@dataclass(frozen=True)
class JointReport:
    """One moving joint.

    Attributes:
        name: Its name.
        lower: Lower limit [rad or m]; NaN if there is none.
        upper: Upper limit [rad or m]; NaN if there is none.
        mimics: Joint it follows; empty if it is independent.
    """

    name: str
    lower: float
    upper: float
    mimics: str = ""


@dataclass(frozen=True)
class HandCheck:
    """Everything found about a URDF.

    Attributes:
        path: The file.
        name: Name of the robot.
        errors: What keeps it from being used, one line each.
        missing: What a URDF can't say and a person has to, one line each.
        repairs: What was put right, one line each.
        notes: What is suspicious or was decided, one line each.
        joints: Moving joints in the order of the model.
        urdf: The loaded file; None if there are errors.
        derived: What was derived from it; None if there are errors.
    """

    path: Path
    name: str
    errors: tuple[str, ...]
    missing: tuple[str, ...] = ()
    repairs: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    joints: tuple[JointReport, ...] = ()
    urdf: UrdfFile | None = None
    derived: Derivation | None = None

    @property
    def usable(self) -> bool:
        """Whether a hand can be made of it."""
        return not self.errors

    @property
    def fingers(self) -> tuple[FingerReport, ...]:
        """Fingers found, the one that opposes the others first; empty if there are errors."""
        return () if self.derived is None else self.derived.fingers

    @property
    def palm(self) -> PalmGuess | None:
        """The palm; None if there are errors."""
        return None if self.derived is None else self.derived.palm

    @property
    def description(self) -> HandDescription | None:
        """The description that follows; None if there are errors."""
        return None if self.derived is None else self.derived.description


def check_hand(path: Path, locked: Mapping[str, float] | None = None) -> HandCheck:
    """Look at a URDF and report what kind of hand it is; :func:`~grasp_planner.load_hand` loads what has no errors.

    Args:
        path: URDF file.
        locked: Values of joints that are to be fixed [rad or m], by name.

    Returns:
        The findings; defects of the URDF are listed, not raised.

    Raises:
        FileFormatError: If it can't be read at all, is no XML, too large, or declares entities.
        NameNotFoundError: If a joint to be locked does not exist.
        InvalidValueError: If it can't be locked at its value.
    """
    robot = repaired_urdf(path, locked or {}, find_palm=True)
    errors = list(robot.defects)
    found = HandCheck(
        path,
        robot.robot.get("name") or path.stem,
        tuple(errors),
        repairs=robot.repairs,
        notes=robot.notes,
        joints=_moving_joints(robot),
    )
    if errors:
        return found
    try:
        urdf, derived = derived_hand(robot)
    except GraspPlannerError as error:
        return replace(found, errors=(str(error).removeprefix(f"{path}: "),))
    order = {joint: index for index, joint in enumerate(urdf.model.names)}
    return replace(
        found,
        missing=_missing(derived),
        notes=(*found.notes, *derived.said, *_other_reader(path)),
        joints=tuple(sorted(found.joints, key=lambda joint: order.get(joint.name, len(order)))),
        urdf=urdf,
        derived=derived,
    )


def derived_hand(robot: RobotText) -> tuple[UrdfFile, Derivation]:
    """Build a repaired URDF and derive its description: the one way for checking and for loading.

    Raises:
        FileFormatError: If it can't be built or has no finger.
        InvalidValueError: If limits of coupled joints leave one no range.
    """
    urdf = build_urdf(robot)
    derived = derive(urdf, robot.path.name)
    if derived.description.couplings:
        urdf = read_urdf(robot.path, derived.description.locked, derived.description.couplings)
    return urdf, derived


def _moving_joints(robot: RobotText) -> tuple[JointReport, ...]:
    """Return the joints that move, as the file lists them."""
    reports = []
    for joint in robot.robot.findall("joint"):
        if joint.get("type") != "fixed":
            mimic = joint.find("mimic")
            follows = "" if mimic is None else mimic.get("joint", "")
            reports.append(JointReport(joint.get("name", ""), *joint_range(joint), follows))
    return tuple(reports)


def _other_reader(path: Path) -> tuple[str, ...]:
    """Return what yourdfpy has against the file as it stands, if anything."""
    try:
        second_opinion(path)
    except GraspPlannerError as error:
        return (f"yourdfpy reads it not: {str(error).removeprefix(f'{path}: ')}",)
    return ()


def _missing(derived: Derivation) -> tuple[str, ...]:
    """Return what a URDF can't say."""
    lines = (
        "compliance: the numbers are those of [Mavrogiannis2014], not of this hand",
        "couplings by tendons, springs or tables: a URDF has none but <mimic>; [couplings] and [tendons] say them",
    )
    if len(derived.description.contact_sets["sphere"]) < 3:
        count = len(derived.description.contact_sets["sphere"])
        found = f"only {count} contact{'s' * (count > 1)} found"
        return (f"{found}, a grasp needs three, or two that are soft: name more contact frames", *lines)
    return lines
