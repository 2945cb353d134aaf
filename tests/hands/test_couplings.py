"""What joints follow, as a description says it, and hands whose one motor winds up a tendon."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli.main import main
from grasp_planner.hand.check import check_hand
from grasp_planner.hand.couplings import couple
from grasp_planner.hand.description import HandDescription
from grasp_planner.hand.loading import loaded_hand
from grasp_planner.hand.proposal import proposed_description

from .small_hands import urdf_text, write_hand


def described(folder, couplings, joints):
    """Return the path of a description of the hand `tendon` with couplings and independent joints of its own."""
    path = write_hand(folder, "tendon")
    text = proposed_description(check_hand(path))
    text = re.sub(r"joints = .*", f"joints = {joints}".replace("'", '"'), text)
    toml = folder / "mine.toml"
    toml.write_text(text + f"\n[couplings]\n{couplings}\n", encoding="utf-8")
    return toml


INNER = ["thumb_inner", "left_inner", "right_inner"]


def test_a_coupling_takes_the_place_of_a_mimic(tmp_path):
    """Free, another factor, a chain, a fixed joint: each joint follows what the description says."""
    lines = (
        'thumb_outer = "free"\nleft_outer = { joint = "left_inner", ratio = 0.5, offset = 0.1 }\n'
        'right_outer = { joint = "left_outer", ratio = 2.0 }\nright_inner = "fixed"'
    )
    hand = gp.load_hand(described(tmp_path, lines, ["thumb_inner", "thumb_outer", "left_inner"]))
    angles = dict(zip(tuple(hand.model.names)[1:], hand.full_configuration(np.array([0.2, 0.3, 0.4])), strict=True))
    expected = {"thumb_inner": 0.2, "thumb_outer": 0.3, "left_inner": 0.4, "left_outer": 0.3, "right_outer": 0.6}
    assert angles == pytest.approx(expected)
    assert any("right_outer" in line and "itself a mimic" in line for line in hand.findings)


def test_the_recipes_of_the_guide_are_descriptions(tmp_path):
    """Each block, put into a description, is read as it stands."""
    guide = (Path(__file__).parents[2] / "docs/extend/hand.md").read_text(encoding="utf-8")
    recipes = guide.partition("## Recipes for couplings")[2].partition("\n## ")[0]
    plain = tomllib.loads(proposed_description(check_hand(write_hand(tmp_path, "tendon"))))
    blocks = [tomllib.loads(text) for text in re.findall(r"```toml\n(.*?)```", recipes, re.DOTALL)]
    assert len(blocks) == 3
    for block in blocks:
        HandDescription.model_validate(plain | block)


def test_a_finger_that_keeps_its_last_link_parallel(tmp_path):
    """The recipe of the Robotiq 3-finger on a hand of two hinges a finger: the last link doesn't turn."""
    lines = "\n".join(
        f'{name}_outer = {{ joint = "{name}_inner", ratio = -1.0 }}' for name in ("thumb", "left", "right")
    )
    hand = gp.load_hand(described(tmp_path, lines, INNER))
    assert hand.n_joints == 3
    turned = []
    for q in (hand.lower, hand.upper):
        data = hand.model.createData()
        pin.forwardKinematics(hand.model, data, hand.full_configuration(q))
        turned.append(data.oMi[hand.model.getJointId("thumb_outer")].rotation)
    np.testing.assert_allclose(turned[0], turned[1], atol=1e-12)


def test_a_table_is_taken_as_a_line_and_says_how_far_it_is_off(tmp_path):
    """Least squares over the pairs; the largest difference is a finding."""
    table = [[0.0, 0.0], [0.5, 0.4], [1.0, 1.0]]
    hand = gp.load_hand(described(tmp_path, f'thumb_outer = {{ joint = "thumb_inner", table = {table} }}', INNER))
    row = tuple(hand.model.names).index("thumb_outer") - 1
    assert hand.coupling[row, 0] == pytest.approx(1.0)
    assert hand.coupling_offset[row] == pytest.approx(-1.0 / 30.0)
    assert any("couplings.thumb_outer" in line and "at most 0.067 off" in line for line in hand.findings)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ('nothing = "free"', "nothing"),
        ('thumb_outer = { joint = "nothing" }', "nothing"),
        ('thumb_outer = { joint = "thumb_inner", ratio = 0.0 }', "ratio"),
        ('thumb_outer = { joint = "thumb_inner", table = [[0.0, 0.0], [0.0, 1.0]] }', "both angles change"),
        ('thumb_outer = { joint = "thumb_inner", ratio = 1.0, table = [[0.0, 0.0], [1.0, 1.0]] }', "either a table"),
        ('thumb_outer = "loose"', "thumb_outer"),
        ('thumb_outer = { joint = "thumb_outer" }', "thumb_outer"),
    ],
)
def test_a_coupling_that_can_not_be_is_one_line(tmp_path, line, says):
    with pytest.raises(gp.GraspPlannerError, match=says) as error:
        gp.load_hand(described(tmp_path, line, INNER))
    assert "\n" not in str(error.value)


def test_a_wire_that_bends_all_fingers_is_a_tendon(tmp_path):
    """Its mimics become joints with springs, its moment arms their factors, and without contacts it closes the same."""
    path = write_hand(tmp_path, "phantom_link")
    hand = gp.load_hand(path)
    assert hand.n_joints == 6 and "motor" not in hand.joint_names
    assert hand.synergies().n_synergies == 1 and hand.synergies().name == "tendons"
    assert hand.tendons is not None and hand.tendons.names == ("motor",)
    np.testing.assert_allclose(hand.tendons.arms, 0.01)
    assert any("taken as a tendon" in line for line in hand.findings)
    assert gp.load_hand(write_hand(tmp_path, "mimic_chain")).tendons is None


def test_moment_arms_are_as_the_factors_of_the_mimics(tmp_path):
    """A joint that turns the other way, and one that turns more: with tension the free hand goes where they say."""
    text = urdf_text("phantom_link").replace('multiplier="0.9"', 'multiplier="1.35"', 1)
    hand = gp.load_hand(write_hand(tmp_path, "phantom_link", text))
    space, joint = hand.synergies(), hand.joint_index("thumb_inner")
    turned = space.joint_angles([1.0]) - space.joint_angles([0.0])
    np.testing.assert_allclose(turned[joint] / np.delete(turned, joint), 1.5)


def test_two_hinges_without_geometry_between_stay_one_rolling_joint(tmp_path):
    """The second follows the first by the ratio of their factors."""
    text = urdf_text("phantom_link")
    text = re.sub(r'<link name="thumb_1">.*?</link>', '<link name="thumb_1"/>', text)
    text = re.sub(r'(name="thumb_outer".*?multiplier=)"0.9"', r'\1"0.45"', text)
    hand = gp.load_hand(write_hand(tmp_path, "phantom_link", text))
    # The thumb is a rolling joint and no finger of two joints: two fingers only are bent, so it stays as it is.
    assert hand.tendons is None
    third = text.replace("thumb_", "third_").replace("-0.04 0 0.02", "-0.04 0.06 0.02")
    extra = "".join(re.findall(r'<(?:link|joint) name="third_.*?</(?:link|joint)>|<link name="third_1"/>', third))
    more = urdf_text("phantom_link").replace("</robot>", extra + "</robot>")
    hand = gp.load_hand(write_hand(tmp_path, "phantom_link", more))
    assert "third_inner" in hand.joint_names and "third_outer" not in hand.joint_names
    row = tuple(hand.model.names).index("third_outer") - 1
    assert hand.coupling[row, hand.joint_index("third_inner")] == pytest.approx(0.5)


def test_a_tendon_is_written_corrected_and_read_again(tmp_path):
    """The description written says couplings and moment arms; a corrected arm changes the synergy."""
    path, toml = write_hand(tmp_path, "phantom_link"), tmp_path / "mine.toml"
    assert CliRunner().invoke(main, ["hand", "check", str(path), "--toml", str(toml)]).exit_code == 0
    text = toml.read_text(encoding="utf-8")
    assert gp.load_hand(toml).description == gp.load_hand(path).description
    toml.write_text(text.replace("thumb_inner = 0.01\n", "thumb_inner = 0.02\n"), encoding="utf-8")
    hand = gp.load_hand(toml)
    assert hand.tendons is not None and hand.tendons.arms[0, hand.joint_index("thumb_inner")] == 0.02


def test_locked_joints_in_the_text_of_a_hand(tmp_path):
    """Wherever a hand is named by text, joints can be locked in it."""
    path = write_hand(tmp_path, "wrist_and_arm")
    hand = gp.load_hand(f"{path}:wrist=0.3, elbow=0.5")
    assert hand.description.locked == {"shoulder": 0.0, "elbow": 0.5, "wrist": 0.3}
    assert hand == gp.load_hand(path, {"wrist": 0.3, "elbow": 0.5})
    assert gp.load_hand(f"{path}:wrist=0.3", {"wrist": 0.1}).description.locked["wrist"] == 0.1
    with pytest.raises(gp.InvalidValueError, match="NAME=VALUE"):
        loaded_hand(f"{path}:wrist=up")
    result = CliRunner().invoke(main, ["synergies", "list", "--hand", str(path), "--lock", "wrist=0.3"])
    assert result.exit_code == 0
    assert CliRunner().invoke(main, ["export", "grasp.json", "--lock", "wrist=0.3"]).exit_code != 0


def test_a_locked_joint_of_a_description(tmp_path):
    """What is locked beside a description is remembered with it."""
    path, toml = write_hand(tmp_path, "wrist_and_arm"), tmp_path / "mine.toml"
    assert CliRunner().invoke(main, ["hand", "check", str(path), "--toml", str(toml)]).exit_code == 0
    assert gp.load_hand(toml, {"wrist": 0.2}).description.locked["wrist"] == 0.2


def test_nothing_is_coupled_by_an_empty_table():
    import xml.etree.ElementTree as ET

    robot = ET.fromstring(urdf_text("tendon"))
    before = ET.tostring(robot)
    assert couple(robot, {}) == [] and ET.tostring(robot) == before
