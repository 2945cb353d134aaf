"""The human hand's kinematics and the retargeting by fingertips."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.hand.kinematics import HandKinematics
from grasp_planner.spatial import Array
from grasp_planner.synergies.human_hand import (
    HUMAN_FINGERS,
    HUMAN_JOINTS,
    HumanHand,
    human_fingertips,
    thumb_from_carpometacarpal,
    thumb_metacarpal,
)
from grasp_planner.synergies.retargeting import FingerCorrespondence, RetargetingWeights, retarget_postures

HUMAN = HumanHand()
REST = np.radians([-8.0, 20.0, 45.0, *[0.0, 25.0, 35.0] * 4])


def posture(**degrees: float) -> Array:
    angles = np.zeros(len(HUMAN_JOINTS))
    for name, value in degrees.items():
        angles[HUMAN_JOINTS.index(name)] = np.radians(value)
    return angles


@pytest.fixture(scope="module")
def robot():
    hand = gp.load_hand("dlr_hit_ii_right")
    kinematics = HandKinematics(hand, hand.contact_frames("point"))

    def fingertips(q: Array) -> tuple[Array, Array]:
        result = kinematics.compute(q)
        return result.position, result.linear

    return hand, fingertips


def same_hand(fingertips) -> FingerCorrespondence:
    """A robot laid over itself: the human tips are its own."""
    bases = fingertips(np.zeros(15))[0][1:]
    return FingerCorrespondence(bases, bases, np.ones(4), 1.0)


def test_straight_hand_has_the_published_length():
    """[Buchholz1992]: the segments of the middle finger and its MCP add up to 0.99 hand lengths."""
    tips = human_fingertips(HUMAN, posture()).position
    assert tips.shape == (5, 3)
    assert tips[2] == pytest.approx([0.0, 0.0, 0.19 * (0.446 + 0.266 + 0.170 + 0.108)])
    assert tips[1] == pytest.approx([0.0, 0.085 * 0.251, 0.19 * (0.447 + 0.245 + 0.143 + 0.097)])
    # Straight fingers lie in the palm's plane; pulps look out of the palm.
    assert tips[1:, 0] == pytest.approx(np.zeros(4))
    assert human_fingertips(HUMAN, posture()).pulp[1:] == pytest.approx(np.tile([1.0, 0.0, 0.0], (4, 1)))


def test_right_angle_at_the_knuckle_points_out_of_the_palm():
    tips = human_fingertips(HUMAN, posture(index_mcp=90.0)).position
    reach = HUMAN.finger_lengths[0]
    assert tips[1] == pytest.approx(HUMAN.finger_bases[0] + [reach, 0.0, 0.0])


def test_curled_finger_has_two_thirds_of_the_pip_at_the_dip():
    tips = human_fingertips(HUMAN, posture(middle_pip=60.0)).position
    z = 0.446 + 0.266 + 0.170 * np.cos(np.radians(60)) + 0.108 * np.cos(np.radians(100))
    x = 0.170 * np.sin(np.radians(60)) + 0.108 * np.sin(np.radians(100))
    assert tips[2] == pytest.approx([0.19 * x, 0.0, 0.19 * z])


def test_spreading_moves_the_fingers_apart():
    straight = human_fingertips(HUMAN, posture()).position[:, 1]
    spread = human_fingertips(
        HUMAN, posture(index_middle_abduction=10.0, middle_ring_abduction=10.0, ring_little_abduction=10.0)
    ).position[:, 1]
    assert spread[1] > straight[1]
    assert spread[2] == pytest.approx(straight[2])
    assert spread[3] < straight[3]
    # The little finger turns by the sum of two separations.
    assert spread[4] - straight[4] == pytest.approx(-HUMAN.finger_lengths[3] * np.sin(np.radians(20.0)))


def test_the_thumb_lies_beside_the_palm_and_in_front_of_it_after_rotation():
    beside = human_fingertips(HUMAN, posture(thumb_abduction=50.0)).position[0]
    in_front = human_fingertips(HUMAN, posture(thumb_abduction=50.0, thumb_rotation=90.0)).position[0]
    assert beside[1] > 0.08
    assert abs(beside[0]) < 0.02
    assert in_front[0] > 0.08
    assert abs(in_front[1]) < 0.03
    length = 0.19 * (0.251 + 0.196 + 0.158)
    assert np.linalg.norm(beside - HUMAN.thumb_base) == pytest.approx(length)


def test_flexing_the_opposed_thumb_brings_it_to_the_fingers():
    grip = dict(thumb_rotation=95.0, thumb_abduction=55.0, **{f"{f}_mcp": 30.0 for f in HUMAN_FINGERS[1:]})
    grip |= {f"{f}_pip": 50.0 for f in HUMAN_FINGERS[1:]}
    open_distance, cosine = human_fingertips(HUMAN, posture(**grip)).opposition()
    closed_distance, _ = human_fingertips(HUMAN, posture(**grip, thumb_mcp=30.0)).opposition()
    assert cosine > 0.0
    assert closed_distance < open_distance
    _, flat = human_fingertips(HUMAN, posture()).opposition()
    assert flat < 0.5


def test_many_postures_at_once():
    postures = np.random.default_rng(0).normal(0.0, 0.4, (3, 4, 15))
    together = human_fingertips(HUMAN, postures)
    assert together.position.shape == together.pulp.shape == (3, 4, 5, 3)
    assert np.linalg.norm(together.pulp, axis=-1) == pytest.approx(np.ones((3, 4, 5)))
    alone = human_fingertips(HUMAN, postures[2, 1])
    assert together.position[2, 1] == pytest.approx(alone.position)


def test_thumb_charts_agree():
    """Zero flexion and abduction is the rest; palmar abduction moves out of the palm, flexion to the little finger."""
    rest = (np.radians(70.0), np.radians(45.0))
    step = np.array([0.0, 0.1])
    rotation, abduction = thumb_from_carpometacarpal(rest, np.zeros(2), step)
    assert (rotation[0], abduction[0]) == pytest.approx(rest)
    moved = thumb_metacarpal(HUMAN, rotation, abduction) @ HUMAN.thumb_frame
    assert moved[1, 2] > moved[0, 2]
    rotation, abduction = thumb_from_carpometacarpal(rest, step, np.zeros(2))
    moved = thumb_metacarpal(HUMAN, rotation, abduction) @ HUMAN.thumb_frame
    assert moved[1, 2] == pytest.approx(moved[0, 2])
    assert moved[1, 1] < moved[0, 1]


def test_wrong_sizes_are_refused():
    with pytest.raises(gp.InvalidValueError, match="postures"):
        human_fingertips(HUMAN, np.zeros(14))
    with pytest.raises(gp.InvalidValueError, match="length"):
        HumanHand(length=-0.19)
    with pytest.raises(gp.InvalidValueError, match="thumb_pronation"):
        HumanHand(thumb_pronation=float("nan"))


@pytest.mark.parametrize("tilt", [0.0, None])
def test_a_reachable_posture_is_recovered(robot, tilt):
    hand, fingertips = robot
    rng = np.random.default_rng(1)
    wanted = np.clip(REST + rng.uniform(-0.15, 0.15, (4, 15)), hand.lower + 0.02, hand.upper - 0.02)
    tips = np.array([fingertips(q)[0] for q in wanted])
    laid = replace(same_hand(fingertips), opposition_tilt=tilt)
    found = retarget_postures(fingertips, (hand.lower, hand.upper), tips, laid, REST, RetargetingWeights(rest=1e-3))
    assert found.finger_errors.max() < 1e-5
    assert np.abs(found.opposition_errors).max() < 1e-4
    # Lengths and sideways offsets leave the thumb a choice, which the rest decides; whole vectors do not.
    free = 0 if tilt is not None else 3
    assert found.joint_angles[:, free:] == pytest.approx(wanted[:, free:], abs=2e-3)


def test_tilt_turns_only_the_vectors_of_the_thumb(robot):
    _, fingertips = robot
    tips = fingertips(REST)[0]
    fingers, across = replace(same_hand(fingertips), opposition_tilt=-np.pi / 2).targets(tips)
    assert fingers == pytest.approx(tips[1:])
    # z turns into -x, x into z.
    wanted = tips[1:] - tips[0]
    assert across == pytest.approx(np.column_stack([-wanted[:, 2], wanted[:, 1], wanted[:, 0]]))


def test_the_result_keeps_the_limits_and_does_not_depend_on_the_order(robot):
    hand, fingertips = robot
    rng = np.random.default_rng(2)
    human = human_fingertips(HUMAN, posture(thumb_rotation=95.0, thumb_abduction=55.0) + rng.uniform(0, 0.8, (3, 15)))
    bases = fingertips(np.zeros(15))[0][1:] - [0.0, 0.0, 0.105]
    laid = FingerCorrespondence(HUMAN.finger_bases, bases, 0.105 / HUMAN.finger_lengths, 1.1)
    limits = (hand.lower, hand.upper)
    found = retarget_postures(fingertips, limits, human.position, laid, REST)
    again = retarget_postures(fingertips, limits, human.position[::-1], laid, REST)
    assert (found.joint_angles >= hand.lower).all()
    assert (found.joint_angles <= hand.upper).all()
    assert (found.joint_angles == again.joint_angles[::-1]).all()


def test_bad_input_is_refused(robot):
    hand, fingertips = robot
    laid, limits = same_hand(fingertips), (hand.lower, hand.upper)
    with pytest.raises(gp.InvalidValueError, match="human_tips"):
        retarget_postures(fingertips, limits, np.zeros((2, 4, 3)), laid, REST)
    with pytest.raises(gp.InvalidValueError, match="human_tips"):
        retarget_postures(fingertips, limits, np.full((1, 5, 3), np.nan), laid, REST)
    with pytest.raises(gp.InvalidValueError, match="limits"):
        retarget_postures(fingertips, (hand.upper, hand.lower), np.zeros((1, 5, 3)), laid, REST)
    with pytest.raises(gp.InvalidValueError, match="finger_scale"):
        FingerCorrespondence(np.zeros((4, 3)), np.zeros((4, 3)), np.zeros(4), 1.0)
    with pytest.raises(gp.InvalidValueError, match="rest"):
        retarget_postures(fingertips, limits, np.zeros((1, 5, 3)), laid, REST, RetargetingWeights(rest=(1.0, 1.0)))
    with pytest.raises(gp.InvalidValueError, match="opposition_tilt"):
        replace(laid, opposition_tilt=float("inf"))
    with pytest.raises(gp.InvalidValueError, match="opposition"):
        RetargetingWeights(opposition=(1.0, 1.0))


def test_statistics_of_people_ship_with_the_hand():
    folder = Path(gp.__file__).parents[1] / "urdf" / "dlr_hit_ii" / "synergies" / "human"
    for name in ("santello1998", "replication2021", "uji2019"):
        lines = (folder / f"{name}.csv").read_text(encoding="utf-8").splitlines()
        assert lines[0].startswith("# source: ")
        rows = [line for line in lines if not line.startswith("#")]
        assert len(rows) >= 16
