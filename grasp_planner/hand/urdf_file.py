"""Reading a URDF strictly: Pinocchio for the model and its collision geometry, the XML for the mimic joints."""

from __future__ import annotations

import importlib.metadata
import logging
import warnings
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from ..exceptions import FileFormatError
from ..files.text import read_text_file, refuse_entities
from .urdf_checks import finite_or_nan, joint_defects, mesh_defects, package_folders, parse_robot

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
        model: Pinocchio model with every joint free (mimic off).
        collision_model: Its collision geometries.
        mimics: Mimic joints by name.
    """

    path: Path
    model: Any
    collision_model: Any
    mimics: dict[str, MimicJoint]


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


def read_urdf(path: Path) -> UrdfFile:
    """Read a URDF of a hand.

    Mimic joints are reported, not built in: Pinocchio has no kinematic Hessians for them.

    Args:
        path: URDF file.

    Returns:
        The model, its collision geometries and its mimic joints.

    Raises:
        FileFormatError: If it can't be read, is malformed, declares a document type (entities), has no moving
            joint, a mimic of a mimic, a joint that is not revolute or has no limits, or collision meshes that are
            missing; the reason names the first defect.
    """
    text = read_urdf_text(path)
    root = parse_robot(path, text)
    for defect in (*joint_defects(root), *mesh_defects(path, text, root, collision_only=True)):
        raise FileFormatError(path, defect)
    mimics = _mimics(path, root)
    try:
        model = pin.buildModelFromXML(text)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pinocchio warns whenever it is told where meshes are
            folders = [str(folder) for folder in package_folders(path, text)]
            collision_model = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION, folders)
    except Exception as error:
        raise FileFormatError(path, f"Pinocchio can't build it: {str(error).splitlines()[0]}") from None
    return UrdfFile(path, model, collision_model, mimics)


def read_urdf_text(path: Path) -> str:
    """Return the text of the file after size and document-type checks."""
    text = read_text_file(path, MAX_URDF_BYTES)
    refuse_entities(path, text)
    return text


def second_opinion(path: Path) -> None:
    """Let yourdfpy read a URDF too, without its meshes: who makes one wants to know what other readers think of it.

    Raises:
        FileFormatError: If yourdfpy can't read it.
    """
    import yourdfpy  # a second to import, and only a check needs it

    logger = logging.getLogger("yourdfpy")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yourdfpy.URDF.load(str(path), build_scene_graph=False, load_meshes=False, build_collision_scene_graph=False)
    except Exception as error:
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise FileFormatError(path, f"is not a valid URDF: {reason}") from None
    finally:
        logger.setLevel(level)


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
            raise FileFormatError(path, f"joint {name!r}: mimic multiplier and offset have to be finite and not 0")
        mimics[name] = MimicJoint(mimic.get("joint", ""), multiplier, offset)
    return mimics
