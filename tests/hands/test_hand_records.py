"""Grasps of a hand whose files move, change or go: opened all the same, with one line that says so."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pinocchio as pin
import platformdirs
import pytest
import trimesh
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.batch import RunRows, load_grasps, load_row, parse_spec, run_batch
from grasp_planner.cli.main import main
from grasp_planner.records import hand_record
from grasp_planner.records.grasp_files import parse_grasp_record
from grasp_planner.records.grasp_record import grasp_record
from grasp_planner.records.hand_record import HandChangedWarning
from tests.hands.test_hand_check import three_fingers

MESH = '<collision><geometry><mesh filename="package://{}/meshes/block.stl"/></geometry></collision>'


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """A cache folder of the test's own."""
    monkeypatch.setattr(platformdirs, "user_cache_dir", lambda *_, **__: str(tmp_path / "cache"))


@pytest.fixture
def folder(tmp_path):
    """The right hand of the package as a hand of the user's: description in a folder of its own beside its URDF."""
    library = gp.hand_library()["dlr_hit_ii_right"].parent
    home = tmp_path / "mine"
    shutil.copytree(library / "synergies", home / "about" / "synergies")
    shutil.copy(library / "dlr_hit_ii_right.urdf", home / "robot.urdf")
    text = (library / "dlr_hit_ii_right.toml").read_text(encoding="utf-8")
    text = text.replace('urdf = "dlr_hit_ii_right.urdf"', 'urdf = "../robot.urdf"')
    (home / "about" / "mine.toml").write_text(text.replace("dlr_hit_ii_right", "mine"), encoding="utf-8")
    return home


def some_grasp(hand):
    problem = gp.GraspProblem.paper(hand, gp.Sphere())
    return gp.Grasp(problem, 0.5 * (hand.lower + hand.upper), pin.exp6(np.arange(6.0)), np.zeros(3))


def written(folder, path):
    """Return a grasp of the hand in a folder, and the file it is written to."""
    grasp = some_grasp(gp.load_hand(folder / "about" / "mine.toml"))
    path.write_text(gp.grasp_json(grasp), encoding="utf-8")
    return grasp, path


def opened(path):
    return gp.grasp_from_record(gp.read_grasp_record(path))


def test_a_hand_that_stays_is_loaded_from_where_it_is(folder, tmp_path):
    grasp, path = written(folder, tmp_path / "grasp.json")
    assert opened(path) == grasp


def test_a_hand_that_moved_is_rebuilt_from_the_file(folder, tmp_path):
    grasp, path = written(folder, tmp_path / "grasp.json")
    folder.rename(tmp_path / "elsewhere")
    with pytest.warns(HandChangedWarning, match=r"mine\.toml is gone; it is rebuilt") as caught:
        again = opened(path)
    assert len(caught) == 1 and "\n" not in str(caught[0].message)
    assert again.problem.hand.description == grasp.problem.hand.description
    np.testing.assert_array_equal(again.contacts.points, grasp.contacts.points)
    assert again == grasp
    assert grasp_record(again).hand_source == grasp_record(grasp).hand_source, "written again, it says the same"


def test_a_hand_that_changed_is_taken_as_it_is(folder, tmp_path):
    _, path = written(folder, tmp_path / "grasp.json")
    urdf = folder / "robot.urdf"
    urdf.write_text(urdf.read_text(encoding="utf-8") + "<!-- changed -->", encoding="utf-8")
    with pytest.warns(HandChangedWarning, match="is not what the grasp was planned with"):
        opened(path)


def test_a_synergy_set_that_changed_is_noticed(folder, tmp_path):
    _, path = written(folder, tmp_path / "grasp.json")
    notes = next((folder / "about" / "synergies").glob("*.csv"))
    notes.write_text("# note: another\n" + notes.read_text(encoding="utf-8"), encoding="utf-8")
    with pytest.warns(HandChangedWarning):
        opened(path)


@pytest.mark.filterwarnings("default")
def test_the_commands_open_it_and_take_another_hand(folder, tmp_path):
    _, path = written(folder, tmp_path / "grasp.json")
    moved = folder.rename(tmp_path / "elsewhere")
    page = tmp_path / "page.html"
    for command in (
        ["export", path, "--html", page],
        ["analyse", path, "--no-sensitivity"],
        ["simulate", path, "--no-ladder", "--geometry", "contacts"],
    ):
        found = CliRunner().invoke(main, list(map(str, command)))
        assert found.exit_code in (0, 3), found.output
        assert found.output.count("is gone; it is rebuilt") == 1
        found = CliRunner().invoke(main, [*map(str, command), "--hand", str(moved / "about" / "mine.toml")])
        assert found.exit_code in (0, 3), found.output
        assert "warning" not in found.output
    other = CliRunner().invoke(main, ["analyse", str(path), "--no-sensitivity", "--hand", "dlr_hit_ii_left"])
    assert "is not what the grasp was planned with" in other.output
    wrong = CliRunner().invoke(main, ["analyse", str(path), "--hand", "allegro_right"])
    assert wrong.exit_code == 2 and len(wrong.stderr.strip().splitlines()) <= 2


def test_hands_of_the_package_are_known_by_name_and_content(right, tmp_path):
    data = json.loads(gp.grasp_json(some_grasp(right)))
    assert data["hand_source"]["path"] is None and not data["hand_source"]["texts"]
    data["hand_source"]["sha256"] = 64 * "0"
    with pytest.warns(HandChangedWarning, match="the hand of the package"):
        gp.grasp_from_record(parse_grasp_record(json.dumps(data).encode(), "x"))


def with_mesh(folder):
    """Give the first finger's base a mesh."""
    mesh = folder / "meshes" / "block.stl"
    mesh.parent.mkdir()
    trimesh.creation.box((0.01, 0.01, 0.01)).export(mesh)
    urdf = folder / "robot.urdf"
    text = urdf.read_text(encoding="utf-8")
    urdf.write_text(text.replace("</link>", MESH.format(folder.name) + "</link>", 1), encoding="utf-8")
    return mesh


def test_meshes_stay_where_they_are(folder, tmp_path):
    """They are not in the file: a hand whose description is gone is rebuilt with the meshes that are still there."""
    mesh = with_mesh(folder)
    grasp, path = written(folder, tmp_path / "grasp.json")
    shutil.rmtree(folder / "about")
    with pytest.warns(HandChangedWarning, match="rebuilt"):
        again = opened(path)
    assert len(again.problem.hand.collision_model.geometryObjects) == len(
        grasp.problem.hand.collision_model.geometryObjects
    )
    mesh.write_bytes(mesh.read_bytes() + b" ")
    with pytest.raises(gp.FileFormatError, match=r"block\.stl.*gone or changed"):
        opened(path)


def test_a_changed_mesh_is_noticed(folder, tmp_path):
    mesh = with_mesh(folder)
    _, path = written(folder, tmp_path / "grasp.json")
    trimesh.creation.box((0.02, 0.01, 0.01)).export(mesh)
    with pytest.warns(HandChangedWarning, match="is not what"):
        opened(path)


@pytest.mark.parametrize(
    "change",
    [
        {"texts": {}},
        {"texts": {"/etc/mine.toml": "x"}},
        {"texts": {"mine.toml": "not = toml ="}},
        {"texts": {"/".join([".."] * 20) + "/mine.toml": "x"}},
        {"sha256": "../../.."},
    ],
)
def test_what_can_not_be_rebuilt_is_one_line(folder, tmp_path, change):
    _, path = written(folder, tmp_path / "grasp.json")
    data = json.loads(path.read_text(encoding="utf-8"))
    data["hand_source"] |= {"path": str(tmp_path / "gone.toml")} | change
    with pytest.raises(gp.FileFormatError, match="gone") as caught:
        gp.grasp_from_record(parse_grasp_record(json.dumps(data).encode(), "x"))
    assert "\n" not in str(caught.value)
    outside = [place for place in tmp_path.rglob("mine.toml") if place.parent != folder / "about"]
    assert all((tmp_path / "cache") in place.parents for place in outside)


def test_a_plain_urdf_that_moved_is_rebuilt_with_what_was_locked(tmp_path):
    """Its description is derived anew from the text in the file."""
    urdf = tmp_path / "mine" / "my_hand.urdf"
    urdf.parent.mkdir()
    urdf.write_text(three_fingers(), encoding="utf-8")
    hand = gp.load_hand(urdf, {"c_joint1": 0.2})
    n_q = hand.n_joints
    motors = gp.SynergySpace(hand.joint_names, np.zeros(n_q), np.eye(n_q))
    problem = gp.GraspProblem.paper(hand, gp.Sphere(), synergy_space=motors)
    grasp = gp.Grasp(problem, 0.5 * (hand.lower + hand.upper), pin.exp6(np.arange(6.0)), np.zeros(problem.n_synergies))
    path = tmp_path / "grasp.json"
    path.write_text(gp.grasp_json(grasp), encoding="utf-8")
    assert opened(path) == grasp
    urdf.parent.rename(tmp_path / "elsewhere")
    with pytest.warns(HandChangedWarning, match="rebuilt"):
        again = opened(path)
    assert "c_joint1" not in again.problem.hand.joint_names and again.problem.hand.n_joints == n_q
    assert again == grasp


def test_long_texts_are_left_out(folder, tmp_path, monkeypatch):
    monkeypatch.setattr("grasp_planner.hand.source.MAX_KEPT_CHARACTERS", 1000)
    _, path = written(folder, tmp_path / "grasp.json")
    assert json.loads(path.read_text(encoding="utf-8"))["hand_source"]["texts"] == {}
    assert hand_record.hand_source_record(gp.load_hand(folder / "about" / "mine.toml")).sha256


def test_a_run_opens_with_the_hand_that_is_named(folder, tmp_path):
    """Its rows have the hash of the hand, and no texts."""
    name = str(folder / "about" / "mine.toml")
    defaults = {"paper": True, "hand": name, "starts": 3, "enough": 1, "n_synergies": 15}
    run = tmp_path / "run"
    run_batch(parse_spec({"defaults": defaults, "blocks": [{"product": {"seed": [0]}}]}), run, workers=1)
    source = load_row(run, 0).hand_source
    assert source.path == name and source.sha256 and not source.texts
    moved = str(folder.rename(tmp_path / "elsewhere") / "about" / "mine.toml")
    with pytest.raises(gp.FileFormatError, match=r"mine\.toml"):
        load_grasps(run, [0])
    assert load_grasps(run, [0], hand=moved)[0].feasible
    assert RunRows(run, hand=moved).grasp()[0].feasible
    found = CliRunner().invoke(main, ["report", str(run), "--hand", moved])
    assert found.exit_code == 0, found.output
    assert "can't be drawn" not in (run / "report.html").read_text(encoding="utf-8")
