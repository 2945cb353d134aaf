"""The judge of clearances, of balls, half-spaces and capsules, by formulas that can be checked on paper."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.hand.configuration import HandConfiguration
from grasp_planner.judge.clearance_check import configuration_clearances
from tests.judge_model import FINGERS, placed
from tests.stored import stored
from tests.test_judge import with_problem

ALL = gp.ClearanceOptions(ground=-0.03, remark1=True)
TOUCHING = {f"{finger}_{part}" for finger in FINGERS for part in ("distal", "pad")}


def moved(name, options=ALL, *, shift=(0.0, 0.0, 0.0), bend=None):
    """Return a stored grasp that is to keep clear, its palm shifted [m] and joints bent [rad]."""
    grasp = with_problem(stored(name), clearance=options)
    q = np.array(grasp.joint_angles)
    for joint, angle in (bend or {}).items():
        q[grasp.problem.hand.joint_index(joint)] += angle
    pose = pin.SE3(np.eye(3), np.array(shift)) * grasp.palm_pose
    return gp.Grasp(grasp.problem, q, pose, grasp.delta_sigma)


def solids(grasp):
    """Return link, axis (two points in O) and radius of every capsule and ball of the hand."""
    data, root = placed(grasp)
    hand = grasp.problem.hand
    found = []
    for entry in hand.collision_model.geometryObjects:
        if not hasattr(entry.geometry, "radius"):
            continue
        pose = root * data.oMi[entry.parentJoint] * entry.placement
        half = getattr(entry.geometry, "halfLength", 0.0)
        ends = [np.array(pose.act(np.array([0.0, 0.0, sign * half]))) for sign in (-1.0, 1.0)]
        found.append((hand.model.frames[entry.parentFrame].name, *ends, entry.geometry.radius))
    return found


def from_axis(point, a, b):
    """Return the distance of a point from a segment."""
    share = np.clip((point - a) @ (b - a) / max((b - a) @ (b - a), 1e-30), 0.0, 1.0)
    return float(np.linalg.norm(point - a - share * (b - a)))


def between_axes(a, b, c, d):
    """Return the distance of two segments, convex along either: by nested golden sections."""

    def golden(function):
        low, high, ratio = 0.0, 1.0, (np.sqrt(5.0) - 1.0) / 2.0
        for _ in range(60):
            left, right = high - ratio * (high - low), low + ratio * (high - low)
            low, high = (low, right) if function(left) < function(right) else (left, high)
        return function(0.5 * (low + high))

    return golden(lambda s: from_axis(a + s * (b - a), c, d))


SHIFTS = [(0.0, 0.0, 0.0), (0.02, -0.01, 0.03), (-0.015, 0.01, -0.01)]


@pytest.mark.parametrize("shift", SHIFTS)
@pytest.mark.parametrize("name", ["round_sphere", "point_sphere"])
def test_links_in_a_ball(name, shift):
    """The depth of a capsule in a ball is R + r less the distance of the ball's centre from its axis.

    The last link around a point fingertip may be inside; around a round one it may not.
    """
    grasp = moved(name, shift=shift)
    depth = {}
    for link, a, b, radius in solids(grasp):
        depth[link] = max(depth.get(link, 0.0), 0.035 + radius - from_axis(np.zeros(3), a, b))
    exempt = TOUCHING if name.startswith("point") else set()
    deepest = max(value for link, value in depth.items() if link not in exempt)
    palm = min(p.distance for p in grasp.clearances if p.kind == "link_object" and p.link_a == "palm")
    assert deepest > 0.002 and palm > -deepest
    assert grasp.violations["link_object"].value == pytest.approx(deepest, abs=1e-6)
    assert grasp.overlap("link_object") == pytest.approx(deepest, abs=1e-6)
    assert {p.link_a for p in grasp.clearances if p.kind == "link_object" and p.exempt} == exempt
    for pair in grasp.clearances:
        if pair.kind == "link_object" and pair.link_a != "palm" and pair.distance < 0.0:
            assert -pair.distance <= depth[pair.link_a] + 1e-6


@pytest.mark.parametrize("shift", [*SHIFTS, "onto a joint"])
def test_joint_centres_in_a_ball(shift):
    """Remark 2 by joint centres: the depth of the deepest of all 20 of them."""
    options = gp.ClearanceOptions(link_object="joint_centres", self_collision=False, tip_patch=False)
    onto = isinstance(shift, str)
    if onto:
        data, root = placed(moved("round_sphere", options))
        shift = [0.02, 0.0, 0.0] - root.act(data.oMi.tolist()[-1].translation)
    grasp = moved("round_sphere", options, shift=shift)
    data, root = placed(grasp)
    distances = [np.linalg.norm(root.act(p.translation)) for p in data.oMi.tolist()[1:]]
    assert len(distances) == 20
    expected = max(0.0, 0.035 - min(distances))
    found = grasp.violations
    assert found["joint_centre"].value == pytest.approx(expected, abs=1e-12)
    assert "link_object" not in found
    assert expected >= 0.015 - 1e-9 or not onto, "else nothing is shown"


def test_joint_centres_beyond_the_caps_of_a_cylinder_are_outside():
    """The solid counts: above its cap nothing is in the cylinder, though fingertips see its side only."""
    options = gp.ClearanceOptions(link_object="joint_centres")
    inside = moved("paper", options, shift=(0.0, 0.0, 0.0))
    data, root = placed(inside)
    centres = np.array([root.act(p.translation) for p in data.oMi.tolist()[1:]])
    deepest = centres[np.argmin(np.hypot(*centres.T[:2]))]
    into = moved("paper", options, shift=-deepest * [1.0, 1.0, 0.0])
    assert into.violations["joint_centre"].value == pytest.approx(0.03, abs=1e-6)
    beyond = moved("paper", options, shift=-deepest * [1.0, 1.0, 0.0] + [0.0, 0.0, 1.0])
    assert beyond.violations["joint_centre"].value == 0.0


CROSSED = [{"index_abd": 0.5}, {"middle_abd": 0.5}, {"ring_abd": -0.5}]


@pytest.mark.parametrize("bend", CROSSED)
def test_fingers_in_each_other(bend):
    """The depth of two capsules in each other is the sum of their radii less the distance of their axes."""
    grasp = moved("clear", bend=bend)
    found = solids(grasp)
    deepest = 0.0
    for i, (first, a, b, r) in enumerate(found):
        for second, c, d, s in found[:i]:
            if first.split("_")[0] != second.split("_")[0] and "palm" not in (first, second):
                deepest = max(deepest, r + s - between_axes(a, b, c, d))
    with_palm = [p.distance for p in grasp.clearances if p.kind == "self_collision" and "palm" in (p.link_a, p.link_b)]
    assert deepest > 0.002 and min(with_palm) > -deepest
    assert grasp.violations["self_collision"].value == pytest.approx(deepest, abs=1e-6)


@pytest.mark.parametrize("height", [-0.03, 0.0, 0.02])
def test_links_in_the_ground(height):
    """The lowest point of the hand below the ground, which lies across gravity, whatever its direction."""
    gravity = np.array([3.0, -4.0, -12.0])
    options = replace(ALL, ground=height)
    grasp = moved("clear", options, shift=(0.0, 0.0, -0.05))
    for up, problem in (
        (np.array([0.0, 0.0, 1.0]), grasp.problem),
        (-gravity / 13.0, replace(grasp.problem, parameters=gp.GraspParameters(gravity=gravity))),
    ):
        found = gp.Grasp(problem, grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma)
        lowest = min(min(a @ up, b @ up) - r for _, a, b, r in solids(found))
        data, root = placed(found)
        for entry in problem.hand.collision_model.geometryObjects:
            if hasattr(entry.geometry, "halfSide"):
                pose = root * data.oMi[entry.parentJoint] * entry.placement
                lowest = min(lowest, up @ pose.translation - np.abs(pose.rotation.T @ up) @ entry.geometry.halfSide)
        assert found.violations["ground"].value == pytest.approx(max(0.0, height - lowest), abs=1e-6)
        assert height - lowest > 0.005


@pytest.mark.parametrize("bend", [{"index_pip": -0.5}, {"thumb_pip": 0.6}, {"ring_mcp": 0.4, "ring_pip": -0.9}])
@pytest.mark.parametrize("name", ["clear", "round_sphere"])
def test_overhang_of_the_last_links(name, bend):
    """How far the axis of a touching last link, from its joint to the fingertip, points away from the object."""
    grasp = moved(name, bend=bend)
    shape, model = grasp.problem.grasp_object, grasp.problem.hand.model
    data, root = placed(grasp)
    leans = []
    for finger in FINGERS:
        joint, tip = data.oMi[model.getJointId(f"{finger}_dip")], data.oMf[model.getFrameId(f"{finger}_pad")]
        axis = root.rotation @ (tip.translation - joint.translation)
        out = np.array(root.act(tip.translation))
        if isinstance(shape, gp.Cylinder):
            out[2] = 0.0
        leans.append(axis @ out / np.linalg.norm(axis) / np.linalg.norm(out))
    assert grasp.violations["tip_patch"].value == pytest.approx(max(0.0, *leans), abs=1e-9)


def test_some_overhang_is_seen():
    assert moved("clear", bend={"index_pip": -0.5}).violations["tip_patch"].value > 0.1


@pytest.mark.parametrize("hand", ["dlr_hit_ii_right", "dlr_hit_ii_left"])
@pytest.mark.parametrize("k", range(3))
def test_order_of_abduction(hand, k):
    """Each pair of neighbours in the wrong order by 0.1 rad, every other pair in the right one."""
    names = ("index_abd", "middle_abd", "ring_abd", "little_abd")
    problem = gp.GraspProblem(gp.load_hand(hand), gp.Cylinder(), clearance=gp.ClearanceOptions(remark1=True))
    angles = np.array([-0.1, 0.0, 0.1, 0.2])
    pose = gp.standard_start(problem).palm_pose

    def judged(values):
        q = problem.hand.posture(dict(zip(names, values, strict=True)))
        return gp.Grasp(problem, q, pose, np.zeros(problem.n_synergies)).violations["abduction_order"].value

    assert judged(angles) == 0.0
    angles[: k + 1] += 0.2
    assert judged(angles) == pytest.approx(0.1, abs=1e-12)


def test_what_is_not_asked_for_does_not_count():
    off = gp.ClearanceOptions.off()
    names = {
        "link_object": gp.ClearanceOptions(),
        "joint_centre": replace(off, link_object="joint_centres"),
        "self_collision": replace(off, self_collision=True),
        "ground": replace(off, ground=0.02),
        "tip_patch": replace(off, tip_patch=True),
        "abduction_order": replace(off, remark1=True),
    }
    bad = {"index_abd": 0.5, "index_pip": -0.5}
    for name, options in names.items():
        asked = moved("clear", options, shift=(0.02, 0.0, -0.05), bend=bad).violations
        assert name in asked
        if name != "link_object":
            assert not (set(names) - {name}) & set(asked)
    without = moved("clear", off, shift=(0.02, 0.0, -0.05), bend=bad).violations
    assert not set(names) & set(without)


@pytest.mark.parametrize("text", ["cylinder:radius=0.03,height=0.15", "box:x=0.05,y=0.06,z=0.12"])
def test_the_near_pairs_are_those_that_overlap(text, rng):
    """Of random postures, many of them with overlaps: what is left out is clear, and of the others nothing differs."""
    clearance = gp.ClearanceOptions(ground=-0.06)
    problem = gp.GraspProblem(gp.load_hand("dlr_hit_ii_right"), gp.parse_object(text), clearance=clearance)
    hand, overlaps = problem.hand, 0
    for _ in range(10):
        start = gp.random_start(problem, rng)
        q = hand.lower + rng.random(hand.n_joints) * (hand.upper - hand.lower)
        configuration = HandConfiguration(hand, q, start.palm_pose)
        everything = configuration_clearances(problem, configuration)
        near = configuration_clearances(problem, configuration, near=0.0)
        assert set(near) == {pair for pair in everything if pair.distance <= 0.0}
        overlaps += sum(pair.distance < 0.0 for pair in near)
    assert overlaps > 20
