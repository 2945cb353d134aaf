"""Small made-up hands as URDF text, each with one structure that hands of the world have."""

from __future__ import annotations

from pathlib import Path

import trimesh

INERTIA = '<inertial><mass value="0.1"/><inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial>'
BEND = (-0.1, 1.4)
HANDS = (
    "mimic_chain",
    "four_bar",
    "moving_palm",
    "wrist_and_arm",
    "prismatic",
    "mesh_links",
    "phantom_link",
    "tendon",
)


def link(name, solid=""):
    return f'<link name="{name}">{INERTIA}{solid}</link>'


def rod(length, radius=0.008):
    """A cylinder whose far end is round."""
    straight = length - radius
    return (
        f'<collision><origin xyz="0 0 {straight / 2}"/><geometry><cylinder radius="{radius}" length="{straight}"/>'
        f'</geometry></collision><collision><origin xyz="0 0 {straight}"/><geometry><sphere radius="{radius}"/>'
        "</geometry></collision>"
    )


def box(x, y, z):
    return f'<collision><origin xyz="0 0 {z / 2}"/><geometry><box size="{x} {y} {z}"/></geometry></collision>'


def joint(name, parent, child, place, axis="0 1 0", limits=BEND, kind="revolute", mimic=None, yaw=0.0):
    """A joint; ``mimic`` is (source, multiplier)."""
    follows = "" if mimic is None else f'<mimic joint="{mimic[0]}" multiplier="{mimic[1]}"/>'
    limit = "" if limits is None else f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="5" velocity="1"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{place}" rpy="0 0 {yaw}"/><axis xyz="{axis}"/>{limit}{follows}</joint>'
    )


def finger(name, base, place, yaw, outer=None, solid=rod):
    """Two phalanges along z that bend inwards; the outer one may mimic."""
    return [
        link(f"{name}_1", solid(0.05)),
        link(f"{name}_2", solid(0.04)),
        joint(f"{name}_inner", base, f"{name}_1", place, yaw=yaw),
        joint(f"{name}_outer", f"{name}_1", f"{name}_2", "0 0 0.05", mimic=outer),
    ]


PLACES = {"thumb": ("-0.04 0 0.02", 0.0), "left": ("0.04 0.03 0.02", 3.1416), "right": ("0.04 -0.03 0.02", 3.1416)}


def three_fingers(base="palm", outer=None, solid=rod):
    return [
        part
        for name, (place, yaw) in PLACES.items()
        for part in finger(name, base, place, yaw, None if outer is None else outer(name), solid)
    ]


def urdf_text(name):
    """Return the URDF of one of :data:`HANDS`, or of ``flat_pads``."""
    palm = [link("palm", box(0.1, 0.1, 0.02))]
    parts = {
        "mimic_chain": lambda: palm + three_fingers(outer=chain),
        "four_bar": four_bar,
        "moving_palm": moving_palm,
        "wrist_and_arm": wrist_and_arm,
        "prismatic": prismatic,
        "mesh_links": lambda: palm + three_fingers(solid=lambda length: mesh(f"rod_{round(1000 * length)}.stl")),
        "phantom_link": phantom_link,
        "flat_pads": lambda: [part.replace("0.03 0.02", "0.02 0.02") for part in phantom_link(mesh("flat.stl"))],
        "tendon": lambda: palm + three_fingers(outer=lambda name: (f"{name}_inner", 0.7)),
    }[name]()
    return "".join([f'<robot name="{name}">', *parts, "</robot>"])


def chain(name):
    """Outer joints follow each other around to the inner joint of the thumb."""
    return {"thumb": ("thumb_inner", 0.8), "left": ("thumb_outer", 1.0), "right": ("left_outer", 1.0)}[name]


def four_bar():
    """Two pads that stay parallel; knuckles run along the fingers and touch nothing; limits have the wrong sign."""
    parts = [link("palm", box(0.14, 0.04, 0.02))]
    for name, sign in (("near", 1.0), ("far", -1.0)):
        yaw, source = (0.0 if sign > 0.0 else 3.1416), None if sign > 0.0 else ("near_bar", 1.0)
        parts += [
            link(f"{name}_1", box(0.01, 0.02, 0.06)),
            link(f"{name}_2", box(0.01, 0.024, 0.05)),
            link(f"{name}_knuckle", box(0.006, 0.02, 0.058)),
            joint(f"{name}_bar", "palm", f"{name}_1", f"{-0.06 * sign} 0 0.02", limits=(0, 0.8), mimic=source, yaw=yaw),
            joint(f"{name}_pad", f"{name}_1", f"{name}_2", "0 0 0.06", limits=(0, 0.8), mimic=("near_bar", -1.0)),
            joint(
                f"{name}_link",
                "palm",
                f"{name}_knuckle",
                f"{-0.052 * sign} 0 0.02",
                limits=(0, 0.8),
                mimic=("near_bar", 1.0),
                yaw=yaw,
            ),
        ]
    return parts


def moving_palm():
    """Left and right finger stand on a part of the palm that moves."""
    parts = [link("palm", box(0.06, 0.1, 0.02)), link("arch", box(0.03, 0.1, 0.02))]
    parts += [joint("arching", "palm", "arch", "0.04 0 0", limits=(-0.05, 0.3), yaw=3.1416)]
    parts += finger("thumb", "palm", "-0.04 0 0.02", 0.0)
    return parts + finger("left", "arch", "0 -0.03 0.02", 0.0) + finger("right", "arch", "0 0.03 0.02", 0.0)


def wrist_and_arm():
    """A floating root, an endless shoulder, an elbow and a wrist before the palm."""
    parts = [link("world"), link("base", box(0.1, 0.1, 0.1)), link("upper", rod(0.3, 0.03))]
    parts += [link("lower", rod(0.2, 0.03)), link("palm", box(0.1, 0.1, 0.02))]
    parts += [
        joint("free", "world", "base", "0 0 0", kind="floating", limits=None),
        joint("shoulder", "base", "upper", "0 0 0.1", kind="continuous", limits=None),
        joint("elbow", "upper", "lower", "0 0 0.3", limits=(0.2, 2.0)),
        joint("wrist", "lower", "palm", "0 0 0.25", limits=(-1.0, 1.0)),
    ]
    return parts + three_fingers()


def prismatic():
    """Three jaws that slide towards the middle; one joint cannot move."""
    parts = [link("palm", box(0.12, 0.12, 0.02)), link("cover", box(0.02, 0.02, 0.01))]
    parts.append(joint("lid", "palm", "cover", "0 0 -0.02", limits=(0.0, 0.0)))
    for name, (place, yaw) in PLACES.items():
        parts.append(link(f"{name}_jaw", rod(0.08)))
        slide = {"kind": "prismatic", "axis": "1 0 0", "limits": (0.0, 0.035), "yaw": yaw}
        parts.append(joint(f"{name}_slide", "palm", f"{name}_jaw", place, **slide))
    return parts


def phantom_link(end=None):
    """All joints follow one that moves a link without geometry, some by a factor of 0."""
    parts = [link("palm", box(0.1, 0.1, 0.02)), link("wire")]
    parts.append(joint("motor", "palm", "wire", "0 0 0", axis="0 0 1", limits=(0.0, 1.0)))
    for name, (place, yaw) in PLACES.items():
        parts += [link(f"{name}_0"), link(f"{name}_1", rod(0.05)), link(f"{name}_2", end or rod(0.04))]
        parts += [
            joint(f"{name}_turn", "palm", f"{name}_0", place, axis="0 0 1", limits=(-0.5, 0.5), yaw=yaw).replace(
                "</joint>", '<mimic joint="motor" multiplier="0"/></joint>'
            ),
            joint(f"{name}_inner", f"{name}_0", f"{name}_1", "0 0 0", mimic=("motor", 0.9)),
            joint(f"{name}_outer", f"{name}_1", f"{name}_2", "0 0 0.05", mimic=("motor", 0.9)),
        ]
    return parts


def mesh(file):
    return f'<collision><geometry><mesh filename="package://made_up/meshes/{file}"/></geometry></collision>'


def flat_pad(path: Path, radius: float = 0.004) -> None:
    """Write a last link that is flat in the middle of its pad and round beside it: the hull of eight balls."""
    corners = [(x, y, z) for x in (-0.003, 0.003) for y in (-0.005, 0.005) for z in (0.004, 0.036)]
    ball = trimesh.creation.icosphere(subdivisions=3, radius=radius).vertices
    path.parent.mkdir(exist_ok=True)
    trimesh.convex.convex_hull([vertex + corner for corner in corners for vertex in ball]).export(path)


def write_hand(folder: Path, name: str, text: str | None = None) -> Path:
    """Write one of the hands, with its meshes, and return the URDF."""
    if name == "mesh_links":
        for length in (0.05, 0.04):
            solid = trimesh.creation.capsule(height=length - 0.016, radius=0.008, count=[16, 16])
            solid.apply_translation([0.0, 0.0, -float(solid.bounds[0, 2])])
            (folder / "meshes").mkdir(exist_ok=True)
            solid.export(folder / "meshes" / f"rod_{round(1000 * length)}.stl")
    if name == "flat_pads":
        flat_pad(folder / "meshes" / "flat.stl")
    path = folder / f"{name}.urdf"
    path.write_text(urdf_text(name) if text is None else text, encoding="utf-8")
    return path
