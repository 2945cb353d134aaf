"""What keeps a URDF from being used as a hand, found before any library builds it: one clear line for each defect."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path

import coal
import numpy as np

from ..exceptions import MAX_VALUE, FileFormatError, cut, shown
from ..files.reading import MESH_SUFFIXES, read_bounded
from ..files.scenes import check_scene
from ..processes.guarded import number_or_death
from .urdf_meshes import find_mesh, package_folders

MAX_MESH_BYTES = 100_000_000
"""Most bytes of meshes of a URDF that are read, of one and of all together."""
MAX_LINKS = 2000
"""Most links, and most joints, of a URDF that is read."""
MAX_TRIANGLES = 1_000_000
"""Most triangles of a mesh that a link collides with."""
USES = ("collision", "visual")
"""Elements of a link that name meshes."""


def parse_robot(path: Path, text: str) -> ET.Element:
    """Return the root element of a URDF.

    Args:
        path: The file, for messages.
        text: Its text, without a document type.

    Returns:
        The <robot> element.

    Raises:
        FileFormatError: If it has too many links or joints, is no XML or its root is not <robot>.
    """
    for tag in ("link", "joint"):
        if len(re.findall(rf"<{tag}\b", text)) > MAX_LINKS:
            raise FileFormatError(path, f"has more than the {MAX_LINKS} {tag}s allowed")
    try:
        robot = ET.fromstring(text)
    except ET.ParseError as error:
        raise FileFormatError(path, f"is not valid XML: {error}") from None
    if robot.tag != "robot":
        raise FileFormatError(path, f"is no URDF: its root element is <{cut(robot.tag, MAX_VALUE)}>, not <robot>")
    return robot


def joint_defects(robot: ET.Element) -> list[str]:
    """Return what is wrong with the joints, one line each: kinds, limits, axes, mimics and the tree they make."""
    joints = robot.findall("joint")
    if not any(joint.get("type") != "fixed" for joint in joints):
        return ["has no moving joint"]
    by_name = {joint.get("name", ""): joint for joint in joints}
    defects = [line for joint in joints if joint.get("type") != "fixed" for line in _moving_defects(joint, by_name)]
    return [*defects, *tree_defects(robot)]


def mesh_defects(path: Path, text: str, robot: ET.Element, *, collision_only: bool = False) -> list[str]:
    """Return the mesh files that are missing or too large, and collision meshes that can't be read, one line each.

    Args:
        path: The URDF.
        text: Its text.
        robot: Its root element.
        collision_only: Whether meshes that are only seen do not matter.

    Returns:
        The lines; empty if every mesh is there.
    """
    folders = package_folders(path, text)
    solid, seen = (
        {mesh.get("filename", "") for place in robot.iter(tag) for mesh in place.iter("mesh")} for tag in USES
    )
    lines, total = [], 0
    for name in sorted(solid if collision_only else solid | seen):
        found = find_mesh(name, path, folders)
        if found is None:
            lines.append(f"mesh {shown(name)} is missing")
            continue
        total += found.stat().st_size
        if found.stat().st_size > MAX_MESH_BYTES:
            lines.append(f"mesh {shown(name)} is larger than the {MAX_MESH_BYTES} bytes allowed")
        elif total > MAX_MESH_BYTES:
            return [*lines, f"meshes up to {shown(name)} are larger than the {MAX_MESH_BYTES} bytes allowed together"]
        elif name in solid:
            lines += _solid_defects(name, found)
    return lines


def joint_range(joint: ET.Element) -> tuple[float, float]:
    """Return the limits of a joint [rad], NaN where there is no finite number."""
    limit = joint.find("limit")
    if limit is None:
        return float("nan"), float("nan")
    return finite_or_nan(limit.get("lower")), finite_or_nan(limit.get("upper"))


def _moving_defects(joint: ET.Element, by_name: dict[str, ET.Element]) -> list[str]:
    """Return what is wrong with a joint that moves."""
    name, kind, mimic, axis = joint.get("name", ""), joint.get("type", ""), joint.find("mimic"), joint.find("axis")
    if kind not in ("revolute", "prismatic"):
        found = cut(kind, MAX_VALUE) or "of no type"
        return [f"joint {shown(name)} is {found}: only revolute and prismatic joints are supported"]
    defects = []
    lower, upper = joint_range(joint)
    if not lower < upper:
        defects.append(f"joint {shown(name)} has no usable limits: lower and upper have to be numbers, lower < upper")
    if axis is not None:
        along = [finite_or_nan(part) for part in axis.get("xyz", "1 0 0").split()]
        if len(along) != 3 or not np.linalg.norm(along) > 1e-6:
            defects.append(f"joint {shown(name)} has no usable axis: three numbers that are not all zero")
    if mimic is None:
        return defects
    source = by_name.get(mimic.get("joint", ""))
    if source is None:
        defects.append(f"joint {shown(name)} mimics {shown(mimic.get('joint'))}, which does not exist")
    elif source.find("mimic") is not None:  # chains that end have been flattened
        defects.append(f"joint {shown(name)} mimics {shown(source.get('name'))}, which leads back to itself")
    return defects


def tree_defects(robot: ET.Element) -> list[str]:
    """Return why links and joints make no tree: names given twice, ends that are missing, loops, several roots."""
    defects = []
    for tag in ("link", "joint"):
        counts = Counter(element.get("name", "") for element in robot.findall(tag))
        defects += [f"a {tag} has no name"] if "" in counts else []
        defects += [f"{tag} {shown(name)} is defined {count} times" for name, count in counts.items() if count > 1]
    links = {link.get("name", "") for link in robot.findall("link")}
    parents: dict[str, str] = {}
    for joint in robot.findall("joint"):
        ends = {}
        for tag in ("parent", "child"):
            element = joint.find(tag)
            ends[tag] = "" if element is None else element.get("link", "")
            if ends[tag] not in links:
                defects.append(
                    f"joint {shown(joint.get('name'))} has no {tag} link that exists (got {shown(ends[tag])})"
                )
        if ends["child"] in parents:
            defects.append(f"link {shown(ends['child'])} hangs on two joints; closed chains are not supported")
        parents[ends["child"]] = ends["parent"]
    roots = sorted(links - set(parents))
    if not defects and len(roots) != 1:
        what = f"has several roots ({', '.join(roots)})" if roots else "has no root link: its joints close a loop"
        defects.append(f"{what}; links have to make one tree")
    return defects


def _solid_defects(name: str, path: Path) -> list[str]:
    """Return why a link can't collide with a mesh, one line or none."""
    if path.suffix.lower() not in MESH_SUFFIXES:
        return [f"mesh {shown(name)} is none of {', '.join(MESH_SUFFIXES)}"]
    try:
        check_scene(path, read_bounded(path, MAX_MESH_BYTES))
        # Assimp has many ways to fail, and some of them end the process.
        triangles = number_or_death(lambda: coal.MeshLoader().load(str(path), np.ones(3)).num_tris)
    except FileFormatError as error:
        return [f"mesh {shown(name)} {error.reason}"]
    if not triangles:
        return [f"mesh {shown(name)} is no mesh that can be read"]
    if triangles > MAX_TRIANGLES:
        return [f"mesh {shown(name)} has {triangles} triangles, more than the {MAX_TRIANGLES} allowed"]
    return []


def finite_or_nan(text: str | None) -> float:
    """Return a finite number of the file, NaN if it is none."""
    try:
        value = float(text or "nan")
    except ValueError:
        return float("nan")
    return value if np.isfinite(value) else float("nan")
