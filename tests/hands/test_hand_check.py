"""A plain URDF: what is found in it, what is proposed, and one clear line for everything that can't be used."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli.hand import hand_group
from grasp_planner.cli.main import main
from grasp_planner.exceptions import FileFormatError
from grasp_planner.hand import urdf_checks
from grasp_planner.hand.check import check_hand
from grasp_planner.hand.proposal import proposed_description
from grasp_planner.hand.urdf_file import find_robot_file, second_opinion

ROOT = Path(__file__).parents[2]
# These tests are about contacts and forces alone: where links have to keep clear too, that is left out.
HANDS = {
    "dlr_hit_ii_right": (5, 20, 15),
    "allegro_right": (4, 16, 16),
    "tendon_hand": (3, 8, 7),
}

INERTIA = '<inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/>'
LINK = '<link name="{0}"><inertial><mass value="0.1"/>' + INERTIA + "</inertial>{1}</link>"
JOINT = (
    '<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/>'
    '<origin xyz="{4}"/><axis xyz="0 1 0"/>{5}</joint>'
)
LIMIT = '<limit lower="-0.1" upper="1.5" effort="1" velocity="1"/>'
ROD = '<collision><origin xyz="0 0 0.02"/><geometry><cylinder radius="0.008" length="0.05"/></geometry></collision>'


def three_fingers(kind="revolute", limit=LIMIT, extra="", geometry=ROD):
    """A made-up hand of three two-joint fingers without tip frames; the last joint of the first is as given."""
    parts = ['<robot name="made_up">', LINK.format("base", "")]
    for finger, place in {"a": "-0.04 0 0", "b": "0.04 0.03 0", "c": "0.04 -0.03 0"}.items():
        last = (kind, limit) if finger == "a" else ("revolute", LIMIT)
        parts += [
            LINK.format(f"{finger}_1", geometry),
            LINK.format(f"{finger}_2", geometry),
            JOINT.format(f"{finger}_joint1", "revolute", "base", f"{finger}_1", place, LIMIT),
            JOINT.format(f"{finger}_joint2", last[0], f"{finger}_1", f"{finger}_2", "0 0 0.05", last[1]),
        ]
    return "".join([*parts, extra, "</robot>"])


def write(folder, text):
    path = folder / "my_hand.urdf"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", HANDS)
def test_known_hands_are_found_out(name):
    """Fingers, joints, tips, palm normal and grasp centre of hands whose descriptions were written by hand."""
    hand = gp.load_hand(name)
    check = check_hand(find_robot_file(hand.description.urdf, hand.folder))
    fingers, moving, independent = HANDS[name]
    assert check.usable
    assert (len(check.fingers), len(check.joints)) == (fingers, moving)
    assert sum(not joint.mimics for joint in check.joints) == independent
    described = {(frame.frame, round(frame.radius, 4)) for frame in hand.contact_frames("sphere")}
    assert {(finger.tip.frame, round(finger.tip.radius, 4)) for finger in check.fingers} == described
    palm = check.palm
    assert palm is not None and palm.link == hand.description.palm.link
    assert palm.normal @ hand.palm_normal > 0.95
    assert abs(palm.closing_axis @ hand.closing_axis) > 0.85
    assert np.linalg.norm(palm.grasp_centre - hand.grasp_centre) < 0.04


def test_joints_may_be_named_as_the_links_they_move(tmp_path):
    plain, text = check_hand(write(tmp_path, three_fingers())), three_fingers()
    for finger in "abc":
        for number in "12":
            text = text.replace(f'joint name="{finger}_joint{number}"', f'joint name="{finger}_{number}"')
    same = check_hand(write(tmp_path, text))
    assert same.usable and same.palm is not None and plain.palm is not None
    assert same.palm.closing_axis == pytest.approx(plain.palm.closing_axis)
    assert same.palm.grasp_centre == pytest.approx(plain.palm.grasp_centre)


def test_proposal_makes_a_hand(tmp_path):
    """From a bare URDF to a planned grasp: the proposal loads and plans with synergies of its own."""
    path = write(tmp_path, three_fingers())
    check = check_hand(path)
    assert len({finger.name for finger in check.fingers}) == 3
    assert all(finger.tip.radius == pytest.approx(0.008) for finger in check.fingers)
    assert all(finger.tip.offset == pytest.approx((0.0, 0.0, 0.037)) for finger in check.fingers)
    toml = tmp_path / "my_hand.toml"
    toml.write_text(proposed_description(check), encoding="utf-8")
    hand = gp.load_hand(toml)
    assert hand.n_joints == 6
    problem = gp.GraspProblem.paper(hand=hand, grasp_object=gp.Sphere(radius=0.025, mass=0.05), n_synergies=6)
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(starts=25, enough=1))
    assert grasp.feasible, grasp.verdict


MIMIC = LIMIT + '<mimic joint="{0}"/>'
BAD = {
    "screw": ({"kind": "screw"}, "joint 'a_joint2' is screw: only revolute and prismatic joints"),
    "floating": ({"kind": "floating", "limit": ""}, "joint 'a_joint2' is floating"),
    "no limits": ({"limit": ""}, "joint 'a_joint2' has no usable limits"),
    "infinite limits": ({"limit": LIMIT.replace("1.5", "inf")}, "joint 'a_joint2' has no usable limits"),
    "swapped limits": ({"limit": LIMIT.replace("1.5", "-1.5")}, "joint 'a_joint2' has no usable limits"),
    "mimics nothing": ({"limit": MIMIC.format("ghost")}, "mimics 'ghost', which does not exist"),
    "mimics itself": ({"limit": MIMIC.format("a_joint2")}, "mimics 'a_joint2', which leads back to itself"),
    "mesh": (
        {"geometry": '<collision><geometry><mesh filename="package://nowhere/a.stl"/></geometry></collision>'},
        "mesh 'package://nowhere/a.stl' is missing",
    ),
    "no axis": (
        {
            "extra": JOINT.format("d", "revolute", "base", "d_1", "0 0 0", LIMIT).replace("0 1 0", "0 0 0")
            + LINK.format("d_1", "")
        },
        "joint 'd' has no usable axis",
    ),
    "no link": ({"extra": JOINT.format("d", "revolute", "base", "ghost", "0 0 0", LIMIT)}, "no child link that exists"),
    "loop": ({"extra": JOINT.format("d", "revolute", "a_2", "base", "0 0 0", LIMIT)}, "its joints close a loop"),
    "closed chain": ({"extra": JOINT.format("d", "revolute", "a_2", "b_2", "0 0 0", LIMIT)}, "hangs on two joints"),
    "two roots": ({"extra": LINK.format("alone", "")}, "several roots (alone, base)"),
    "no name": ({"extra": "<link/>"}, "a link has no name"),
    "twice": ({"extra": LINK.format("a_1", "")}, "link 'a_1' is defined 2 times"),
}


@pytest.mark.parametrize("name", BAD)
def test_defects_are_listed(tmp_path, name):
    """Every defect has its line, and the command ends with exit code 1."""
    changes, line = BAD[name]
    path = write(tmp_path, three_fingers(**changes))
    check = check_hand(path)
    assert not check.usable and len(check.errors) == 1 and line in check.errors[0]
    result = CliRunner().invoke(hand_group, ["check", str(path)])
    assert result.exit_code == 1 and f"error: {check.errors[0]}" in result.output


@pytest.mark.parametrize("name", BAD)
def test_a_hand_on_a_defective_urdf_is_one_line_and_exit_code_two(tmp_path, name, capfd):
    """The same line from ``plan``; nothing of it from the libraries below."""
    changes, line = BAD[name]
    description = plan_with(tmp_path, three_fingers(**changes))
    result = CliRunner().invoke(main, ["plan", "--hand", str(description)])
    assert result.exit_code == 2 and result.output.startswith("grasp-planner: error: ")
    assert line in result.output and result.output.count("\n") == 1
    assert capfd.readouterr() == ("", "")


def plan_with(folder, text):
    """Write a description that fits the made-up hand beside another URDF."""
    path = folder / "my_hand.urdf"
    path.write_text(three_fingers(), encoding="utf-8")
    description = folder / "my_hand.toml"
    description.write_text(proposed_description(check_hand(path)), encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    return description


@pytest.mark.parametrize("content", [b"", b"solid nothing", b"<COLLADA/>"])
def test_a_collision_mesh_that_is_none(tmp_path, content, capfd):
    (tmp_path / "bad.stl").write_bytes(content)
    mesh = '<collision><geometry><mesh filename="bad.stl"/></geometry></collision>'
    assert check_hand(write(tmp_path, three_fingers(geometry=mesh))).errors == (
        "mesh 'bad.stl' is no mesh that can be read",
    )
    assert capfd.readouterr() == ("", "")


def test_a_huge_collision_mesh(tmp_path, monkeypatch):
    (tmp_path / "huge.stl").write_bytes(b"0" * 100)
    monkeypatch.setattr(urdf_checks, "MAX_MESH_BYTES", 99)
    mesh = '<collision><geometry><mesh filename="huge.stl"/></geometry></collision>'
    check = check_hand(write(tmp_path, three_fingers(geometry=mesh)))
    assert check.errors == ("mesh 'huge.stl' is larger than the 99 bytes allowed",)


def test_a_collision_mesh_of_too_many_triangles_or_another_format(tmp_path, monkeypatch):
    trimesh.creation.box((0.01, 0.01, 0.01)).export(tmp_path / "box.stl")
    text = three_fingers(geometry='<collision><geometry><mesh filename="box.stl"/></geometry></collision>')
    assert check_hand(write(tmp_path, text)).usable
    monkeypatch.setattr(urdf_checks, "MAX_TRIANGLES", 11)
    (line,) = check_hand(write(tmp_path, text)).errors
    assert line == "mesh 'box.stl' has 12 triangles, more than the 11 allowed"
    trimesh.creation.box((0.01, 0.01, 0.01)).export(tmp_path / "box.off")
    (line,) = check_hand(write(tmp_path, text.replace("box.stl", "box.off"))).errors
    assert line == "mesh 'box.off' is none of .stl, .obj, .ply, .glb, .dae"


def test_two_defects_are_both_listed(tmp_path):
    mesh = '<collision><geometry><mesh filename="gone.stl"/></geometry></collision>'
    check = check_hand(write(tmp_path, three_fingers(kind="screw", geometry=mesh)))
    assert len(check.errors) == 2


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("<robot", "not valid XML"),
        ("<sdf/>", "root element is <sdf>"),
        ('<!DOCTYPE r [<!ENTITY a "b">]><robot name="x">&a;</robot>', "document type or entities"),
        (
            '<?xml version="1.0" encoding="UTF-7"?>+ADwAIQ-DOCTYPE r [+ADwAIQ-ENTITY a "b">]><robot/>',
            "encoding 'UTF-7'",
        ),
    ],
)
def test_what_is_no_urdf_is_refused(tmp_path, text, reason):
    path = write(tmp_path, text)
    with pytest.raises(gp.FileFormatError, match=reason):
        check_hand(path)
    result = CliRunner().invoke(hand_group, ["check", str(path)])
    assert result.exit_code == 1 and result.output.startswith("Error: ") and result.output.count("\n") == 1


def test_command_writes_description_and_picture(tmp_path):
    path = write(tmp_path, three_fingers())
    toml, png = tmp_path / "out.toml", tmp_path / "out.png"
    arguments = ["check", str(path), "--toml", str(toml), "--png", str(png)]
    result = CliRunner().invoke(hand_group, arguments)
    assert result.exit_code == 0, result.output
    assert gp.load_hand(toml).n_joints == 6
    assert png.read_bytes().startswith(b"\x89PNG")
    again = CliRunner().invoke(hand_group, arguments)
    assert again.exit_code == 1 and "--force" in again.output


def test_a_check_asks_yourdfpy_too(tmp_path):
    """What yourdfpy can't read is said in one line."""
    path = tmp_path / "hand.urdf"
    text = (ROOT / "urdf" / "tendon_hand" / "tendon_hand.urdf").read_text(encoding="utf-8")
    path.write_text(text.replace('<origin xyz="', '<origin xyz="nonsense ', 1), encoding="utf-8")
    with pytest.raises(FileFormatError, match="is not a valid URDF"):
        second_opinion(path)
