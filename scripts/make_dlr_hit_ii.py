"""Write the URDFs of the DLR/HIT Hand II, right and left, from one table.

Every number is given for the right hand; ``urdf/dlr_hit_ii/README.md`` says where it comes from. The left
hand is its mirror image, y -> -y in the palm frame. In the frames of the finger links z (lateral) is mirrored
instead: x stays along the finger, y on the palmar side and every joint axis +z, so that equal joint angles
are mirrored postures.

Usage: ``python scripts/make_dlr_hit_ii.py [--check] [--output DIR]``
"""

from __future__ import annotations

import argparse
import math
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

Vector = tuple[float, float, float]

OUTPUT = Path(__file__).parents[1] / "urdf" / "dlr_hit_ii"
SIDES = ("right", "left")
TOTAL_MASS = 1.5
MATERIALS = {
    "graphite": (0.16, 0.17, 0.19, 1.0),
    "silver": (0.66, 0.68, 0.70, 1.0),
    "rubber": (0.07, 0.07, 0.08, 1.0),
}
SAME: Vector = (1.0, 1.0, 1.0)
PALM_MIRROR: Vector = (1.0, -1.0, 1.0)
FINGER_MIRROR: Vector = (1.0, 1.0, -1.0)


@dataclass(frozen=True)
class Body:
    """Mass [kg], centre of mass [m], inertia there (xx, yy, zz, xy, xz, yz) [kg m^2], in the link frame."""

    mass: float
    com: Vector
    inertia: tuple[float, float, float, float, float, float]

    def mirrored(self, mirror: Vector) -> Body:
        """Reflect: the products of inertia of the flipped axis change sign."""
        (x, y, z), (xx, yy, zz, xy, xz, yz) = mirror, self.inertia
        return Body(self.mass, scale(self.com, mirror), (xx, yy, zz, x * y * xy, x * z * xz, y * z * yz))


@dataclass(frozen=True)
class Solid:
    """A capsule or cylinder from `start` to `end`, a sphere at `start`, a box between these corners [m]."""

    kind: str
    start: Vector
    end: Vector = (0.0, 0.0, 0.0)
    radius: float = 0.0
    material: str = "silver"
    end_material: str = ""

    def mirrored(self, mirror: Vector) -> Solid:
        """Reflect the two points which span the solid."""
        return replace(self, start=scale(self.start, mirror), end=scale(self.end, mirror))

    def visuals(self) -> tuple[Solid, ...]:
        """Return what any viewer can draw: for a capsule, a cylinder and its two end spheres."""
        if self.kind != "capsule":
            return (self,)
        last = replace(self, kind="sphere", start=self.end, material=self.end_material or self.material)
        return replace(self, kind="cylinder"), replace(self, kind="sphere"), last


@dataclass(frozen=True)
class Link:
    """A link: mass properties, solids which are drawn and collide, and those which do only one of the two."""

    body: Body | None = None
    solids: tuple[Solid, ...] = ()
    drawn: tuple[Solid, ...] = ()
    colliding: tuple[Solid, ...] = ()


@dataclass(frozen=True)
class Joint:
    """A joint of a finger: child link, pose in the parent [m, rad], effort [N m]; fixed without limits."""

    name: str
    child: str
    xyz: Vector
    rpy: Vector
    limits_deg: tuple[float, float] | None = None
    effort: float = 0.0
    mimic: str = ""


# --- The right hand -----------------------------------------------------------------------------------
VELOCITY = math.pi  # [rad/s]
TIP, PAD, PAD_RADIUS = 0.025, 0.0165, 0.010  # past the DIP joint [m]
# Abduction joint in the palm frame: xyz [m], rpy [rad].
FINGERS: dict[str, tuple[Vector, Vector]] = {
    "thumb": ((0.062569057, 0.044544548, 0.080044647), (0.225804, -1.083656, 0.411360)),
    "index": ((-0.002529881, 0.036800135, 0.108743545), (math.radians(175), -math.pi / 2, 0.0)),
    "middle": ((-0.0037, 0.010, 0.119043545), (math.pi, -math.pi / 2, 0.0)),
    "ring": ((-0.002529881, -0.016800135, 0.114043545), (-math.radians(175), -math.pi / 2, 0.0)),
    "little": ((0.000971571, -0.043396306, 0.095043545), (-math.radians(170), -math.pi / 2, 0.0)),
}
# The same chain in every finger. Phalanges: x along the finger, y palmar. Tip and pad: z along it, x palmar.
CHAIN = (
    Joint("abd", "base", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (-15, 15), 1.15),
    Joint("mcp", "proximal", (0.0, 0.0, 0.0), (math.pi / 2, 0.0, 0.0), (0, 85), 1.15),
    Joint("pip", "medial", (0.055, 0.0, 0.0), (0.0, 0.0, 0.0), (0, 65), 0.6),
    Joint("dip", "distal", (0.025, 0.0, 0.0), (0.0, 0.0, 0.0), (0, 65), 0.35, mimic="pip"),
    Joint("tip_fixed", "tip", (TIP, 0.0, 0.0), (math.pi / 2, 0.0, math.pi / 2)),
    Joint("pad_fixed", "pad", (PAD, 0.0, 0.0), (math.pi / 2, 0.0, math.pi / 2)),
)


def hinge(half_width: float) -> Solid:
    """Return the axle which is drawn at the joint of a phalanx."""
    return Solid("cylinder", (0.0, 0.0, -half_width), (0.0, 0.0, half_width), 0.0065, "graphite")


FINGER_LINKS = {
    "base": Link(
        Body(0.0176, (0.0, 0.0, 0.0), (1.345e-6, 1.9874e-6, 1.0419e-6, 0.0, 0.0, 0.0)),
        drawn=(Solid("cylinder", (0.0, -0.006, 0.0), (0.0, 0.006, 0.0), 0.0165, "graphite"),),
    ),
    "proximal": Link(
        Body(
            0.0443706,
            (0.0301645, -0.0010131, 0.0005081),
            (4.50228e-6, 8.66110e-6, 10.10599e-6, -0.448094e-6, -0.259885e-6, -0.005788e-6),
        ),
        (Solid("capsule", (0.018, 0.004, 0.0), (0.055, 0.002, 0.0), 0.011),),
    ),
    "medial": Link(
        Body(
            0.0271102,
            (0.0057272, -0.0016164, -0.0011568),
            (2.18291e-6, 3.29004e-6, 3.46923e-6, 0.155073e-6, -0.035988e-6, 0.007577e-6),
        ),
        (Solid("capsule", (0.0, 0.0, 0.0), (0.025, 0.0, 0.0), 0.011),),
        (hinge(0.0117),),
    ),
    "distal": Link(
        Body(  # turned by -90 degrees about z from the maker's frame, whose y runs along the finger
            0.0181797,
            (0.0061008, 0.0008335, 0.0017728),
            (0.776196e-6, 1.85295e-6, 1.89458e-6, -0.065963e-6, 0.191790e-6, 0.027645e-6),
        ),
        # Its end cap is the pad's sphere, so that a touching pad touches with the link's own surface.
        (Solid("capsule", (0.0, 0.0, 0.0), (PAD, 0.0, 0.0), PAD_RADIUS, end_material="rubber"),),
        (hinge(0.0115),),
    ),
    "tip": Link(),
    "pad": Link(colliding=(Solid("sphere", (0.0, 0.0, 0.0), radius=PAD_RADIUS),)),
}
PALM = Link(
    Body(
        TOTAL_MASS - len(FINGERS) * sum(link.body.mass for link in FINGER_LINKS.values() if link.body),
        (0.0112, 0.0, 0.0566),
        (1.884e-3, 1.863e-3, 1.594e-3, 0.0, 0.0, 0.0),
    ),
    (
        Solid("box", (-0.034, -0.060, -0.002), (0.036, 0.058, 0.098), material="graphite"),
        Solid("box", (-0.032, -0.032, 0.098), (0.014, 0.052, 0.122), material="graphite"),
        Solid("capsule", (0.040, 0.034, 0.030), (0.0605, 0.0425, 0.072), 0.0225, "graphite"),
    ),
    (Solid("cylinder", (0.0, 0.0, -0.012), (0.0, 0.0, -0.002), 0.038),),
)


# --- Writing ------------------------------------------------------------------------------------------
def scale(vector: Vector, factors: Vector) -> Vector:
    """Multiply componentwise."""
    return (vector[0] * factors[0], vector[1] * factors[1], vector[2] * factors[2])


def text(*values: float) -> str:
    """Format numbers for the URDF, to ten digits and without negative zeros."""
    return " ".join(f"{value + 0.0:.10g}" for value in values)


def add(parent: ET.Element, tag: str, **attributes: str) -> ET.Element:
    """Append a child element."""
    return ET.SubElement(parent, tag, attributes)


def add_geometry(element: ET.Element, solid: Solid) -> None:
    """Write origin and geometry of a solid; a capsule becomes the cylinder between its two end points."""
    span = [b - a for a, b in zip(solid.start, solid.end, strict=True)]
    length, rpy = math.hypot(*span), (0.0, 0.0, 0.0)
    centre = [(a + b) / 2 for a, b in zip(solid.start, solid.end, strict=True)]
    if solid.kind == "sphere":
        shape, size, centre = "sphere", {"radius": text(solid.radius)}, list(solid.start)
    elif solid.kind == "box":
        shape, size = "box", {"size": text(*map(abs, span))}
    else:
        shape, size = "cylinder", {"radius": text(solid.radius), "length": text(length)}
        rpy = (0.0, math.acos(span[2] / length), math.atan2(span[1], span[0]))
    add(element, "origin", xyz=text(*centre), rpy=text(*rpy))
    add(add(element, "geometry"), shape, **size)


def add_link(robot: ET.Element, name: str, link: Link, mirror: Vector) -> None:
    """Write a link with its mass, what is drawn, what collides and which of the cylinders are capsules."""
    element = add(robot, "link", name=name)
    if link.body:
        body = link.body.mirrored(mirror)
        inertial = add(element, "inertial")
        add(inertial, "origin", xyz=text(*body.com), rpy="0 0 0")
        add(inertial, "mass", value=text(body.mass))
        keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        add(inertial, "inertia", **{k: text(v) for k, v in zip(keys, body.inertia, strict=True)})
    for solid in (*link.solids, *link.drawn):
        for part in solid.mirrored(mirror).visuals():
            visual = add(element, "visual")
            add_geometry(visual, part)
            add(visual, "material", name=part.material)
    capsules = []
    for number, solid in enumerate((*link.solids, *link.colliding)):
        collision = add(element, "collision", name=f"{name}_{solid.kind}_{number}")
        add_geometry(collision, solid.mirrored(mirror))
        capsules += [collision.attrib["name"]] if solid.kind == "capsule" else []
    if capsules:
        checking = add(element, "collision_checking")
        for capsule in capsules:
            add(checking, "capsule", name=capsule)


def add_joint(robot: ET.Element, finger: str, joint: Joint, parent: str) -> None:
    """Write a joint of a finger; all axes are +z."""
    kind = "revolute" if joint.limits_deg else "fixed"
    element = add(robot, "joint", name=f"{finger}_{joint.name}", type=kind)
    add(element, "parent", link=parent)
    add(element, "child", link=f"{finger}_{joint.child}")
    add(element, "origin", xyz=text(*joint.xyz), rpy=text(*joint.rpy))
    if joint.limits_deg:
        lower, upper = map(math.radians, joint.limits_deg)
        add(element, "axis", xyz="0 0 1")
        limits = {"lower": text(lower), "upper": text(upper)}
        add(element, "limit", **limits, effort=text(joint.effort), velocity=text(VELOCITY))
    if joint.mimic:
        add(element, "mimic", joint=f"{finger}_{joint.mimic}", multiplier="1", offset="0")


def chain(finger: str, left: bool) -> Iterator[Joint]:
    """Yield the joints of a finger, the first one placed in the palm."""
    xyz, (roll, pitch, yaw) = FINGERS[finger]
    if left:  # PALM_MIRROR R FINGER_MIRROR, a rotation again
        xyz, (roll, pitch, yaw) = scale(xyz, PALM_MIRROR), (math.pi - roll, pitch, -yaw)
    yield replace(CHAIN[0], xyz=xyz, rpy=(roll, pitch, yaw))
    for joint in CHAIN[1:]:
        if left and joint.limits_deg:  # FINGER_MIRROR R FINGER_MIRROR; tip and pad frames are not mirrored
            joint = replace(joint, rpy=scale(joint.rpy, (-1.0, -1.0, 1.0)))
        yield joint


def urdf(hand: str) -> str:
    """Return the URDF of the "right" or "left" hand."""
    left = hand == "left"
    robot = ET.Element("robot", name=f"dlr_hit_ii_{hand}")
    robot.append(ET.Comment(" Written by scripts/make_dlr_hit_ii.py from its table; see README.md. "))
    for name, rgba in MATERIALS.items():
        add(add(robot, "material", name=name), "color", rgba=text(*rgba))
    add_link(robot, "palm", PALM, PALM_MIRROR if left else SAME)
    for finger in FINGERS:
        parent = "palm"
        for joint in chain(finger, left):
            name = f"{finger}_{joint.child}"
            add_link(robot, name, FINGER_LINKS[joint.child], FINGER_MIRROR if left else SAME)
            add_joint(robot, finger, joint, parent)
            parent = name if joint.limits_deg else parent
    ET.indent(robot, "  ")
    return f'<?xml version="1.0"?>\n{ET.tostring(robot, encoding="unicode")}\n'


def main() -> int:
    """Write the two files, or with --check compare them with what is there."""
    parser = argparse.ArgumentParser(description="Write the URDFs of the DLR/HIT Hand II, right and left.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if a file differs")
    parser.add_argument("--output", type=Path, default=OUTPUT, help="folder of the files")
    arguments = parser.parse_args()
    stale = 0
    for hand in SIDES:
        path, content = arguments.output / f"dlr_hit_ii_{hand}.urdf", urdf(hand)
        if path.is_file() and path.read_text(encoding="utf-8") == content:
            continue
        stale += 1
        if arguments.check:
            print(f"{path} differs from the table in {Path(__file__).name}", file=sys.stderr)
        else:
            path.write_text(content, encoding="utf-8")
    return int(arguments.check and stale > 0)


if __name__ == "__main__":
    sys.exit(main())
