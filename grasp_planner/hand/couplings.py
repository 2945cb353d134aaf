"""Couplings that a description names: they take the place of a URDF's <mimic> before anything else looks at it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import Literal

import numpy as np

from ..exceptions import InvalidValueError, NameNotFoundError, shown
from .description import CouplingDescription
from .urdf_repair import fix_joint

Coupling = CouplingDescription | Literal["free", "fixed"]


def couple(robot: ET.Element, couplings: Mapping[str, Coupling]) -> list[str]:
    """Replace mimics of a URDF in place.

    Args:
        robot: Root element of the URDF.
        couplings: What joints follow, by name.

    Returns:
        One line for each table that was taken as a line.

    Raises:
        NameNotFoundError: If a joint, or one that it follows, does not exist.
        InvalidValueError: If a joint does not move, a factor is 0 or a table has no two different angles.
    """
    joints = {joint.get("name", ""): joint for joint in robot.findall("joint")}
    said = []
    for name, coupling in couplings.items():
        field = f"couplings.{name}"
        for each in (name, *([coupling.joint] if isinstance(coupling, CouplingDescription) else [])):
            if each not in joints:
                raise NameNotFoundError(f"joint of {field}", each, joints)
        joint = joints[name]
        if joint.get("type") == "fixed":
            raise InvalidValueError(field, name, "a joint that moves")
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)
        if coupling == "fixed":
            fix_joint(joint, 0.0)
        elif coupling != "free":
            ratio, offset, line = _law(field, coupling)
            ET.SubElement(joint, "mimic", joint=coupling.joint, multiplier=repr(ratio), offset=repr(offset))
            said += line
    return said


def _law(field: str, coupling: CouplingDescription) -> tuple[float, float, list[str]]:
    """Return factor and offset of a coupling, and what there is to say of its table."""
    if not coupling.table:
        if coupling.ratio == 0.0:
            raise InvalidValueError(f"{field}.ratio", 0.0, 'another number than 0; or "fixed" instead of the table')
        return coupling.ratio, coupling.offset, []
    given = {"ratio", "offset"} & coupling.model_fields_set
    if given:
        allowed = f"either a table or {' and '.join(sorted(given))}"
        raise InvalidValueError(f"{field}.table", list(coupling.table), allowed)
    source, angle = np.array(coupling.table).T
    if np.ptp(source) == 0.0 or np.ptp(angle) == 0.0:
        raise InvalidValueError(f"{field}.table", list(coupling.table), "pairs in which both angles change")
    ratio, offset = np.polyfit(source, angle, 1)
    error = float(np.abs(ratio * source + offset - angle).max())
    said = f"{shown(field)}: the table is taken as {ratio:.4g} times {shown(coupling.joint)} {offset:+.4g}, "
    return float(ratio), float(offset), [said + f"at most {error:.2g} off"]
