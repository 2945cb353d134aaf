"""Reading a URDF: repairs said one by one, Pinocchio for model and collision geometry, the XML for mimic joints."""

from __future__ import annotations

import importlib
import importlib.metadata
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from ..exceptions import FileFormatError, shown
from ..files.quiet import quiet
from ..files.text import read_text_file, refuse_entities
from .couplings import Coupling, couple
from .urdf_checks import finite_or_nan, joint_defects, joint_range, mesh_defects, parse_robot, tree_defects
from .urdf_meshes import place_meshes, visuals_for_collision
from .urdf_repair import repair_joints
from .urdf_suspicions import suspicions
from .urdf_tree import joints_before_palm

MAX_URDF_BYTES = 20_000_000
"""Largest URDF that is read."""
ROBOT_DATA = "example-robot-data"
"""Installed package whose URDFs can be named as ``example-robot-data:robots/…``."""


@dataclass(frozen=True)
class MimicJoint:
    """A joint that follows another: angle = multiplier * source + offset.

    Attributes:
        source: Joint it follows.
        multiplier: Gain, dimensionless.
        offset: Angle at source = 0 [rad].
    """

    source: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class UrdfFile:
    """A URDF as loaded.

    Attributes:
        path: The file.
        name: Name of the robot in it.
        model: Pinocchio model with every joint free (mimic off).
        collision_model: Its collision geometries.
        mimics: Mimic joints by name.
        repairs: What was put right in it before, one line each.
        notes: What in it is suspicious, one line each.
        locked: Joints that were locked, with their values [rad or m].
    """

    path: Path
    name: str
    model: Any
    collision_model: Any
    mimics: dict[str, MimicJoint]
    repairs: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    locked: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class RobotText:
    """A URDF after its repairs, before any library has built it.

    Attributes:
        path: The file.
        robot: Its root element, repaired.
        repairs: What was put right, one line each.
        defects: What keeps it from being used, one line each.
        notes: What in it is suspicious, one line each.
        locked: Joints that were locked, with their values [rad or m].
    """

    path: Path
    robot: ET.Element
    repairs: tuple[str, ...]
    defects: tuple[str, ...]
    notes: tuple[str, ...]
    locked: dict[str, float]


def find_robot_file(text: str, folder: Path) -> Path:
    """Return the path of a URDF as a hand description names it.

    Args:
        text: Path relative to the folder, or ``example-robot-data:`` and a path within that package's data.
        folder: Folder of the description.

    Returns:
        The path.

    Raises:
        FileFormatError: If the package is not installed, or the path leaves its data.
    """
    package, colon, inner = text.partition(":")
    if not colon or package != ROBOT_DATA:
        return folder / text
    if Path(inner).is_absolute() or ".." in Path(inner).parts:
        raise FileFormatError(text, f"is no path within the data of {ROBOT_DATA}")
    try:
        data = importlib.metadata.distribution(ROBOT_DATA).locate_file(f"cmeel.prefix/share/{ROBOT_DATA}")
    except importlib.metadata.PackageNotFoundError:
        raise FileFormatError(text, f"needs the package {ROBOT_DATA}, which is not installed") from None
    return Path(str(data)) / inner


def read_urdf(
    path: Path, locked: Mapping[str, float] | None = None, couplings: Mapping[str, Coupling] | None = None
) -> UrdfFile:
    """Read a URDF of a hand.

    Mimic joints are reported, not built in: Pinocchio has no kinematic Hessians for them.

    Args:
        path: URDF file.
        locked: Values of joints that are to be fixed [rad or m], by name.
        couplings: What joints follow in place of their mimics, by name.

    Returns:
        The model, its collision geometries and its mimic joints.

    Raises:
        FileFormatError: If it can't be read, is malformed, declares a document type (entities), has no moving
            joint, a joint that is neither revolute nor prismatic or has no limits, or collision meshes that are
            missing; the reason names the first defect.
        NameNotFoundError: If a joint to be locked or coupled does not exist.
        InvalidValueError: If it can't be locked at its value, or coupled so.
    """
    return build_urdf(repaired_urdf(path, locked or {}, couplings))


def repaired_urdf(
    path: Path,
    locked: Mapping[str, float],
    couplings: Mapping[str, Coupling] | None = None,
    *,
    find_palm: bool = False,
) -> RobotText:
    """Return a URDF as it is after all repairs, with what is still wrong.

    Args:
        path: URDF file.
        locked: Values of joints that are to be fixed [rad or m], by name.
        couplings: What joints follow in place of their mimics, by name.
        find_palm: Whether to lock the joints of a wrist or an arm too, at zero or the limit nearest to it.

    Returns:
        The repaired URDF.

    Raises:
        FileFormatError: If it can't be read at all, is no XML, too large, or declares entities.
        NameNotFoundError: If a joint to be locked or coupled does not exist.
        InvalidValueError: If it can't be locked at its value or coupled so, or there are several hands.
    """
    text, repairs = _robot_text(path)
    robot = parse_robot(path, text)
    repairs += [*visuals_for_collision(robot), *couple(robot, couplings or {}), *repair_joints(robot, locked)]
    locks = dict(locked)
    tree = tree_defects(robot)
    if find_palm and not tree:
        ranges = {joint.get("name", ""): joint_range(joint) for joint in robot.findall("joint")}
        wrist = {name: min(max(0.0, ranges[name][0]), ranges[name][1]) for name in joints_before_palm(robot)}
        if np.isfinite(list(wrist.values())).all():
            repairs += repair_joints(robot, wrist)
            locks |= wrist
    defects = (*joint_defects(robot), *mesh_defects(path, text, robot, collision_only=True))
    notes = suspicions(robot, mesh_defects(path, text, robot) if not defects else [])
    if not defects:
        repairs += place_meshes(robot, path, text)
    return RobotText(path, robot, tuple(repairs), defects, tuple(notes), locks)


def build_urdf(given: RobotText) -> UrdfFile:
    """Build the model of a repaired URDF.

    Raises:
        FileFormatError: If it has defects, or Pinocchio can't build it.
    """
    path = given.path
    for defect in given.defects:
        raise FileFormatError(path, defect)
    mimics = _mimics(path, given.robot)
    text = ET.tostring(given.robot, encoding="unicode")
    try:
        model = pin.buildModelFromXML(text)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pinocchio warns whenever it is told where meshes are
            collision_model = pin.buildGeomFromUrdfString(
                model, text, pin.GeometryType.COLLISION, [str(path.parent.resolve())]
            )
    except Exception as error:
        raise FileFormatError(path, f"Pinocchio can't build it: {str(error).splitlines()[0]}") from None
    name = given.robot.get("name") or path.stem
    return UrdfFile(path, name, model, collision_model, mimics, given.repairs, given.notes, given.locked)


def _robot_text(path: Path) -> tuple[str, list[str]]:
    """Return the text of a URDF after size and document-type checks, and what was done to make it readable."""
    text = read_text_file(path, MAX_URDF_BYTES).removeprefix("\ufeff")
    refuse_entities(path, text)
    if path.suffix == ".xacro" or ("<xacro:" in text and "${" in text):  # what is expanded has no ${…} left
        return _expanded(path), ["expanded by xacro"]
    declaration = text.find("<?xml")
    if declaration > 0 and (text[:declaration].strip() == "" or text.lstrip().startswith("<!--")):
        end = text.find("?>", declaration) + 2
        return text[:declaration] + text[end:], ["something stands before the XML declaration: left out"]
    return text, []


def _expanded(path: Path) -> str:
    """Return the URDF that a xacro file makes."""
    try:
        xacro = importlib.import_module("xacro")
    except ImportError:
        reason = "is a xacro file: install the package xacro, or make a URDF of it with `xacro FILE > hand.urdf`"
        raise FileFormatError(path, reason) from None
    try:
        text = str(xacro.process_file(str(path)).toxml())
    except Exception as error:  # xacro has no single class of errors
        raise FileFormatError(path, f"xacro can't expand it: {(str(error) or 'no reason').splitlines()[0]}") from None
    refuse_entities(path, text)
    return text


def second_opinion(path: Path) -> None:
    """Let yourdfpy read a URDF too, without its meshes: who makes one wants to know what other readers think of it.

    Raises:
        FileFormatError: If yourdfpy can't read it.
    """
    import yourdfpy  # a second to import, and only a check needs it

    options = {"build_scene_graph": False, "load_meshes": False, "build_collision_scene_graph": False}
    try:
        with quiet("yourdfpy"):
            yourdfpy.URDF.load(str(path), **options)
    except Exception as error:
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise FileFormatError(path, f"is not a valid URDF: {reason}") from None


def _mimics(path: Path, robot: ET.Element) -> dict[str, MimicJoint]:
    """Return the mimic joints; that they follow a free joint has been checked."""
    mimics: dict[str, MimicJoint] = {}
    for joint in robot.findall("joint"):
        mimic = joint.find("mimic")
        if mimic is None:
            continue
        name = joint.get("name", "")
        multiplier, offset = finite_or_nan(mimic.get("multiplier", "1")), finite_or_nan(mimic.get("offset", "0"))
        if not (np.isfinite(multiplier) and np.isfinite(offset)) or multiplier == 0.0:
            raise FileFormatError(path, f"joint {shown(name)}: mimic multiplier and offset have to be finite and not 0")
        mimics[name] = MimicJoint(mimic.get("joint", ""), multiplier, offset)
    return mimics
