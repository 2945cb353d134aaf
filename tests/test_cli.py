"""The command line from end to end, and every wrong use of it."""

import json
import subprocess
import sys
import warnings

import pytest
import trimesh
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli.main import main
from grasp_planner.problem.size_check import ObjectSizeWarning


def run(*arguments):
    return CliRunner().invoke(main, list(arguments))


def test_the_default_plan_is_the_papers_object_with_load_cases_and_is_feasible(tmp_path):
    output, picture = tmp_path / "grasp.json", tmp_path / "grasp.png"
    result = run("plan", "--json", str(output), "--picture", str(picture))
    assert result.exit_code == 0, result.output
    record = gp.read_grasp_record(output)
    assert record.feasible
    assert record.n_synergies == 3
    assert record.parameters.loads.force == 1.0
    assert record.margins.passive.size > 0.9
    assert record.stability.stable
    assert record.object.startswith("cylinder:radius=0.03,height=0.15,mass=0.2")
    assert record.task[0].direction == (0, 1, 0, 0, 0, 0)
    assert gp.grasp_from_record(record).feasible, "the file alone proves the grasp"
    assert picture.read_bytes().startswith(b"\x89PNG")
    for word in ("feasible", "floor", "thumb", "little_pip", "surface"):
        assert word in result.output


def test_the_papers_problem_is_a_switch_and_single_options_add_to_it(tmp_path):
    output = tmp_path / "grasp.json"
    problem = ["plan", "--paper", "--synergies", "15", "--enough", "1", "--quiet", "--json", str(output)]
    assert run(*problem).exit_code == 0
    grasp = gp.grasp_from_record(gp.read_grasp_record(output))
    assert not grasp.problem.loads.active
    assert not grasp.problem.clearance.needs_geometry
    assert not grasp.problem.clearance.remark1
    assert grasp.margins.passive.size < 0.1
    added = run(*problem, "--hand-limits", "--load-force", "0.5", "--load-wrench", "0,0,-1", "--friction-safety", "1.5")
    assert added.exit_code == 0, added.output
    grasp = gp.grasp_from_record(gp.read_grasp_record(output))
    wanted = gp.LoadCases(force=0.5, wrenches=((0, 0, -1, 0, 0, 0),), friction_safety=1.5, min_normal_force=0.0)
    assert grasp.problem.loads == wanted
    assert grasp.feasible
    assert grasp.margins.passive.size > 0.5


def test_json_on_standard_output_is_nothing_but_json():
    finished = subprocess.run(
        [sys.executable, "-m", "grasp_planner", "plan", "--synergies", "15", "--enough", "1", "--json", "-"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert finished.returncode == 0, finished.stderr
    assert json.loads(finished.stdout)["feasible"] is True
    assert "feasible" in finished.stderr


def test_no_feasible_grasp_is_exit_code_three_with_the_reasons():
    problem = ["--object", "cylinder:radius=0.3", "--friction", "0.05", "--synergies", "1"]
    result = run("plan", *problem, "--starts", "2", "--no-explain")
    assert result.exit_code == 3
    assert "infeasible: " in result.output


def test_quiet_prints_nothing():
    result = run("plan", "--synergies", "15", "--enough", "1", "--quiet")
    assert (result.exit_code, result.output) == (0, "")


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["--hand", "nobody"], ["hand", "dlr_hit_ii_right"]),
        (["--hand", "nobody.toml"], ["nobody.toml"]),
        (["--object", "cube:edge=1"], ["object", "sphere"]),
        (["--object", "cylinder:radius=-1"], ["radius", "> 0"]),
        (["--object", "cylinder:radius=nan"], ["radius"]),
        (["--object", "cylinder:radius"], ["key=value"]),
        (["--object", "cylinder:mass=0"], ["mass"]),
        (["--object", "cylinder:mass=x"], ["mass", "number"]),
        (["--object", "cylinder:size=1"], ["size", "radius"]),
        (["--task", "force:0,0,0"], ["direction", "zero"]),
        (["--task", "push:+y"], ["push", "force"]),
        (["--task", "twist:+y", "--synergies", "3"], ["n_synergies", "6"]),
        (["--synergies", "0"], ["n_synergies", "1 to 15"]),
        (["--synergies", "99"], ["n_synergies", "1 to 15"]),
        (["--synergies", "three"], ["--synergies"]),
        (["--synergy-set", "nobody"], ["synergy set", "native"]),
        (["--contact-set", "nobody"], ["contact set", "point"]),
        (["--friction", "-0.1"], ["friction", "> 0"]),
        (["--friction", "nan"], ["friction"]),
        (["--joint-compliance", "-1"], ["joint_compliance", ">= 0"]),
        (["--structural-compliance", "0"], ["structural_compliance", "> 0"]),
        (["--contact-stiffness", "-1"], ["contact_stiffness"]),
        (["--gravity", "1,2"], ["gravity", "(3,)"]),
        (["--force-weight", "-1"], ["force_weight"]),
        (["--force-weight", "0", "--task-weight", "0"], ["force_weight"]),
        (["--load-force", "-1"], ["loads.force", ">= 0"]),
        (["--load-wrench", "1,2"], ["wrench", "fx,fy,fz"]),
        (["--friction-safety", "0.9"], ["loads.friction_safety", ">= 1"]),
        (["--max-normal-force", "0.01"], ["max_normal_force"]),
        (["--starts", "0"], ["starts", ">= 1"]),
        (["--time-limit", "0"], ["time_limit_s"]),
        (["--json", "/no/such/folder/x.json"], ["x.json", "folder"]),
        (["--torque-model", "other"], ["total"]),
        (["--no-such-option"], ["--no-such-option"]),
    ],
)
def test_wrong_use_is_one_clear_line_and_exit_code_two(arguments, parts):
    result = run("plan", *arguments)
    assert result.exit_code == 2
    assert result.exception is None or isinstance(result.exception, SystemExit), "no traceback"
    last = result.output.strip().splitlines()[-1]
    for part in parts:
        assert part in last


def test_a_malformed_hand_file_is_one_clear_line(tmp_path):
    path = tmp_path / "hand.toml"
    path.write_text("name = 3")
    result = run("plan", "--hand", str(path))
    assert result.exit_code == 2
    assert result.output.startswith("grasp-planner: error: ")
    assert len(result.output.strip().splitlines()) == 1


def test_bench_measures_and_writes_json(tmp_path):
    path = tmp_path / "bench.json"
    result = run("bench", "--problems", "1", "--synergies", "3,15", "--clearance", "links", "--json", str(path))
    assert result.exit_code == 0, result.output
    report = json.loads(path.read_text())
    assert {(row["n_synergies"], row["clearance"]) for row in report["evaluation"]} == {
        (n_s, clearance) for n_s in (3, 15) for clearance in (False, True)
    }
    assert [row["case"]["n_synergies"] for row in report["problems"]] == [3, 15]
    assert [row["n_synergies"] for row in report["summary"]] == [3, 15]
    for row in report["evaluation"]:
        assert row["ratio"] == pytest.approx(row["median_ms"] / row["kinematics_ms"])


def test_bench_without_a_grasp_has_no_medians():
    result = run("bench", "--problems", "1", "--synergies", "1", "--objects", "box", "--cpu-limit", "0.01")
    assert result.exit_code == 0 and "0/1" in result.output
    assert "nan" not in result.output


def test_bench_refuses_nonsense():
    for option, value in (("problems", "0"), ("synergies", "3,x"), ("objects", "teapot"), ("cpu-limit", "0")):
        result = run("bench", f"--{option}", value)
        assert result.exit_code == 2
        assert value.split(",")[-1] in result.output


BATCH_WORDS, STUDY_WORDS = ["batch", "spec.yaml", "--dry-run"], ["study-synergies", "--out", "study"]


@pytest.mark.parametrize(
    ("missing", "words"), [("pyarrow", BATCH_WORDS), ("yaml", BATCH_WORDS), ("pyarrow", STUDY_WORDS)]
)
def test_without_the_extra_batch_planning_says_what_to_install(missing, words, tmp_path):
    (tmp_path / "spec.yaml").write_text("blocks: [{fixed: {seed: 1}}]")
    code = f"import sys; sys.modules[{missing!r}] = None; from grasp_planner.cli.main import main; main({words})"
    finished = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert finished.returncode == 2
    (line,) = finished.stderr.strip().splitlines()
    assert "scripts/setup batch" in line


WARNED = [
    ("cylinder:radius=30,height=150", "far too large for hand dlr_hit_ii_right", "are these millimetres? Times 0.001"),
    ("sphere:radius=0.00003", "far too small for hand dlr_hit_ii_right", "are these metres? Times 1000"),
    ("mesh:{folder}/box.stl", "is no size for a hand", "in millimetres, scale=0.001 would fit"),
]


@pytest.mark.parametrize(("text", "what", "guess"), WARNED)
def test_wrong_units_are_one_warning_with_a_guess(tmp_path, text, what, guess):
    """An object 1000 times too large or too small: planned all the same, and the guess is printed once."""
    trimesh.creation.box((50.0, 60.0, 80.0)).export(tmp_path / "box.stl")
    thing = text.format(folder=tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        result = run("plan", "--object", thing, "--quiet", "--starts", "1", "--max-iterations", "1", "--no-explain")
    assert result.exit_code == 3
    (line,) = result.stderr.splitlines()
    assert line.startswith("grasp-planner: warning: ") and what in line and guess in line


def test_an_object_of_fitting_size_is_no_warning():
    for text in ("sphere:radius=0.03", "box:x=0.02,y=0.4,z=0.4", "capsule:radius=0.004,height=0.02"):
        gp.GraspProblem.paper(gp.load_hand(), gp.parse_object(text))
    with pytest.warns(ObjectSizeWarning, match="centimetres"):
        gp.GraspProblem.paper(gp.load_hand("allegro_right"), gp.Sphere(radius=3.0))
