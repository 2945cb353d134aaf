"""Hands from their URDF alone: what is repaired, found and derived, whatever the links are called."""

from __future__ import annotations

import re

import numpy as np
import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli.main import main
from grasp_planner.hand import urdf_checks
from grasp_planner.hand.check import check_hand
from grasp_planner.hand.description import read_hand_description
from grasp_planner.hand.kinematics import HandKinematics
from grasp_planner.hand.loading import loaded_hand
from grasp_planner.hand.proposal import description_text, proposed_description
from grasp_planner.records.grasp_files import read_grasp_record
from grasp_planner.records.grasp_record import grasp_from_record

from .small_hands import HANDS, box, finger, link, urdf_text, write_hand

# Independent joints, fingers, contacts, and a word of each repair.
FOUND = {
    "mimic_chain": (3, 3, 3, ("left_outer", "right_outer")),
    "four_bar": (1, 2, 4, ("near_pad", "far_pad")),
    "moving_palm": (7, 3, 3, ()),
    "wrist_and_arm": (6, 3, 3, ("free", "shoulder", "shoulder", "elbow", "wrist")),
    "prismatic": (3, 3, 3, ("lid",)),
    "mesh_links": (6, 3, 3, ("rod_",)),
    "phantom_link": (6, 3, 3, ("thumb_turn", "left_turn", "right_turn")),
    "tendon": (3, 3, 3, ()),
}


@pytest.fixture(params=HANDS)
def name(request):
    return request.param


def test_what_is_found(tmp_path, name):
    """Independent joints, fingers and contacts are right, and each repair is said."""
    check = check_hand(write_hand(tmp_path, name))
    joints, fingers, contacts, repairs = FOUND[name]
    assert check.errors == () and check.description is not None
    assert len(check.description.joints) == joints
    assert len(check.fingers) == fingers
    assert len(check.description.contact_sets["sphere"]) == contacts
    assert len(check.repairs) == len(repairs)
    assert all(word in line for word, line in zip(repairs, check.repairs, strict=True))
    assert check.palm is not None
    if name not in ("four_bar", "wrist_and_arm"):
        np.testing.assert_allclose(check.palm.normal, (0.0, 0.0, 1.0), atol=0.08)
    assert abs(check.palm.closing_axis[1]) > 0.99 or name == "prismatic"


def test_what_is_checked_loads_the_same_from_both_files(tmp_path, name):
    """A URDF and the description written for it make the same hand, with synergies of its own."""
    path = write_hand(tmp_path, name)
    toml = tmp_path / "derived.toml"
    toml.write_text(proposed_description(check_hand(path)), encoding="utf-8")
    derived, written = gp.load_hand(path), gp.load_hand(toml)
    assert derived.description == written.description
    np.testing.assert_array_equal(derived.coupling, written.coupling)
    np.testing.assert_array_equal(derived.lower, written.lower)
    for each in ("closing", "motors"):
        space = derived.synergies(each)
        assert space.n_synergies == derived.n_joints
        np.testing.assert_allclose(space.basis.T @ space.basis, np.eye(derived.n_joints), atol=1e-9)
        assert (space.mean >= derived.lower - 1e-12).all() and (space.mean <= derived.upper + 1e-12).all()


def test_first_synergy_closes_the_hand(tmp_path, name):
    """Along it the opposed fingertips come together."""
    hand = gp.load_hand(write_hand(tmp_path, name))
    space = hand.synergies("closing").truncated(1)
    frames = hand.contact_frames()
    step = 0.1 * float((hand.upper - hand.lower).max())
    ends = [HandKinematics(hand, frames).compute(space.joint_angles([s])).position for s in (0.0, step)]
    apart = [np.linalg.norm(points[0] - points[-1]) for points in ends]
    assert apart[1] < apart[0]


RENAMED = ("thumb", "left", "right", "near", "far")


def test_names_and_order_change_nothing(tmp_path, name):
    """Other names and another order of links and joints: the same palm, contacts and joints."""
    text = urdf_text(name)
    head, body = re.match(r"(<robot[^>]*>)(.*)</robot>", text).groups()
    parts = re.findall(r"<link.*?</link>|<joint.*?</joint>", body)
    other = "".join([head, *reversed(parts), "</robot>"])
    for number, word in enumerate(RENAMED):
        other = other.replace(f'"{word}_', f'"{"zyxwv"[number]}q_')
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    first, second = (
        gp.load_hand(write_hand(tmp_path / "a", name)),
        gp.load_hand(write_hand(tmp_path / "b", name, other)),
    )
    for field in ("palm_normal", "closing_axis", "grasp_centre", "lower", "upper"):
        np.testing.assert_allclose(getattr(first, field), getattr(second, field), atol=2e-6)
    contacts = [[(f.radius, *f.offset) for f in hand.contact_frames()] for hand in (first, second)]
    np.testing.assert_allclose(contacts[0], contacts[1], atol=2e-6)
    np.testing.assert_allclose(first.synergies().basis, second.synergies().basis, atol=1e-6)


def test_a_locked_joint_turns_the_hand_not_the_description(tmp_path):
    """A wrist at another angle: it is fixed there, and the palm frame sees the same hand."""
    path = write_hand(tmp_path, "wrist_and_arm")
    straight, bent = gp.load_hand(path), gp.load_hand(path, {"wrist": 0.5})
    assert bent.description.locked == {"shoulder": 0.0, "elbow": 0.2, "wrist": 0.5}
    np.testing.assert_allclose(bent.palm_normal, straight.palm_normal, atol=1e-6)
    turn = straight.palm_in_root.rotation.T @ bent.palm_in_root.rotation
    assert np.arccos((np.trace(turn) - 1.0) / 2.0) == pytest.approx(0.5)
    with pytest.raises(gp.NameNotFoundError, match="joint to lock"):
        gp.load_hand(path, {"nothing": 0.0})
    with pytest.raises(gp.InvalidValueError, match="wrist"):
        gp.load_hand(path, {"wrist": 2.0})


def test_a_comment_before_the_declaration(tmp_path):
    text = '<!-- made by hand -->\n<?xml version="1.0"?>\n' + urdf_text("tendon")
    check = check_hand(write_hand(tmp_path, "tendon", text))
    assert check.usable and any("before the XML declaration" in line for line in check.repairs)


def test_too_many_links_are_refused_before_they_are_parsed(tmp_path, monkeypatch):
    monkeypatch.setattr(urdf_checks, "MAX_LINKS", 5)
    monkeypatch.setattr(urdf_checks.ET, "fromstring", lambda text: pytest.fail("parsed"))
    with pytest.raises(gp.FileFormatError, match="more than the 5 links"):
        gp.load_hand(write_hand(tmp_path, "tendon"))
    joints = '<robot name="many">' + 6 * '<joint\nname="a"/>' + "</robot>"
    with pytest.raises(gp.FileFormatError, match="more than the 5 joints"):
        gp.load_hand(write_hand(tmp_path, "tendon", joints))


def test_suspicions_are_said(tmp_path):
    text = urdf_text("tendon").replace('upper="1.4"', 'upper="80"', 1).replace('effort="5"', 'effort="0"', 1)
    notes = " ".join(check_hand(write_hand(tmp_path, "tendon", text)).notes)
    assert "degrees: thumb_inner" in notes and "effort 0" in notes


def test_descriptions_of_the_package_survive_their_text(tmp_path):
    """Any description can be written as TOML and read back."""
    for hand in gp.hand_library():
        description = gp.load_hand(hand).description
        path = tmp_path / f"{hand}.toml"
        path.write_text(description_text(description), encoding="utf-8")
        assert read_hand_description(path) == description


def test_check_says_what_was_repaired(tmp_path):
    result = CliRunner().invoke(main, ["hand", "check", str(write_hand(tmp_path, "mimic_chain"))])
    assert result.exit_code == 0 and "repair: joint 'left_outer' mimics 'thumb_outer'" in result.output


def test_lock_on_the_command_line(tmp_path):
    """A joint is locked by name; the description written keeps it."""
    toml = tmp_path / "hand.toml"
    arguments = ["hand", "check", str(write_hand(tmp_path, "wrist_and_arm")), "--toml", str(toml)]
    result = CliRunner().invoke(main, [*arguments, "--lock", "wrist=0.3"])
    assert result.exit_code == 0 and "repair: joint 'wrist' is locked at 0.3 rad" in result.output
    assert gp.load_hand(toml).description.locked["wrist"] == 0.3
    assert CliRunner().invoke(main, [*arguments, "--lock", "wrist", "--force"]).exit_code == 1


def test_plan_locks_joints_and_says_what_it_found(tmp_path):
    """Repairs and derived facts stand once on standard error; the grasp's file remembers the locked joint."""
    hand, file = str(write_hand(tmp_path, "wrist_and_arm")), tmp_path / "grasp.json"
    arguments = ["plan", "--hand", hand, "--starts", "1", "--max-iterations", "1", "--quiet", "--no-explain"]
    result = CliRunner().invoke(main, [*arguments, "--lock", "wrist=0.3", "--json", str(file)])
    assert result.exit_code in (0, 3)
    assert result.stderr.count("repair: joint 'wrist' is locked at 0.3 rad") == 1
    assert "derived: palm palm: normal" in result.stderr and "derived: finger" in result.stderr
    assert grasp_from_record(read_grasp_record(file)).problem.hand.description.locked["wrist"] == 0.3
    wrong = CliRunner().invoke(main, [*arguments, "--lock", "wrist"])
    assert wrong.exit_code == 2 and "NAME=VALUE" in wrong.output


def test_of_many_fingers_those_that_oppose_hold(tmp_path):
    """Of four fingers beside each other and a thumb, the two that face it are the default contacts."""
    places = {"far": 0.075, "left": 0.025, "right": -0.025, "beyond": -0.075}
    parts = [link("palm", box(0.1, 0.2, 0.02)), *finger("thumb", "palm", "-0.04 0 0.02", 0.0)]
    for each, y in places.items():
        parts += finger(each, "palm", f"0.04 {y} 0.02", 3.1416)
    path = write_hand(tmp_path, "five", f'<robot name="five">{"".join(parts)}</robot>')
    found = loaded_hand(path)
    assert set(found.hand.contact_set_names) == {"opposed", "sphere"}
    assert {frame.frame for frame in found.hand.contact_frames()} == {"thumb_2", "left_2", "right_2"}
    assert len(found.hand.contact_frames("sphere")) == 5
    radius = gp.parse_object(found.first_object).half_extents[0]
    assert 0.012 <= radius <= 0.04


def test_check_ends_with_a_command_for_a_first_grasp(tmp_path):
    """It names the file and an object in size for the hand."""
    path = write_hand(tmp_path, "mimic_chain")
    answer = CliRunner().invoke(main, ["hand", "check", str(path), "--toml", str(tmp_path / "hand.toml")])
    line = next(line for line in answer.output.splitlines() if line.startswith("first grasp: "))
    assert f"plan --hand {path} --object {loaded_hand(path).first_object}" in line
