"""What is written to JSON and read back is equal: the same problem and the same grasp, to the last digit."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import grasp_planner as gp
from grasp_planner.grasp.search_report import SearchReport
from grasp_planner.records.grasp_files import parse_grasp_record
from grasp_planner.records.parts import pose_from_record, pose_record
from grasp_planner.spatial import Pose
from tests.objects.helpers import make_bracket
from tests.stored import stored

RIGHT = gp.load_hand("dlr_hit_ii_right")


def read_back(grasp, change=lambda data: data):
    """Return a grasp written, changed and read."""
    data = change(json.loads(gp.grasp_json(grasp)))
    return gp.grasp_from_record(parse_grasp_record(json.dumps(data).encode(), "grasp.json"), grasp.problem.hand)


def posed(problem, q=None, pose=None):
    """Return a grasp of a problem that touches nothing in particular."""
    q = 0.3 * problem.hand.lower + 0.7 * problem.hand.upper if q is None else q
    pose = pin.exp6(np.array([0.1, 0.2, 0.3, 1.0, 2.0, 0.1])) if pose is None else pose
    return gp.Grasp(problem, q, pose, np.linspace(-0.1, 0.1, problem.n_synergies))


def own_synergies():
    """Synergies of nobody else, their joints in another order, without variances."""
    basis, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(15, 9)))
    return gp.SynergySpace(RIGHT.joint_names[::-1], np.full(15, 0.1 / 3.0), basis, None, "mine", "drawn,\nby hand")


PROBLEMS = {
    "default": lambda: gp.GraspProblem(RIGHT, gp.Cylinder()),
    "paper": lambda: gp.GraspProblem.paper(RIGHT, gp.Cylinder()),
    "sphere": lambda: gp.GraspProblem(RIGHT, gp.Sphere(0.1 / 3, mass=1 / 7)),
    "short floats": lambda: gp.GraspProblem(RIGHT, gp.Sphere(np.float32(0.03), mass=np.float32(0.3))),
    "caps": lambda: gp.GraspProblem(RIGHT, gp.Cylinder(0.1 / 3, 0.2, 1, caps=True)),
    "box": lambda: gp.GraspProblem(RIGHT, gp.Box(x=0.04 + 1e-17, y=np.pi / 70)),
    "capsule": lambda: gp.GraspProblem(RIGHT, gp.Capsule().resized(1.1 / 3)),
    "ellipsoid": lambda: gp.GraspProblem(RIGHT, gp.EllipsoidObject(mass=np.pi / 10)),
    "tasks": lambda: gp.GraspProblem(
        RIGHT,
        gp.Box(),
        tasks=[gp.force_task([1.0, 2.0, 3.0], 1 / 3), gp.torque_task([0.1, 0.7, -0.3]), gp.twist_task(np.arange(6.0))],
    ),
    "synergies": lambda: gp.GraspProblem(RIGHT, gp.Box(), synergy_space=own_synergies(), n_synergies=7),
    "variances": lambda: gp.GraspProblem(RIGHT, gp.Box(), synergy_space=RIGHT.synergies("native").truncated(4)),
    "named": lambda: gp.GraspProblem(RIGHT, gp.Box(), synergy_set="santello", contact_set="sphere"),
    "contacts": lambda: gp.GraspProblem(RIGHT, gp.Box(), contacts=("middle", "thumb", "index")),
    "parameters": lambda: gp.GraspProblem(
        RIGHT,
        gp.Box(),
        parameters=gp.GraspParameters(
            friction=1 / 3,
            joint_compliance=tuple(np.linspace(0.1, 0.2, 15) / 3),
            gravity=np.array([0.0, -9.81, 1 / 3]),
            torque_model="internal",
            structural_compliance=0.07 / 3,
        ),
    ),
    "soft fingers": lambda: gp.GraspProblem(
        RIGHT, gp.Box(), parameters=gp.GraspParameters(contact_model=gp.model.SoftFinger(torsion=0.01 / 3))
    ),
    "loads": lambda: gp.GraspProblem(
        RIGHT,
        gp.Box(),
        loads=gp.LoadCases(
            force=0.1 / 3,
            position_error=1e-3 / 3,
            wrenches=np.random.default_rng(2).normal(size=(3, 6)),
            max_force_norm=50 / 3,
            friction_safety=np.sqrt(2.0),
        ),
    ),
    "clearance": lambda: gp.GraspProblem(
        RIGHT, gp.Box(), clearance=gp.ClearanceOptions(ground=-0.1 / 3, margin=1e-3 / 3, remark1=True)
    ),
    "joint centres": lambda: gp.GraspProblem(RIGHT, gp.Box(), clearance=gp.ClearanceOptions.named("joint_centres")),
}


@pytest.mark.parametrize("kind", PROBLEMS)
def test_problem_and_grasp_come_back_equal(kind):
    grasp = posed(PROBLEMS[kind]())
    again = read_back(grasp)
    assert again.problem == grasp.problem and hash(again.problem) == hash(grasp.problem)
    assert again == grasp and hash(again) == hash(grasp)
    assert gp.grasp_json(again) == gp.grasp_json(replace(grasp, search=again.search))


def test_an_object_of_a_mesh_file_comes_back_equal(tmp_path):
    solid = gp.MeshObject.load(make_bracket(tmp_path), density=333.3, resolution=0.003, size=1.1 / 3)
    grasp = posed(gp.GraspProblem(RIGHT, solid))
    assert read_back(grasp) == grasp


@settings(max_examples=40, deadline=None)
@given(arrays(float, 6, elements=st.floats(-4.0, 4.0)))
def test_any_pose_comes_back_equal(twist):
    pose = Pose.of(pin.exp6(twist))
    assert pose_from_record(pose_record(pose)) == pose


def test_any_task_comes_back_equal(rng):
    """Of many: scaled to length one once more, every tenth direction would change its last digit."""
    for direction in rng.normal(size=(200, 6)):
        weight = float(rng.lognormal())
        first = direction[:3]
        for task in (gp.force_task(first, weight), gp.torque_task(first, weight), gp.twist_task(direction, weight)):
            assert gp.parse_task(task.text) == task


@pytest.mark.parametrize("name", ["loads", "ground", "native_15_push"])
def test_planned_grasps_come_back_equal(name):
    assert read_back(stored(name)) == stored(name)


def test_files_without_the_matrix_have_the_quaternion(right):
    grasp = posed(PROBLEMS["paper"]())

    def older(data):
        del data["palm_pose"]["rotation"], data["synergy_space"], data["search_options"]
        return data

    again = read_back(grasp, older)
    assert again.problem == grasp.problem
    assert again.palm_pose.near(grasp.palm_pose, 1e-12)
    assert again.search.options is None


def test_matrix_and_quaternion_have_to_agree():
    def turned(data):
        data["palm_pose"]["quaternion_xyzw"] = [0.0, 0.0, 0.0, 1.0]
        return data

    with pytest.raises(gp.InvalidValueError, match=r"palm_pose\.rotation.*quaternion"):
        read_back(posed(PROBLEMS["paper"]()), turned)


def test_what_is_no_rotation_is_no_pose():
    """A file could not keep it."""
    stretched = np.diag([1.0, 1.0, 1.01, 1.0])
    mirrored = np.diag([1.0, 1.0, -1.0, 1.0])
    for wrong in (stretched, mirrored):
        with pytest.raises(gp.InvalidValueError, match="rotation"):
            Pose.of(wrong)
        with pytest.raises(gp.InvalidValueError, match="rotation"):
            Pose.of(pin.SE3(wrong))


def test_files_from_before_named_violations_with_their_unit():
    grasp = stored("clear")

    def flat(data):
        data["violations"] = {"surface_m": 1e-9, "friction_n": 0.0, "tip_patch": 0.0, "ground_m": None}
        return data

    record = parse_grasp_record(json.dumps(flat(json.loads(gp.grasp_json(grasp)))).encode(), "old.json")
    assert {name: (each.value, each.unit) for name, each in record.violations.items()} == {
        "surface": (1e-9, "m"),
        "friction": (0.0, "N"),
        "tip_patch": (0.0, "1"),
    }
    assert read_back(grasp, flat) == grasp


def test_the_file_says_how_it_was_searched():
    options = gp.PlannerOptions(starts=1, enough=3, max_iterations=2, tolerance=1e-3, time_limit_s=60.0, phase_one=True)
    grasp = gp.plan_grasp(gp.GraspProblem.paper(RIGHT, gp.Cylinder()), seed=4, options=options)
    assert grasp.search.options == options
    again = read_back(grasp)
    assert again.search.options == options and again.search.seed == 4


def test_a_wrong_search_option_in_a_file_is_refused():
    grasp = replace(stored("paper"), search=SearchReport(seed=0, options=gp.PlannerOptions()))

    def wrong(data):
        data["search_options"]["starts"] = 0
        return data

    with pytest.raises(gp.InvalidValueError, match="starts"):
        read_back(grasp, wrong)


def test_synergies_of_a_file_have_to_be_synergies():
    def ragged(data):
        data["synergy_space"]["basis"][0].pop()
        return data

    with pytest.raises(gp.InvalidValueError, match="basis"):
        read_back(posed(PROBLEMS["synergies"]()), ragged)
