"""The commands that analyse and improve a planned grasp."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.analysis import contact_set
from grasp_planner.cli.main import main
from grasp_planner.drawing.measures_picture import measures_figure
from grasp_planner.model import quasi_static_maps
from grasp_planner.records.analysis_record import AnalysisRecord


def run(*arguments):
    return CliRunner().invoke(main, list(arguments))


@pytest.fixture(scope="module")
def file(planned, tmp_path_factory):
    path = tmp_path_factory.mktemp("grasp") / "grasp.json"
    path.write_text(gp.grasp_json(planned), encoding="utf-8")
    return path


def test_analyse_prints_and_writes_margins_stability_tolerance_and_sensitivities(file, tmp_path):
    output = tmp_path / "analysis.json"
    result = run("analyse", str(file), "--json", str(output))
    assert result.exit_code == 0, result.output
    for word in ("margin, worst", "stable", "first slip, object clamped", "friction μ", "mass", "too few motors"):
        assert word in result.output
    record = AnalysisRecord.model_validate_json(output.read_text(encoding="utf-8"))
    assert len(record.tolerances) == 6
    assert {each.question for each in record.tolerances} == {"first slip, object clamped"}
    by_name = {entry.parameter: entry for entry in record.post_optimality.sensitivities}
    assert by_name["mass"].d_force_norm > 0.0
    assert by_name["object x (palm held)"].d_force_norm is None


def test_analyse_without_sensitivities_on_standard_output_is_nothing_but_json(file):
    result = CliRunner().invoke(main, ["analyse", str(file), "--no-sensitivity", "--json", "-"])
    assert result.exit_code == 0
    assert json.loads(result.stdout)["post_optimality"] is None


@pytest.mark.slow
def test_improve_writes_a_better_grasp(file, tmp_path):
    output = tmp_path / "better.json"
    result = run("improve", str(file), "--budget", "1.0", "--trials", "3", "--out", str(output))
    assert result.exit_code == 0, result.output
    before = gp.grasp_from_record(gp.read_grasp_record(file))
    after = gp.grasp_from_record(gp.read_grasp_record(output))
    assert after.feasible
    assert after.margins.passive.size > before.margins.passive.size
    assert "F grows by" in result.output


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["analyse", "/no/such/grasp.json"], "grasp.json"),
        (["improve", "/no/such/grasp.json"], "grasp.json"),
        (["improve", "FILE", "--budget", "-1"], "budget"),
    ],
)
def test_wrong_use_is_one_clear_line(file, arguments, part):
    result = run(*[str(file) if word == "FILE" else word for word in arguments])
    assert result.exit_code == 2
    assert part in result.output.strip().splitlines()[-1]


def test_analyse_compares_two_grasps_in_every_measure_and_draws(file, tmp_path):
    picture, output = tmp_path / "slices.png", tmp_path / "analysis.json"
    options = ["--no-sensitivity", "--all", "--compare", str(file), "--picture", str(picture), "--json", str(output)]
    result = run("analyse", str(file), *options)
    assert result.exit_code == 0, result.output
    for group in ("wrenches it can exert", "forces", "what motors can do", "stiffness and robustness", "polygon"):
        assert group in result.output
    assert picture.read_bytes().startswith(b"\x89PNG")
    found = {entry.name: entry for entry in AnalysisRecord.model_validate_json(output.read_text()).measures}
    grasp = gp.grasp_from_record(gp.read_grasp_record(file))
    assert found["force-closure margin"].value == pytest.approx(grasp.force_closure_margin)
    assert found["norm of the forces"].value == pytest.approx(np.linalg.norm(grasp.forces))
    assert found["least friction to spare"].value == pytest.approx(grasp.friction_margins.min())
    assert found["imbalance"].value < 1e-9
    assert found["V"].value > 0.0
    away = np.sqrt(np.mean((grasp.joint_angles - grasp.problem.synergies.mean) ** 2))
    assert found["distance from the mean"].value == pytest.approx(np.degrees(away))
    assert 0.0 < found["joints off the middle"].value < 1.0


def test_the_picture_shows_stiffness_and_reach_where_springs_hold_the_object(planned):
    contacts = contact_set(planned)
    figure = measures_figure(contacts)
    assert len(figure.axes) == 12
    assert [axes.name for axes in figure.axes[9:]] == ["3d"] * 3
    assert all(axes.collections for axes in figure.axes[9:]), "every ellipsoid is drawn"
    moved = quasi_static_maps(contacts.springs).commands.object_motion
    x, y = figure.axes[6].lines[0].get_data()
    assert x.max() == pytest.approx(1e3 * np.linalg.norm(moved[0]), rel=1e-2)
    assert y.max() == pytest.approx(1e3 * np.linalg.norm(moved[1]), rel=1e-2)
    assert len(measures_figure(replace(contacts, springs=None)).axes) == 3


CONTACTS = {
    "points": [[0.03, 0, 0], [-0.015, 0.026, 0], [-0.015, -0.026, 0.005]],
    "normals": [[-1, 0, 0], [0.5, -0.8660254037844386, 0], [0.5, 0.8660254037844386, 0]],
    "friction": 0.7,
    "forces": [[-3, 0, 0.5], [1.5, -2.6, 0.5], [1.5, 2.6, 0.5]],
}


def test_analyse_takes_contacts_from_elsewhere(tmp_path):
    path, hand = tmp_path / "contacts.json", np.eye(9).tolist()
    path.write_text(json.dumps(CONTACTS))
    plain = run("analyse", str(path), "--all")
    assert plain.exit_code == 0, plain.output
    assert "what motors can do" not in plain.output
    path.write_text(json.dumps(CONTACTS | {"J": hand, "contact_stiffness": 1000.0, "joint_stiffness": [500.0] * 9}))
    result = CliRunner().invoke(main, ["analyse", str(path), "--all", "--json", "-"])
    assert result.exit_code == 0, result.output
    found = {entry["name"]: entry["value"] for entry in json.loads(result.stdout)["measures"]}
    # Springs of 1000 and 500 N/m in series at three points: a thousand N/m against any shift through their centre.
    assert found["stiffest shift"] == pytest.approx(1000.0, rel=1e-6)
    assert found["internal forces commanded"] == 3


@pytest.mark.parametrize("size", [0.0, 1e-300])
@pytest.mark.parametrize("name", ["J", "S"])
def test_analyse_takes_hands_that_move_nothing(tmp_path, name, size):
    path = tmp_path / "contacts.json"
    hand = {"J": np.eye(9).tolist(), "S": np.eye(9).tolist(), name: (size * np.eye(9)).tolist()}
    path.write_text(json.dumps(CONTACTS | hand | {"contact_stiffness": 1000.0, "joint_stiffness": 500.0}))
    result = CliRunner().invoke(main, ["analyse", str(path), "--all", "--json", "-"])
    assert result.exit_code == 0, result.output
    names = {entry["name"] for entry in json.loads(result.stdout)["measures"]}
    assert "σ_min(H)" in names and "motor force per newton" not in names


def test_analyse_takes_soft_fingers_from_elsewhere(tmp_path):
    path = tmp_path / "contacts.json"
    soft = {
        "contact_model": "soft:torsion=0.004",
        "forces": [[-3, 0, 0.5, 0.1], [1.5, -2.6, 0.5, 0], [1.5, 2.6, 0.5, 0]],
    }
    path.write_text(json.dumps(CONTACTS | soft))
    result = run("analyse", str(path))
    assert result.exit_code == 0, result.output
    assert "least friction to spare" in result.output


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({"normals": [[1, 0, 0]]}, "normals"),
        ({"normals": [[2, 0, 0]] * 3}, "length 1"),
        ({"friction": -1}, "friction"),
        ({"friction": 1e-300}, "friction"),
        ({"points": [[1e308, 0, 0]] * 3}, "points"),
        ({"points": [[0.01, 0, 0]] * 3, "centre": [0.01, 0, 0]}, "not all at the centre"),
        ({"centre": [0, 0, 1e300]}, "centre"),
        ({"forces": [[1e308, 0, 0]] * 3}, "forces"),
        ({"wrench": [0, 0, 0, 0, 0, 1e200]}, "wrench"),
        ({"J": [[1.0], [2.0, 3.0]]}, "J"),
        ({"J": np.eye(9).tolist()}, "contact_stiffness"),
        ({"J": np.eye(8).tolist(), "contact_stiffness": 1.0}, "J"),
        ({"J": np.eye(9).tolist(), "joint_stiffness": -5.0}, "joint_stiffness"),
        ({"mass": 3}, "mass"),
        ({"contact_model": "wet"}, "contact_model"),
        ({"contact_model": "soft"}, "forces"),
        ({"points": [[0, 0, "far"]] * 3}, "points"),
    ],
)
def test_bad_contact_files_are_refused_in_one_line(tmp_path, change, part):
    path = tmp_path / "contacts.json"
    path.write_text(json.dumps(CONTACTS | change))
    result = run("analyse", str(path))
    assert result.exit_code == 2
    assert part in result.output
    assert len(result.output.strip().splitlines()) <= 2
