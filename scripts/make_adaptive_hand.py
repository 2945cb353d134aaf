"""Write the adaptive hand: its URDF, and the tables of springs and of its tendon that its description has to hold.

Five fingers of 19 joints, one motor: one tendon flexes all of them against their springs. Every flexion is a rolling
contact, two hinges that turn alike. ``urdf/adaptive_hand/README.md`` says which numbers are published ones.

Usage: ``python scripts/make_adaptive_hand.py [--check] [--output DIR]``
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from math import pi

from hand_files import write_or_check
from make_dlr_hit_ii import MATERIALS, SAME, Body, Link, Solid, Vector, add, add_link, text

NAME = "adaptive_hand"
ROLL, NEXT, TIP = 0.013, 0.009, 0.016  # between the hinges of a joint, on to the next joint, to the tip's centre [m]
LINK_RADIUS, TIP_RADIUS = 0.0065, 0.007  # [m]
# Abduction joint in the palm frame: position [m], roll, pitch, yaw [rad].
FINGERS: dict[str, tuple[Vector, Vector]] = {
    "thumb": ((0.00566972, 0.029616, 0.055314), (0.0, -0.383972758, pi / 2)),
    "index": ((-0.0033, 0.0195, 0.0936994), (pi / 2, -1.48352986, pi / 2)),
    "middle": ((-0.0033, 0.0, 0.100699), (pi, -pi / 2, 0.0)),
    "ring": ((-0.0033, -0.0195, 0.0936994), (-pi / 2, -1.51843643, -pi / 2)),
    "little": ((-0.0033, -0.039, 0.0836994), (-pi / 2, -1.48352986, -pi / 2)),
}
FLEXIONS = {finger: ("inner", "middle", "outer") for finger in FINGERS} | {"thumb": ("inner", "outer")}
THUMB_INNER: tuple[Vector, Vector] = ((0.0225, -0.0033, 0.0), (0.426627577, 0.0, 0.0))
LIMITS = {"abd": (-pi / 6, pi / 6), "flexion": (0.0, pi / 4)}  # [rad], of each hinge
THUMB_LIMITS = (0.0, pi / 2)
ARM, STIFFNESS = 0.010, 0.5  # of a flexion [m], of its spring [N m/rad]
# Moment arms and stiffnesses relative to those of the flexions.
ARMS = {"thumb_abd": 1.3, "index_abd": -0.2, "middle_abd": 0.0, "ring_abd": 0.2, "little_abd": 0.4}
SOFTER = {"thumb_abd": 0.5}


def rod_body(length: float, mass: float) -> Body:
    """Return a uniform rod along x."""
    along, across = mass * LINK_RADIUS**2 / 2, mass * (length**2 / 12 + LINK_RADIUS**2 / 4)
    return Body(mass, (length / 2, 0.0, 0.0), (along, across, across, 0.0, 0.0, 0.0))


def rod(length: float, material: str = "silver", end: str = "") -> Solid:
    """Return a capsule along x."""
    return Solid("capsule", (0.0, 0.0, 0.0), (length, 0.0, 0.0), LINK_RADIUS, material, end)


PALM = Link(
    Body(0.35, (-0.006, -0.005, 0.05), (4.5e-4, 3.5e-4, 3.0e-4, 0.0, 0.0, 0.0)),
    (
        Solid("box", (-0.022, -0.045, 0.0), (0.004, 0.026, 0.078), material="graphite"),
        Solid("capsule", (-0.004, 0.018, 0.02), (0.004, 0.022, 0.045), 0.012, "graphite"),
    ),
)


def joints() -> list[str]:
    """Return the independent joints."""
    return [f"{finger}_{part}" for finger in FINGERS for part in ("abd", *FLEXIONS[finger])]


def add_joint(
    robot: ET.Element,
    name: str,
    links: tuple[str, str],
    place: tuple[Vector, Vector],
    limits: tuple[float, float] | None,
    axis: str,
    mimic: str = "",
) -> None:
    """Write a joint; fixed without limits."""
    element = add(robot, "joint", name=name, type="fixed" if limits is None else "revolute")
    add(element, "parent", link=links[0])
    add(element, "child", link=links[1])
    add(element, "origin", xyz=text(*place[0]), rpy=text(*place[1]))
    if limits is None:
        return
    add(element, "axis", xyz=axis)
    add(element, "limit", lower=text(limits[0]), upper=text(limits[1]), effort="3", velocity="3")
    if mimic:
        add(element, "mimic", joint=mimic, multiplier="1", offset="0")


def add_finger(robot: ET.Element, finger: str) -> None:
    """Write a finger: knuckle, two hinges a flexion, tip. x along the straight finger, flexions about -y."""
    still: Vector = (0.0, 0.0, 0.0)
    knuckle = f"{finger}_knuckle"
    add_link(robot, knuckle, Link(rod_body(NEXT, 0.006)), SAME)
    thumb = finger == "thumb"
    limits = THUMB_LIMITS if thumb else LIMITS["abd"]
    add_joint(robot, f"{finger}_abd", ("palm", knuckle), FINGERS[finger], limits, "0 0 -1" if thumb else "0 0 1")
    below = knuckle
    for part in FLEXIONS[finger]:
        place = THUMB_INNER if below == "thumb_knuckle" else ((NEXT, 0.0, 0.0), still)
        roll, link = f"{finger}_{part}_roll", f"{finger}_{part}_phalanx"
        last = part == "outer"
        add_link(robot, roll, Link(Body(0.001, still, (1e-8, 1e-8, 1e-8, 0.0, 0.0, 0.0))), SAME)
        length = TIP if last else NEXT
        add_link(robot, link, Link(rod_body(length, 0.008), (rod(length, end="rubber" if last else ""),)), SAME)
        name = f"{finger}_{part}"
        add_joint(robot, name, (below, roll), place, LIMITS["flexion"], "0 -1 0")
        add_joint(robot, f"{name}_follows", (roll, link), ((ROLL, 0.0, 0.0), still), LIMITS["flexion"], "0 -1 0", name)
        below = link
    add_link(robot, f"{finger}_tip", Link(colliding=(Solid("sphere", still, radius=TIP_RADIUS),)), SAME)
    add_joint(robot, f"{finger}_end", (below, f"{finger}_tip"), ((TIP, 0.0, 0.0), still), None, "")


def urdf() -> str:
    """Return the URDF."""
    robot = ET.Element("robot", name=NAME)
    robot.append(ET.Comment(" Written by scripts/make_adaptive_hand.py; see README.md. "))
    for name, rgba in MATERIALS.items():
        add(add(robot, "material", name=name), "color", rgba=text(*rgba))
    add_link(robot, "palm", PALM, SAME)
    for finger in FINGERS:
        add_finger(robot, finger)
    ET.indent(robot, "  ")
    return f'<?xml version="1.0"?>\n{ET.tostring(robot, encoding="unicode")}\n'


def compliance_table() -> str:
    """Return the compliances of the joints as TOML [rad/(N m)]."""
    return "\n".join(f"{name} = {1.0 / (STIFFNESS * SOFTER.get(name, 1.0)):g}" for name in joints())


def arms_table() -> str:
    """Return the moment arms of the tendon as TOML [m], joints that it does not turn left out."""
    return "\n".join(f"{name} = {ARM * ARMS.get(name, 1.0):g}" for name in joints() if ARMS.get(name, 1.0) != 0.0)


def main() -> int:
    """Write the URDF, or with --check compare it and the tables of the description with what is there."""
    return write_or_check(
        NAME,
        "Write the adaptive hand.",
        urdf(),
        (compliance_table(), arms_table()),
        "compliance.joint and tendons.motors.tendon.arms",
    )


if __name__ == "__main__":
    sys.exit(main())
