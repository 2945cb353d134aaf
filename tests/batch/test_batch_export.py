"""Exports: what is written is what is read back, in the documented frames and joint order."""

import csv
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from grasp_planner import grasp_from_record, read_grasp_record
from grasp_planner.batch import GraspCase, load_grasps, load_rows, run_batch
from grasp_planner.batch.export import (
    PREGRASP_GAP,
    dexgraspbench_grasp,
    export_rows,
    palm_pose_of,
    pregrasp_angles,
    read_dexgraspbench,
)
from grasp_planner.batch.report import best_rows, write_report
from grasp_planner.batch.results import load_table
from grasp_planner.batch.run_files import read_run_info


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    """A run of three cases, its records and its grasps."""
    folder = tmp_path_factory.mktemp("run")
    settings = {"starts": 4, "enough": 1}
    cases = [GraspCase(object="cylinder:radius=0.03", n_synergies=n, settings=settings) for n in (3, 5, 15)]
    run_batch(cases, folder, workers=1)
    return folder, load_rows(folder, [0, 1, 2]), load_grasps(folder, [0, 1, 2])


def test_json_is_the_record(planned, tmp_path):
    folder, records, _ = planned
    paths = export_rows(folder, [2, 0], tmp_path, "json")
    assert [path.name for path in paths] == ["row-000002.json", "row-000000.json"]
    assert read_grasp_record(paths[0]) == records[2]
    assert grasp_from_record(read_grasp_record(paths[1])).verdict == records[0].message


def test_csv_has_named_joints_and_exact_numbers(planned, tmp_path):
    folder, records, grasps = planned
    (path,) = export_rows(folder, [0, 1, 2], tmp_path, "csv")
    with path.open(newline="") as file:
        lines = list(csv.DictReader(file))
    for line, record, grasp in zip(lines, records, grasps, strict=True):
        names = grasp.problem.hand.joint_names
        assert [float(line[f"q_{name}_rad"]) for name in names] == record.joint_angles
        assert [float(line[f"qr_{name}_rad"]) for name in names] == record.reference_joint_angles
        palm = [float(line[f"palm_{axis}"]) for axis in ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")]
        assert palm == [*record.palm_pose.position, *record.palm_pose.quaternion_xyzw]
    assert [int(line["row"]) for line in lines] == [0, 1, 2]
    export_rows(folder, [1], tmp_path, "csv")
    assert len(path.read_text().splitlines()) == 2, "a second export begins the file anew"


@pytest.mark.parametrize("all_joints", [False, True])
def test_dexgraspbench_round_trip(planned, tmp_path, all_joints):
    folder, _, grasps = planned
    paths = export_rows(folder, [0, 1, 2], tmp_path, "dexgraspbench", all_joints=all_joints)
    for path, grasp in zip(paths, grasps, strict=True):
        found, hand = read_dexgraspbench(path), grasp.problem.hand
        n = hand.model.nv if all_joints else hand.n_joints
        assert path.suffix == ".npy" and path.parts[-3] == hand.name
        assert len(found.joint_names) == n and (found.hand, found.object) == (
            hand.name,
            grasp.problem.grasp_object.text,
        )
        for pose, angles in ((found.grasp, grasp.joint_angles), (found.squeeze, grasp.reference_joint_angles)):
            assert pose.shape == (7 + n,)
            expected = hand.full_configuration(angles) if all_joints else angles
            np.testing.assert_array_equal(pose[7:], expected)
            assert np.linalg.norm(pose[3:7]) == pytest.approx(1.0)
            palm = palm_pose_of(pose, hand)
            assert palm.near(grasp.palm_pose, 1e-12)
        expected = dexgraspbench_grasp(grasp, all_joints=all_joints)
        np.testing.assert_array_equal(found.pregrasp, expected.pregrasp)
        np.testing.assert_array_equal(found.pregrasp[:7], found.grasp[:7])


def test_dexgraspbench_keys_and_quaternion_order(planned, tmp_path):
    folder, _, (grasp, *_) = planned
    (path,) = export_rows(folder, [0], tmp_path, "dexgraspbench")
    data = np.load(path, allow_pickle=True).item()
    assert {"obj_pose", "obj_scale", "obj_path", "pregrasp_qpos", "grasp_qpos", "squeeze_qpos"} <= set(data)
    np.testing.assert_array_equal(data["obj_pose"], [0, 0, 0, 1, 0, 0, 0])
    w, x, y, z = data["grasp_qpos"][3:7]
    root = pin.SE3(pin.Quaternion(w, x, y, z).matrix(), data["grasp_qpos"][:3])
    # The fingertips of the hand in the world, from the root link and all joints alone, lie on the object.
    hand = grasp.problem.hand
    model, pose = hand.model, hand.full_configuration(data["grasp_qpos"][7:])
    state = model.createData()
    pin.framesForwardKinematics(model, state, pose)
    tips = np.array([(root * state.oMf[frame.frame_id]).translation for frame in grasp.problem.frames])
    distance = grasp.problem.grasp_object.sample(tips).distance - grasp.problem.radii
    np.testing.assert_allclose(distance, grasp.contacts.gaps, atol=1e-9)


def test_pregrasp_opens_along_the_synergies(planned):
    opened = 0
    for grasp in planned[2]:
        angles, basis, hand = pregrasp_angles(grasp), grasp.problem.synergies.basis, grasp.problem.hand
        assert (angles >= hand.lower).all() and (angles <= hand.upper).all()
        gaps = replace(grasp, joint_angles=angles).contacts.gaps
        assert gaps.min() >= grasp.contacts.gaps.min()
        opened += gaps.min() >= 0.5 * PREGRASP_GAP
        free = (angles > hand.lower) & (angles < hand.upper)
        change = (angles - grasp.joint_angles)[free]
        left = change - basis[free] @ np.linalg.lstsq(basis[free], change, rcond=None)[0]
        np.testing.assert_allclose(left, 0.0, atol=1e-9)
    assert opened >= 1


def test_pregrasp_takes_the_first_synergy_alone_where_that_suffices(planned):
    grasp = planned[2][0]
    away = pin.SE3(grasp.palm_pose.rotation, grasp.palm_pose.translation + np.array([0.5, 0.0, 0.0]))
    free, hand = replace(grasp, palm_pose=away), grasp.problem.hand
    angles, first = pregrasp_angles(free), grasp.problem.synergies.basis[:, 0]
    inside = (angles > hand.lower) & (angles < hand.upper) & (np.abs(first) > 0.05)
    steps = (angles - grasp.joint_angles)[inside] / first[inside]
    assert inside.sum() > 3
    np.testing.assert_allclose(steps, steps[0], atol=1e-9)
    assert abs(steps[0]) > 1e-3


def test_rows_and_formats_that_do_not_exist(planned, tmp_path):
    with pytest.raises(ValueError, match="format: got 'xml'"):
        export_rows(planned[0], [0], tmp_path, "xml")
    with pytest.raises(ValueError, match="row: got 9"):
        export_rows(planned[0], [9], tmp_path, "json")
    (tmp_path / "file").touch()
    with pytest.raises(Exception, match="can't be written"):
        export_rows(planned[0], [0], tmp_path / "file", "json")


def test_report_is_one_page_that_needs_no_network(planned, tmp_path):
    folder, records, _ = planned
    path = write_report(folder, tmp_path / "page.html", pictures=1)
    text = path.read_text()
    assert text.count("<svg") >= 4 and text.count("data:image/png;base64,") == 1
    for link in ('src="http', "<link", "@import", "url(http"):
        assert link not in text
    run = read_run_info(folder).spec_hash[:16]
    for row in range(3):
        assert f"grasp-planner view {folder} --row {row}<" in text
        assert f'href="http://127.0.0.1:8080/?run={run}&amp;row={row}"' in text
    assert text.count('href="http') == text.count('href="http://127.0.0.1:8080/?run=')
    for word in ("Success", "Distributions", "Failures by reason", "Best grasps", "n_s", records[0].hand):
        assert word in text


def test_best_rows_take_one_of_each_group(planned):
    rows = load_table(planned[0]).to_pylist()
    best = best_rows(rows, 6)
    assert len(best) == sum(values["feasible"] for values in rows) <= 3


def test_report_escapes_what_it_shows(tmp_path):
    cases = [GraspCase(hand="<script>alert(1)</script>")]
    run_batch(cases, tmp_path, workers=1)
    text = write_report(tmp_path).read_text()
    assert "<script>alert" not in text and "&lt;script&gt;alert" in text
