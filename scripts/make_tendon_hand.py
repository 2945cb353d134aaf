"""Write the tendon-driven hand: its URDF, and the tables of springs and tendons that its description has to hold.

Three fingers of two joints, each flexed by one tendon over two pulleys against the springs of its joints; a
fourth motor turns two of the fingers about their bases, by opposite angles. Seven independent joints, four motors.
``urdf/tendon_hand/README.md`` says which numbers are published ones and which are chosen here.

Usage: ``python scripts/make_tendon_hand.py [--check] [--output DIR]``
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from math import pi

from hand_files import write_or_check
from make_dlr_hit_ii import MATERIALS, SAME, Body, Link, Solid, Vector, add, add_link, text

NAME = "tendon_hand"
PROXIMAL, DISTAL = 0.070, 0.045  # proximal joint to flexure's middle, and on to the centre of the tip [m]
LINK_RADIUS, TIP_RADIUS = 0.009, 0.010  # [m]
# Base of each finger in the palm frame [m], and the angle its flexion is turned about z [rad].
FINGERS: dict[str, tuple[Vector, float]] = {
    "thumb": ((-0.045, 0.0, 0.0), 0.0),
    "left": ((0.045, 0.030, 0.0), pi),
    "right": ((0.045, -0.030, 0.0), pi),
}
TURNING = {"left": "", "right": "left_turn"}  # fingers the fourth motor turns, and what the turn mimics
FLEXIONS = ("proximal", "distal")
LIMITS = {"turn": (0.0, 1.2), "proximal": (-0.25, 1.9), "distal": (0.0, 1.5)}  # [rad]
REST = {"turn": 0.2, "proximal": -0.25, "distal": 0.0}  # without tension the springs hold the fingers open [rad]
STIFFNESS = {"turn": 10.0, "proximal": 0.8, "distal": 2.0}  # [N m/rad]
PULLEY = {"proximal": 0.010, "distal": 0.008}  # [m]
LARGEST_TENSION = 200.0  # [N]


def rod_body(length: float, mass: float) -> Body:
    """Return a uniform rod along z."""
    along, across = mass * LINK_RADIUS**2 / 2, mass * (length**2 / 12 + LINK_RADIUS**2 / 4)
    return Body(mass, (0.0, 0.0, length / 2), (across, across, along, 0.0, 0.0, 0.0))


def rod(start: float, length: float) -> Solid:
    """Return a capsule along z."""
    return Solid("capsule", (0.0, 0.0, start), (0.0, 0.0, length), LINK_RADIUS, "silver")


PALM = Link(
    Body(0.45, (0.0, 0.0, -0.03), (4.5e-4, 5.5e-4, 7.5e-4, 0.0, 0.0, 0.0)),
    (Solid("box", (-0.055, -0.045, -0.06), (0.055, 0.045, -0.012), material="graphite"),),
)
LINKS = {
    "base": Link(Body(0.01, (0.0, 0.0, 0.0), (1e-6, 1e-6, 1e-6, 0.0, 0.0, 0.0))),
    "proximal": Link(rod_body(PROXIMAL, 0.05), (rod(0.012, PROXIMAL),)),
    "distal": Link(rod_body(DISTAL, 0.03), (rod(0.0, 0.030),)),
    "tip": Link(colliding=(Solid("sphere", (0.0, 0.0, 0.0), radius=TIP_RADIUS),)),
}


def add_joint(robot: ET.Element, name: str, parent: str, child: str, xyz: Vector, yaw: float, mimic: str) -> None:
    """Write a joint: turns are about z, flexions about y, all else is fixed."""
    part = name.split("_")[1]
    element = add(robot, "joint", name=name, type="revolute" if part in LIMITS else "fixed")
    add(element, "parent", link=parent)
    add(element, "child", link=child)
    add(element, "origin", xyz=text(*xyz), rpy=text(0.0, 0.0, yaw))
    if part not in LIMITS:
        return
    add(element, "axis", xyz="0 0 1" if part == "turn" else "0 1 0")
    lower, upper = LIMITS[part]
    if mimic:
        lower, upper = -upper, -lower
    add(element, "limit", lower=text(lower), upper=text(upper), effort="3", velocity="3")
    if mimic:
        add(element, "mimic", joint=mimic, multiplier="-1", offset="0")


def urdf() -> str:
    """Return the URDF."""
    robot = ET.Element("robot", name=NAME)
    robot.append(ET.Comment(" Written by scripts/make_tendon_hand.py; see README.md. "))
    for name, rgba in MATERIALS.items():
        add(add(robot, "material", name=name), "color", rgba=text(*rgba))
    add_link(robot, "palm", PALM, SAME)
    for finger, (base, yaw) in FINGERS.items():
        for part, link in LINKS.items():
            add_link(robot, f"{finger}_{part}", link, SAME)
        first = f"{finger}_turn" if finger in TURNING else f"{finger}_mount"
        add_joint(robot, first, "palm", f"{finger}_base", base, yaw, TURNING.get(finger, ""))
        below = f"{finger}_base"
        for part, height in {"proximal": 0.0, "distal": PROXIMAL}.items():
            add_joint(robot, f"{finger}_{part}", below, f"{finger}_{part}", (0.0, 0.0, height), 0.0, "")
            below = f"{finger}_{part}"
        add_joint(robot, f"{finger}_end", below, f"{finger}_tip", (0.0, 0.0, DISTAL), 0.0, "")
    ET.indent(robot, "  ")
    return f'<?xml version="1.0"?>\n{ET.tostring(robot, encoding="unicode")}\n'


def joints() -> list[str]:
    """Return the independent joints."""
    turns = [f"{finger}_turn" for finger, mimic in TURNING.items() if not mimic]
    return turns + [f"{finger}_{part}" for finger in FINGERS for part in FLEXIONS]


def tendon_table() -> str:
    """Return the moment arms of the flexion tendons, the radii of their pulleys [m], as TOML."""
    lines = []
    for finger in FINGERS:
        arms = ", ".join(f"{finger}_{part} = {PULLEY[part]:g}" for part in FLEXIONS)
        lines.append(f"{finger} = {{ arms = {{ {arms} }}, limit = {LARGEST_TENSION:.1f} }}")
    return "\n".join(lines)


def rest_table() -> str:
    """Return the posture without tension as a TOML table [rad], joints at zero left out."""
    angles = {name: REST[name.split("_")[1]] for name in joints()}
    return "\n".join(f"{name} = {angle:g}" for name, angle in angles.items() if angle != 0.0)


def stiffness_table() -> str:
    """Return the compliances of the joints as a TOML table."""
    return "\n".join(f"{name} = {1.0 / STIFFNESS[name.split('_')[1]]:.6g}" for name in joints())


def main() -> int:
    """Write the URDF, or with --check compare it and the tables of the description with what is there."""
    return write_or_check(
        NAME,
        "Write the tendon-driven hand.",
        urdf(),
        (stiffness_table(), tendon_table(), rest_table()),
        "compliance.joint, tendons.motors and tendons.rest",
    )


if __name__ == "__main__":
    sys.exit(main())
