"""The commands that analyse and improve a planned grasp."""

import json

import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli.main import main
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
    for word in ("margin, worst", "stable", "tolerance", "friction μ", "mass", "too few motors"):
        assert word in result.output
    record = AnalysisRecord.model_validate_json(output.read_text(encoding="utf-8"))
    assert len(record.tolerances) == 6
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
