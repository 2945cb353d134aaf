"""Values: equal by content, one hash, one line, not to be changed from outside, the same after a pickle."""

from __future__ import annotations

import copy
import dataclasses
import pickle

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import grasp_planner as gp
from grasp_planner.grasp.search_report import SearchReport
from grasp_planner.hand.configuration import HandConfiguration
from grasp_planner.spatial import Pose
from grasp_planner.values import LONGEST_PRINT, Value, exact_text, number_text

NUMBERS = st.floats(-2.0, 2.0, allow_nan=False)
HANDS = sorted(gp.hand_library())


def se3(numbers):
    """Return a pose of six numbers."""
    return pin.exp6(np.asarray(numbers))


def grasp_of(problem):
    """Return a grasp that touches nothing."""
    start = gp.standard_start(problem)
    return gp.Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma)


MAKERS = {
    "hand": lambda: gp.load_hand("dlr_hit_ii_right"),
    "contact": lambda: gp.load_hand("dlr_hit_ii_right").contact_frames()[0],
    "configuration": lambda: HandConfiguration(gp.load_hand("dlr_hit_ii_right"), np.full(15, 0.2), se3(range(6))),
    "pose": lambda: Pose.of(se3([0.1, 0.2, 0.3, 1.0, 0.5, 0.2])),
    "task": lambda: gp.force_task([1.0, 2.0, 3.0], 0.5),
    "synergies": lambda: gp.load_hand("dlr_hit_ii_right").synergies(),
    "parameters": lambda: gp.GraspParameters(joint_compliance=(0.1, 0.2), gravity=[0.0, 1.0, 2.0]),
    "loads": lambda: gp.LoadCases(wrenches=[[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]]),
    "clearance": lambda: gp.ClearanceOptions(ground=-0.1),
    "cylinder": gp.Cylinder,
    "ellipsoid": gp.EllipsoidObject,
    "problem": lambda: gp.GraspProblem(gp.load_hand("dlr_hit_ii_right"), gp.Box()),
    "start": lambda: gp.standard_start(gp.GraspProblem(gp.load_hand("dlr_hit_ii_right"), gp.Box())),
    "grasp": lambda: grasp_of(gp.GraspProblem(gp.load_hand("dlr_hit_ii_right"), gp.Box())),
}
"""Every kind of value, made anew at each call."""


@pytest.mark.parametrize("kind", MAKERS)
def test_the_same_content_is_one_value(kind):
    one, two = MAKERS[kind](), MAKERS[kind]()
    assert one is not two and one == two and hash(one) == hash(two)
    assert len({one, two}) == 1
    assert one != "something else"
    for again in (pickle.loads(pickle.dumps(one)), copy.deepcopy(one), copy.copy(one), dataclasses.replace(one)):
        assert again == one and hash(again) == hash(one)


@pytest.mark.parametrize("kind", MAKERS)
def test_values_print_in_one_line(kind):
    text = repr(MAKERS[kind]())
    assert "\n" not in text and len(text) < (100 if kind == "hand" else 300)
    assert text.startswith(type(MAKERS[kind]()).__name__)


@pytest.mark.parametrize("kind", MAKERS)
def test_nothing_in_a_value_can_be_changed(kind):
    """Neither its fields nor its arrays, after a pickle either."""
    for value in (MAKERS[kind](), pickle.loads(pickle.dumps(MAKERS[kind]()))):
        for field in dataclasses.fields(value):
            held = getattr(value, field.name)
            with pytest.raises(dataclasses.FrozenInstanceError):
                setattr(value, field.name, held)
            assert not isinstance(held, list | pin.SE3)
            if isinstance(held, np.ndarray):
                with pytest.raises(ValueError, match="read-only"):
                    held[...] = 0.0


CHANGES = {
    "task": [{"weight": 0.6}, {"kind": "torque"}, {"direction": np.eye(6)[0]}],
    "parameters": [{"friction": 0.5}, {"gravity": np.array([0.0, 1.0, 2.5])}, {"joint_compliance": (0.1, 0.3)}],
    "loads": [{"force": 2.0}, {"wrenches": ()}],
    "clearance": [{"ground": None}, {"remark1": True}],
    "cylinder": [{"radius": 0.031}, {"mass": 0.3}, {"caps": 1}],
    "synergies": [{"mean": np.zeros(15)}, {"name": "other"}],
    "start": [{"joint_angles": np.zeros(15)}, {"palm_pose": pin.SE3.Identity()}, {"prepared": True}],
    "grasp": [{"joint_angles": np.zeros(15)}, {"palm_pose": pin.SE3.Identity()}, {"delta_sigma": np.ones(3)}],
    "problem": [
        {"grasp_object": gp.Box(x=0.041)},
        {"tasks": (gp.force_task((0.0, 1.0, 0.0), 2.0),)},
        {"n_synergies": 7},
        {"parameters": gp.GraspParameters(friction=0.7)},
        {"parameters": gp.GraspParameters(joint_compliance=0.2)},
        {"clearance": gp.ClearanceOptions.off()},
        {"loads": gp.LoadCases.off()},
        {"contacts": ("thumb", "index", "middle")},
    ],
    "hand": [
        {"lower": np.full(15, -0.1)},
        {"coupling": np.zeros((20, 15))},
        {"palm_in_root": pin.SE3.Random()},
        {"model": gp.load_hand("dlr_hit_ii_left").model},
        {"collision_model": gp.load_hand("dlr_hit_ii_left").collision_model},
        {"description": gp.load_hand("dlr_hit_ii_left").description},
    ],
    "pose": [{"translation": np.array([0.1, 0.2, 0.30000001])}, {"rotation": np.eye(3)}],
    "configuration": [{"q": np.zeros(15)}, {"palm_pose": pin.SE3.Identity()}],
}


@pytest.mark.parametrize("kind", CHANGES)
def test_any_other_content_is_another_value(kind):
    value = MAKERS[kind]()
    for change in CHANGES[kind]:
        assert dataclasses.replace(value, **change) != value, change


def test_how_a_grasp_was_found_does_not_count(right):
    grasp = grasp_of(gp.GraspProblem(right, gp.Box()))
    assert dataclasses.replace(grasp, search=SearchReport(seed=4)) == grasp


def test_problems_that_ask_the_same_are_equal(right):
    """What is left out is what the hand says; naming it makes no other problem."""
    plain = gp.GraspProblem(right, gp.Sphere())
    frames = [frame.name for frame in plain.frames]
    for change in (
        {"synergy_set": plain.synergy_set_name},
        {"contact_set": "sphere"},
        {"contacts": tuple(reversed(frames))},
        {"n_synergies": 3},
        {"parameters": gp.GraspParameters(joint_compliance=tuple(right.joint_compliance.tolist()))},
        {"synergy_space": right.synergies(plain.synergy_set_name)},
    ):
        again = dataclasses.replace(plain, **change)
        assert again == plain and hash(again) == hash(plain), change


def test_what_was_given_may_change_later(right):
    """Arrays, lists and poses are copied: a grasp and its cached numbers never go stale."""
    q, pose, delta, tasks = np.full(15, 0.3), pin.SE3.Identity(), np.zeros(3), [gp.force_task((0.0, 1.0, 0.0))]
    gravity, names, mean = np.array([0.0, 0.0, -9.81]), list(right.joint_names), np.zeros(15)
    problem = gp.GraspProblem(right, gp.Sphere(), tasks=tasks, parameters=gp.GraspParameters(gravity=gravity))
    space = gp.SynergySpace(names, mean, np.eye(15))
    grasp, start = gp.Grasp(problem, q, pose, delta), gp.GraspStart(q, pose, delta)
    contact = dataclasses.replace(problem.frames[0], offset=[0.0, 0.0, 0.01])
    values = (problem, space, grasp, start, contact)
    before = [(hash(value), repr(value)) for value in values]
    points = grasp.contacts.points.copy()
    q += 1.0
    delta += 1.0
    gravity += 1.0
    mean += 1.0
    pose.translation = np.ones(3)
    tasks.clear()
    names.clear()
    assert [(hash(value), repr(value)) for value in values] == before
    np.testing.assert_array_equal(dataclasses.replace(grasp).contacts.points, points)
    assert isinstance(space.joint_names, tuple) and isinstance(contact.offset, tuple)
    for array in (problem.parameters.gravity, space.mean, start.joint_angles):
        assert not array.flags.writeable


def test_a_long_value_is_cut():
    @dataclasses.dataclass(frozen=True, eq=False, repr=False)
    class Long(Value):
        words: tuple[str, ...]
        numbers: np.ndarray

    text = repr(Long(tuple(f"a rather\nlong word {k}" for k in range(40)), np.zeros((4, 5))))
    assert len(text) < LONGEST_PRINT + 20 and "\n" not in text and "<4 × 5>" in text


@given(arrays(float, (2, 3), elements=NUMBERS), arrays(float, (2, 3), elements=NUMBERS))
def test_arrays_count_by_numbers_and_shape(one, two):
    @dataclasses.dataclass(frozen=True, eq=False, repr=False)
    class Held(Value):
        numbers: np.ndarray

    assert (Held(one) == Held(two)) == np.array_equal(one, two)
    assert Held(one) == Held(np.asfortranarray(one.copy()))
    assert Held(one) != Held(one.ravel())
    assert Held(0.0 * one) == Held(-0.0 * one) and hash(Held(0.0 * one)) == hash(Held(-0.0 * one))


@pytest.mark.parametrize(
    ("number", "text"),
    (
        (2423.7, "2420"),
        (1.1e-5, "1.1·10⁻⁵"),
        (-3.0, "−3"),
        (2e9, "2·10⁹"),
        (np.nan, "–"),
        (-np.inf, "−∞"),
        (0.25, "0.25"),
    ),
)
def test_a_number_is_written_as_people_write_it(number, text):
    assert number_text(number) == text


@given(st.floats(allow_nan=False, allow_infinity=False), st.integers(1, 6))
def test_the_text_of_a_number_is_the_number_rounded(number, digits):
    plain = number_text(number, digits).translate(str.maketrans("−⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "--0123456789"))
    assert float(plain.replace("·10", "e")) == float(f"{number:.{digits}g}")


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_exact_text_reads_back(number):
    assert float(exact_text(number)) == number


@settings(max_examples=50)
@given(arrays(float, 6, elements=NUMBERS), arrays(float, 6, elements=NUMBERS), arrays(float, 3, elements=NUMBERS))
def test_the_algebra_of_poses_is_pinocchios(first, second, point):
    a, b = se3(first), se3(second)
    one, two = Pose.of(a), Pose.of(b)
    for found, expected in (
        (one * two, a * b),
        (a * two, a * b),
        (one * b, a * b),
        (one.inverse(), a.inverse()),
        (Pose.of(a.homogeneous), a),
        (Pose.of(one), a),
    ):
        assert isinstance(found, Pose)
        np.testing.assert_array_equal(found.homogeneous, expected.homogeneous)
        np.testing.assert_array_equal(found.se3().homogeneous, expected.homogeneous)
    np.testing.assert_array_equal(one.act(point), a.act(point))
    assert one.near(a, 0.0) and not one.near(a * pin.SE3(np.eye(3), np.array([1e-3, 0.0, 0.0])), 1e-4)


@pytest.mark.parametrize("wrong", ["here", None, np.eye(3), [[1.0]], np.full((4, 4), np.nan)])
def test_what_is_no_pose_is_refused(wrong):
    with pytest.raises(gp.InvalidValueError, match="pose"):
        Pose.of(wrong)


def test_poses_of_other_things_do_not_multiply():
    with pytest.raises(TypeError):
        Pose.identity() * 2.0
    with pytest.raises(TypeError):
        2.0 * Pose.identity()
    changed = Pose.identity().se3()
    changed.translation = np.ones(3)
    assert Pose.identity() == Pose.of(pin.SE3.Identity())


@pytest.mark.parametrize("name", HANDS)
def test_a_pickled_hand_moves_alike(name):
    hand = gp.load_hand(name)
    again = pickle.loads(pickle.dumps(hand))
    q = 0.5 * (hand.lower + hand.upper)
    one, two = HandConfiguration(hand, q), HandConfiguration(again, q)
    assert again == hand and one == two
    for a, b in zip(one.geometry_poses, two.geometry_poses, strict=True):
        assert a == b
