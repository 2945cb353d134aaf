"""What in a URDF is allowed but rarely meant: said, never changed."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from .urdf_checks import finite_or_nan, joint_range

MOST_TURN = 2.0 * float(np.pi) + 1e-3
"""Limit beyond which the unit is likely degrees [rad]."""
LEAST_MOMENT = 1e-9
"""Principal moment of inertia below which a link is said to be tiny [kg m²]."""
NAMED = 3
"""How many names a line lists."""


def suspicions(robot: ET.Element, missing_visuals: list[str]) -> list[str]:
    """Return what in a URDF is suspicious, one line for each kind.

    Args:
        robot: Its root element, repaired.
        missing_visuals: Lines about meshes that are only seen and missing.

    Returns:
        The lines.
    """
    moving = [joint for joint in robot.findall("joint") if joint.get("type") in ("revolute", "prismatic")]
    turning = [joint for joint in moving if joint.get("type") == "revolute"]
    kinds = {
        "limits that look like degrees": _names(turning, lambda j: max(np.abs(joint_range(j))) > MOST_TURN),
        "limits of a full turn or more": _names(
            turning, lambda j: MOST_TURN >= max(np.abs(joint_range(j))) > MOST_TURN - 2e-2
        ),
        "effort 0, taken as no limit": _names(moving, lambda j: not _effort(j) > 0.0),
        "no collision geometry": _names(
            [link for link in robot.findall("link") if link.find("visual/geometry") is not None],
            lambda link: link.find("collision/geometry") is None,
        ),
        "no inertia or a tiny one": _names(
            [link for link in robot.findall("link") if link.find("collision/geometry") is not None],
            lambda link: not _moment(link) > LEAST_MOMENT,
        ),
        "no mass above 0": _names(
            [link for link in robot.findall("link") if link.find("inertial/mass") is not None],
            lambda link: not _mass(link) > 0.0,
        ),
    }
    lines = [f"{what}: {_listed(names)}" for what, names in kinds.items() if names]
    return lines + [f"{line} (only seen)" for line in missing_visuals[:NAMED]]


def _names(elements: list[ET.Element], test: object) -> list[str]:
    """Return the names of the elements that a test holds for."""
    assert callable(test)
    return [element.get("name", "") for element in elements if test(element)]


def _listed(names: list[str]) -> str:
    """Return the first names of a list and how many follow."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def _effort(joint: ET.Element) -> float:
    """Return the effort limit of a joint [N m or N]; NaN if there is none."""
    limit = joint.find("limit")
    return finite_or_nan(None if limit is None else limit.get("effort"))


def _mass(link: ET.Element) -> float:
    """Return the mass that a link states [kg]; NaN if it is no number."""
    mass = link.find("inertial/mass")
    return finite_or_nan(None if mass is None else mass.get("value"))


def _moment(link: ET.Element) -> float:
    """Return the least diagonal moment of inertia of a link [kg m²]; NaN if there is none."""
    inertia = link.find("inertial/inertia")
    return min(finite_or_nan(None if inertia is None else inertia.get(key)) for key in ("ixx", "iyy", "izz"))
