"""What a URDF says clumsily and can only mean one thing, put right in its XML; every repair is one line of text."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from ..exceptions import InvalidValueError, NameNotFoundError, shown
from ..spatial import Array
from .urdf_checks import finite_or_nan, joint_range
from .urdf_tree import has_geometry

HALF_TURN = float(np.pi)
"""Limits that a continuous joint gets: ± this [rad]."""
FREE = ("floating", "planar")
"""Kinds of joints that place a hand in the world; here it is placed by its palm."""
LEAST_RANGE = 1e-6
"""Width of limits below which a joint can't move [rad or m]."""


def repair_joints(robot: ET.Element, locked: Mapping[str, float]) -> list[str]:
    """Repair the joints of a URDF in place.

    Joints that place the whole hand are fixed, continuous ones get limits, chains of mimics are flattened, what
    can't move is fixed, limits of mimics that contradict their source's are derived from it, and the joints named
    are locked. What is beyond repair is left as it is, for :func:`~grasp_planner.hand.urdf_checks.joint_defects`.

    Args:
        robot: Root element of the URDF.
        locked: Values of joints that are to be fixed [rad or m], by name.

    Returns:
        One line for each repair.

    Raises:
        NameNotFoundError: If a joint to be locked does not exist.
        InvalidValueError: If one can't be locked, or not at that value.
    """
    joints = {joint.get("name", ""): joint for joint in robot.findall("joint")}
    seen = {link.get("name", "") for link in robot.findall("link") if has_geometry(link)}
    said = [line for joint in joints.values() for line in _tidied(joint, seen)]
    for name, value in locked.items():
        said.append(_lock(joints, name, value))
    said += _flatten_mimics(joints)
    said += _fix_immovable(joints)
    return said + _mimic_limits(joints)


def fix_joint(joint: ET.Element, value: float) -> None:
    """Turn a joint into a fixed one at a value [rad or m]."""
    origin = joint.find("origin")
    if origin is None:
        origin = ET.SubElement(joint, "origin")
    xyz, rpy = (_numbers(origin.get(key), (0.0, 0.0, 0.0)) for key in ("xyz", "rpy"))
    place = pin.SE3(pin.rpy.rpyToMatrix(*rpy), xyz)
    element = joint.find("axis")
    axis = _numbers(None if element is None else element.get("xyz"), (1.0, 0.0, 0.0))
    length = float(np.linalg.norm(axis))
    if value != 0.0 and length > 0.0:
        along = axis / length
        if joint.get("type") == "prismatic":
            place = place * pin.SE3(np.eye(3), along * value)
        else:
            place = place * pin.SE3(pin.exp3(along * value), np.zeros(3))
        origin.set("xyz", " ".join(repr(float(x)) for x in place.translation))
        origin.set("rpy", " ".join(repr(float(x)) for x in pin.rpy.matrixToRpy(place.rotation)))
    joint.set("type", "fixed")
    for tag in ("mimic", "limit", "axis"):
        found = joint.find(tag)
        if found is not None:
            joint.remove(found)


def _tidied(joint: ET.Element, seen: set[str]) -> list[str]:
    """Fix a joint that is free behind a link without geometry and limit one that is endless; say so."""
    name, kind, parent = joint.get("name", ""), joint.get("type", ""), joint.find("parent")
    if kind in FREE and parent is not None and parent.get("link", "") not in seen:
        fix_joint(joint, 0.0)
        return [f"joint {shown(name)} is {kind}: fixed, the hand is placed by its palm"]
    lower, upper = joint_range(joint)
    if kind == "continuous" or (kind == "revolute" and min(upper, -lower) > 2.0 * HALF_TURN + 1e-6):
        joint.set("type", "revolute")
        limit = joint.find("limit")
        if limit is None:
            limit = ET.SubElement(joint, "limit", effort="0", velocity="1")
        limit.set("lower", repr(-HALF_TURN))
        limit.set("upper", repr(HALF_TURN))
        degrees = "" if kind == "continuous" else f", limits {lower:g} to {upper:g}, which may be degrees"
        return [f"joint {shown(name)} turns without end{degrees}: limited to ±π"]
    return []


def _lock(joints: dict[str, ET.Element], name: str, value: float) -> str:
    """Fix a joint that is to be locked; say so."""
    if name not in joints:
        raise NameNotFoundError("joint to lock", name, joints)
    joint = joints[name]
    if joint.get("type") not in ("revolute", "prismatic"):
        raise InvalidValueError("joint to lock", name, "a joint that moves")
    lower, upper = joint_range(joint)
    if not np.isfinite(value) or value < lower - 1e-9 or value > upper + 1e-9:
        raise InvalidValueError(f"value of locked joint {name}", value, f"{lower:g} to {upper:g}")
    unit = "m" if joint.get("type") == "prismatic" else "rad"
    fix_joint(joint, float(value))
    joint.set("at", repr(float(value)))  # what mimics of it follow; URDF readers ignore the attribute
    return f"joint {shown(name)} is locked at {value:g} {unit}"


def _flatten_mimics(joints: dict[str, ET.Element]) -> list[str]:
    """Let every mimic follow an independent joint; fix those that follow a fixed joint or by a factor of 0."""
    said = []
    for name, joint in joints.items():
        law = _resolved(joints, name)
        mimic = joint.find("mimic")
        if law is None or mimic is None or joint.get("type") not in ("revolute", "prismatic"):
            continue
        source, multiplier, offset = law
        if source is None or multiplier == 0.0:
            fix_joint(joint, offset)
            joint.set("at", repr(offset))
            said.append(f"joint {shown(name)} mimics what does not move it: fixed at {offset:g}")
        elif source != mimic.get("joint"):
            said.append(
                f"joint {shown(name)} mimics {shown(mimic.get('joint'))}, itself a mimic: now {shown(source)} directly"
            )
            mimic.attrib |= {"joint": source, "multiplier": repr(multiplier), "offset": repr(offset)}
    return said


def _resolved(joints: dict[str, ET.Element], name: str) -> tuple[str | None, float, float] | None:
    """Return source (None if fixed), multiplier and offset at the end of a chain of mimics; None if it has no end."""
    multiplier, offset, seen = 1.0, 0.0, {name}
    while True:
        joint = joints[name]
        mimic = joint.find("mimic")
        if joint.get("type") == "fixed":
            return None, 0.0, multiplier * finite_or_nan(joint.get("at", "0")) + offset
        if mimic is None:
            return name, multiplier, offset
        factor, shift = finite_or_nan(mimic.get("multiplier", "1")), finite_or_nan(mimic.get("offset", "0"))
        name = mimic.get("joint", "")
        if name in seen or name not in joints or not np.isfinite(factor + shift):
            return None
        seen.add(name)
        multiplier, offset = multiplier * factor, multiplier * shift + offset


def _fix_immovable(joints: dict[str, ET.Element]) -> list[str]:
    """Fix independent joints whose limits leave them no room, then what mimics them."""
    said = []
    for name, joint in joints.items():
        lower, upper = joint_range(joint)
        if joint.get("type") not in ("revolute", "prismatic") or joint.find("mimic") is not None:
            continue
        if 0.0 <= upper - lower < LEAST_RANGE:
            fix_joint(joint, lower)
            joint.set("at", repr(lower))
            said.append(f"joint {shown(name)} has limits without width: fixed at {lower:g}")
    return said + (_flatten_mimics(joints) if said else [])


def _mimic_limits(joints: dict[str, ET.Element]) -> list[str]:
    """Derive the limits of mimics that leave their source no range; say so."""
    said = []
    for name, joint in joints.items():
        mimic = joint.find("mimic")
        source = joints.get("" if mimic is None else mimic.get("joint", ""))
        if mimic is None or source is None or source is joint or source.find("mimic") is not None:
            continue
        low, high = joint_range(source)
        factor, shift = finite_or_nan(mimic.get("multiplier", "1")), finite_or_nan(mimic.get("offset", "0"))
        own_low, own_high = joint_range(joint)
        ends = sorted((factor * low + shift, factor * high + shift))
        shared = min(own_high, ends[1]) - max(own_low, ends[0])
        if np.isfinite(ends).all() and not shared > 0.1 * (ends[1] - ends[0]):
            limit = joint.find("limit")
            if limit is None:
                limit = ET.SubElement(joint, "limit", effort="0", velocity="1")
            limit.set("lower", repr(ends[0]))
            limit.set("upper", repr(ends[1]))
            said.append(
                f"joint {shown(name)} has limits that its source {shown(source.get('name'))} contradicts: "
                f"now {ends[0]:.4g} to {ends[1]:.4g}"
            )
    return said


def _numbers(text: str | None, default: tuple[float, float, float]) -> Array:
    """Return three numbers of an attribute, the default where there are none."""
    values = [finite_or_nan(part) for part in (text or "").split()]
    return np.array(values if len(values) == 3 and np.isfinite(values).all() else default)
