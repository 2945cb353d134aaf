"""A grasp judges itself: whatever is changed shows up in its violations, in its unit."""

import dataclasses
import json
import math

import jsonschema
import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.records.grasp_files import parse_grasp_record
from grasp_planner.records.grasp_record import grasp_record, record_schema


def changed(grasp, **changes):
    return dataclasses.replace(grasp, **changes)


def test_moving_the_palm_breaks_contact_by_that_much(planned):
    away = pin.SE3(np.eye(3), np.array([0.002, 0.0, 0.0])) * planned.palm_pose
    moved = changed(planned, palm_pose=away)
    assert not moved.feasible
    assert 0.0005 < moved.violations["surface"].value < 0.0021
    assert "surface" in moved.failures()


def test_letting_go_breaks_the_friction_cones(planned):
    slack = changed(planned, delta_sigma=0 * planned.delta_sigma)
    assert slack.violations["friction"].value > 0.01
    assert slack.violations["equilibrium_force"].value < 1e-9, "eq. (17) balances the weight whatever δσ is"


def test_bending_a_joint_breaks_the_synergies(planned):
    q = np.array(planned.joint_angles)
    q[planned.problem.hand.joint_index("little_pip")] += 0.01
    assert changed(planned, joint_angles=q).violations["compliance"].value > 0.001


def test_joint_limits_are_checked(planned):
    q = np.array(planned.joint_angles)
    q[0] = planned.problem.hand.upper[0] + 0.05
    assert changed(planned, joint_angles=q).violations["joint_limit"].value == pytest.approx(0.05)


def test_contacts_beyond_the_rim_are_outside_the_region(planned):
    up = pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.2])) * planned.palm_pose
    assert changed(planned, palm_pose=up).violations["region"].value > 0.05


def test_nothing_is_feasible_that_is_not_a_number(planned):
    with pytest.raises(gp.InvalidValueError, match="delta_sigma"):
        changed(planned, delta_sigma=np.array([np.nan, 0, 0]))


def test_record_follows_the_published_schema_and_comes_back(planned):
    text = gp.grasp_json(planned)
    jsonschema.validate(json.loads(text), json.loads(record_schema()))
    record = grasp_record(planned)
    again = gp.grasp_from_record(record)
    assert again.feasible
    assert again.force_norm == pytest.approx(planned.force_norm, rel=1e-9)
    assert again.task_index == pytest.approx(planned.task_index, rel=1e-6)
    np.testing.assert_allclose(again.sigma, planned.sigma, atol=1e-9)
    assert grasp_record(again).message == record.message


def test_record_holds_what_the_contract_names(planned):
    data = json.loads(gp.grasp_json(planned))
    names = (
        "hand object task n_synergies feasible status message iterations evaluations time_s seed force_norm "
        "force_norm_floor task_index transmission_ratios alignment_angle_deg alignment_degenerate sigma "
        "delta_sigma joint_names joint_angles reference_joint_angles joint_torques palm_pose contacts "
        "external_wrench parameters violations"
    )
    assert set(names.split()) <= set(data)
    assert len(data["joint_names"]) == len(data["joint_angles"]) == 15
    assert {"link", "frame", "point", "normal", "force", "normal_force"} <= set(data["contacts"][0])
    total = np.sum([contact["force"] for contact in data["contacts"]], axis=0)
    np.testing.assert_allclose(total, -np.array(data["external_wrench"][:3]), atol=1e-8)
    assert data["contacts"][0]["link"] == "thumb_distal"
    assert {"friction", "joint_compliance", "force_weight", "loads"} <= set(data["parameters"])


def test_the_schema_in_the_documentation_is_current():
    from pathlib import Path

    path = Path(__file__).parents[1] / "docs" / "grasp.schema.json"
    assert path.read_text(encoding="utf-8") == record_schema()


def test_infinite_ratios_are_null_in_the_record(right, planned):
    """JSON has no infinity: a direction that the structure alone resists has α = null."""
    problem = dataclasses.replace(planned.problem, n_synergies=1)
    grasp = gp.Grasp(problem, planned.joint_angles, planned.palm_pose, planned.delta_sigma[:1])
    object.__setattr__(grasp, "transmission_ratios", (math.inf,))
    assert grasp_record(grasp).transmission_ratios == [None]


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("", "JSON"),
        ("{}", "hand"),
        ("[1, 2]", "object"),
        ('{"hand": NaN}', "hand"),
    ],
)
def test_malformed_files_are_one_clear_error(tmp_path, text, part):
    path = tmp_path / "grasp.json"
    path.write_text(text)
    with pytest.raises(gp.FileFormatError, match="(?i)" + part) as caught:
        gp.read_grasp_record(path)
    assert "\n" not in str(caught.value)


def test_files_from_before_load_cases_and_margins_still_load(planned):
    data = json.loads(gp.grasp_json(planned))
    del data["margins"], data["stability"], data["parameters"]["loads"]
    record = parse_grasp_record(json.dumps(data).encode(), "old.json")
    assert not gp.grasp_from_record(record).problem.loads.active
    assert gp.grasp_from_record(record).feasible


def test_load_cases_come_back_from_the_record(planned):
    loads = gp.LoadCases(torque=0.01, wrenches=((0.0, 0.0, 1.0, 0.0, 0.0, 0.0),), max_normal_force=8.0)
    grasp = changed(planned, problem=changed(planned.problem, loads=loads))
    record = grasp_record(grasp)
    assert gp.grasp_from_record(record).problem.loads == loads
    assert record.violations["load_friction"].value > 0.0
    assert "load_friction" in record.message


def test_unknown_keys_and_non_finite_numbers_are_refused(tmp_path, planned):
    data = json.loads(gp.grasp_json(planned))
    path = tmp_path / "grasp.json"
    path.write_text(json.dumps(data | {"surprise": 1}))
    with pytest.raises(gp.FileFormatError, match="surprise"):
        gp.read_grasp_record(path)
    path.write_text(json.dumps(data | {"joint_angles": [math.inf] * 15}))
    with pytest.raises(gp.FileFormatError, match="joint_angles"):
        gp.read_grasp_record(path)


def test_a_missing_file_says_so(tmp_path):
    with pytest.raises(gp.FileFormatError, match="No such file"):
        gp.read_grasp_record(tmp_path / "none.json")
