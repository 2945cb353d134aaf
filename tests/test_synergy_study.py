"""The study of synergies: rows that go on, margins, correlations, the page, mistakes."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.batch import load_table
from grasp_planner.batch.journal import journal_line
from grasp_planner.batch.run_files import part_files, read_run_info
from grasp_planner.cli.main import main
from grasp_planner.cli.options import parse_counts, parse_names
from grasp_planner.judge.margins import UNBOUNDED
from grasp_planner.simulate import Survival, find_protocol, simulate_grasp
from grasp_planner.simulate.off_plan import ROWS as ROW_NAMES
from grasp_planner.studies.study_margins import (
    CLOSING_MARGINS,
    MARGINS,
    grasp_as_simulated,
    joint_spring_stiffness,
    least_friction_share,
    least_push,
    static_margins,
)
from grasp_planner.studies.study_rows import StudyRow
from grasp_planner.studies.study_statistics import prediction, roc_curve
from grasp_planner.studies.survival_tables import (
    SURVIVAL_COLUMNS,
    certificate_rows,
    rank_correlation,
    survival_rows,
    survived_share,
)
from grasp_planner.studies.synergy_study import StudySettings, load_study, run_study, study_case
from grasp_planner.studies.synergy_study_page import count_rows, prediction_rows, rest_rows, settings_text, write_study
from grasp_planner.studies.synergy_study_plots import best_margins, feasible_share, median_load, passed_share
from tests.stored import stored


def made_up(weakest, margin, seed, **changes):
    row = StudyRow(
        "native", "sphere", 3, seed, True, False, weakest > 1.0, 6, weakest, True, 1e-4, 0.01, {"F [N]": margin}
    )
    return replace(row, **changes)


ROWS = [made_up(weakest, margin, k) for k, (weakest, margin) in enumerate([(0.5, 1.0), (0.9, 2.0), (1.5, 4.0)])]
LOST = made_up(0.0, 0.5, 3, rest_held=False, rest_displacement=9.0, normal_force_error=1.0, forces_held=0)
REFUSED = made_up(
    0.0, 3.0, 4, refused=True, weakest_force=None, rest_held=None, rest_displacement=None, normal_force_error=None
)
NONE = StudyRow("native", "sphere", 3, 9, False)


def test_prediction_of_known_rows():
    found = prediction([*ROWS, NONE, REFUSED], "F [N]")
    assert (found.rho, found.grasps, found.passed) == (pytest.approx(1.0), 3, 1)
    assert found.roc_area == 1.0
    turned = [replace(row, margins={"F [N]": -row.margins["F [N]"]}) for row in ROWS]
    assert prediction(turned, "F [N]").rho == pytest.approx(-1.0)
    assert prediction(turned, "F [N]").roc_area == 0.0
    assert math.isnan(prediction(ROWS, "no such").rho)


def test_where_all_pass_the_roc_is_undefined():
    passed = [made_up(2.0 + k, 1.0 + k, k) for k in range(4)]
    found = prediction(passed, "F [N]")
    assert found.rho == pytest.approx(1.0)
    assert math.isnan(found.roc_area)
    texts = {row[0]: row[1:] for row in prediction_rows(passed)}
    assert texts["F [N]"][-1] == "undefined"


def test_the_area_under_the_roc_is_that_of_its_curve(rng):
    rows = [made_up(weakest, margin, k) for k, (weakest, margin) in enumerate(rng.uniform(0.0, 2.0, (40, 2)))]
    rows += [replace(row, seed=row.seed + 40, weakest_force=2.0 - row.weakest_force) for row in rows[:5]]  # ties
    rows = [replace(row, passed=row.weakest_force > 1.0) for row in rows]
    false, true = roc_curve(rows, "F [N]")
    assert (false[0], true[0], false[-1], true[-1]) == (0.0, 0.0, 1.0, 1.0)
    assert (np.diff(false) >= 0.0).all()
    assert (np.diff(true) >= 0.0).all()
    # Ties count half, as the trapezoid does.
    assert np.trapezoid(true, false) == pytest.approx(prediction(rows, "F [N]").roc_area, abs=1e-12)


def test_tables_of_known_rows():
    settings = StudySettings(object_kinds=("sphere",), counts=(3,), problems=6)
    rows = [*ROWS, LOST, REFUSED, NONE]
    ((*counted, load, force),) = count_rows(rows, settings)
    assert counted == ["native", "sphere", "3", "6", "5", "83", "1", "1", "20"]
    assert (load, force) == ("0.70", "1.50"), "medians over the four that were simulated"
    ((*_, tested, moved, worst, close, error, worst_error, right),) = rest_rows(rows, settings)
    assert (tested, moved, worst, close) == ("4", "0.100", "lost", "75")
    assert (error, worst_error, right) == ("1.0 %", "lost", "75")
    assert (feasible_share(rows), passed_share(rows), median_load(rows)) == (5 / 6, 1 / 5, pytest.approx(0.7))
    assert math.isnan(feasible_share([]))


def survived(*counts):
    """Rows of survival, a pair of survived and tried for the first rows, one each for the others."""
    given = dict(zip(ROW_NAMES, counts, strict=False))
    return tuple(Survival(name, *given.get(name, (1, 1)), "") for name in ROW_NAMES)


def test_what_closing_survives_is_counted_by_row_and_hands_through_a_table_apart():
    settings = StudySettings(object_kinds=("sphere",), counts=(3,), problems=3, errors=2)
    rows = [
        replace(ROWS[0], survival=survived((1, 1), (1, 2))),
        replace(ROWS[1], survival=(*survived((0, 1), (2, 2))[:-1], Survival(ROW_NAMES[-1], 0, 0, "through it"))),
        NONE,
    ]
    ((*name, found, planned, palm, radius, _, _, _, _, table, untried),) = survival_rows(rows, settings)
    assert (name, found) == (["native", "sphere", "3"], "2")
    assert (planned, palm, radius, table, untried) == ("1/2", "3/4", "2/2", "1/1", "1")
    assert len(SURVIVAL_COLUMNS) == 4 + len(ROW_NAMES) + 1
    assert survived_share(rows[0]) == pytest.approx(8 / 9)
    assert survived_share(NONE) is None


def test_the_certificate_is_ranked_against_what_survives():
    name = next(iter(CLOSING_MARGINS))
    rows = [
        made_up(0.5 + k, 1.0, k, margins={name: float(k)}, survival=survived(*[(1, 1)] * k, *[(0, 1)] * (8 - k)))
        for k in range(9)
    ]
    cells = {row[0]: row[1:] for row in certificate_rows(rows)}[name]
    assert cells[:2] == ["9", "9"]
    assert [text[:5] for text in cells[2:4]] == ["+1.00", "+1.00"]
    assert cells[4:] == ["11 %", "1.00"]
    same = [replace(row, survival=survived()) for row in rows]
    cells = {row[0]: row[1:] for row in certificate_rows(same)}[name]
    assert cells[3:] == ["undefined", "100 %", "undefined"]
    assert certificate_rows([])[0][1] == "0"


def test_rank_correlation_gives_ties_their_mean_rank():
    assert rank_correlation([1.0, 2.0, 2.0, 3.0], [1.0, 2.0, 3.0, 4.0]).rho == pytest.approx(0.9487, abs=1e-4)
    assert rank_correlation([1.0, 1.0, 1.0], [1.0, 2.0, 3.0]).text == "undefined"


def test_a_grasp_that_does_not_rest_has_the_least_certificate(planned, monkeypatch):
    lost = replace(planned.closing, displacement=np.inf, torque_use=np.inf, pushes=np.full(6, np.inf))
    monkeypatch.setitem(planned.__dict__, "closing", lost)
    found = static_margins(planned)
    assert found["closing: holds"] == found["closing: pushes held"] == 0.0
    assert found["closing: least share of friction"] == found["closing: share of torque left"] == -UNBOUNDED
    assert found["closing: − motion at rest [m]"] == -UNBOUNDED


@pytest.mark.slow
def test_a_study_on_a_table_says_what_closing_survives_and_goes_on(tmp_path):
    arguments = ["--sets", "native_clear", "--counts", "8", "--objects", "box", "--clearance", "links", "--loads"]
    arguments += ["--protocol", "free", "--errors", "1", "--table", "--enough", "1", "--out", str(tmp_path / "study")]
    done = CliRunner().invoke(main, ["study-synergies", *arguments, "--problems", "1"])
    assert done.exit_code == 0, done.output
    (row,) = load_study(tmp_path / "study")
    assert row.feasible
    assert [each.name for each in row.survival] == list(ROW_NAMES)
    assert row.survival[-1].tried == 1
    page = (tmp_path / "study" / "study.md").read_text(encoding="utf-8")
    assert "## What closing survives" in page
    assert "objects on a table" in page
    other = CliRunner().invoke(main, ["study-synergies", *arguments[:-2], "--out", arguments[-1], "--errors", "2"])
    assert other.exit_code == 2
    assert "other settings (errors: 1 there, 2 asked for)" in other.output


def test_margins_of_a_grasp(planned):
    share = least_friction_share(planned)
    assert -1e-5 < share < 1.0
    assert joint_spring_stiffness(planned) > 0.0
    assert least_push(planned) >= planned.passive_margin.size
    found = static_margins(planned)
    assert set(found) == set(MARGINS)
    assert all(value is not None for value in found.values())
    assert found["passive, worst direction [N]"] == planned.margins.passive.size
    assert found["re-squeezed, along the task [N]"] == planned.margins.active_tasks[0].size
    assert found["re-squeezed, worst direction [N]"] > found["passive, worst direction [N]"]
    assert found["least stiffness, preload [N/m]"] == planned.stability.smallest


def test_margins_that_are_not_defined_or_not_bounded(planned, monkeypatch):
    motion = replace(planned.problem, n_synergies=6, tasks=(gp.twist_task([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]),))
    grasp = gp.Grasp(motion, planned.joint_angles, planned.palm_pose, np.full(6, 0.01))
    assert static_margins(grasp)["passive, along the task [N]"] is None
    stiff = replace(planned.problem, parameters=replace(planned.problem.parameters, contact_stiffness=0.0))
    grasp = gp.Grasp(stiff, planned.joint_angles, planned.palm_pose, planned.delta_sigma)
    assert static_margins(grasp)["passive, worst direction [N]"] is None
    monkeypatch.setitem(MARGINS, "endless", lambda _: math.inf)
    assert static_margins(planned)["endless"] == UNBOUNDED


def test_margins_are_those_of_what_is_simulated():
    grasp = stored("round_15")
    protocol = replace(find_protocol("dexgraspbench"), start="plan", geometry="contacts", rest_s=0.2, hold_s=0.2)
    tested = grasp_as_simulated(simulate_grasp(grasp, protocol, squeeze=2.0, ladder=False))
    assert tested.problem.parameters.friction == 0.6
    assert tested.problem.grasp_object.mass == 0.1
    np.testing.assert_array_equal(tested.problem.external_wrench, 0.0)
    np.testing.assert_array_equal(tested.delta_sigma, 2.0 * grasp.delta_sigma)
    same = grasp_as_simulated(simulate_grasp(grasp, replace(find_protocol("plan"), geometry="contacts"), ladder=False))
    np.testing.assert_array_equal(same.forces, grasp.forces)


QUICK = StudySettings(counts=(1,), clearance=True, cpu_limit_s=0.05, time_limit_s=None, problems=3)
"""Searches that end at once, without a grasp."""


def cut_last_line(folder):
    """Leave behind what a kill in the middle of a write does: rows in a journal, the last one cut off."""
    rows = load_table(folder).to_pylist()
    for path in part_files(folder):
        path.unlink()
    lines = [journal_line(row) for row in rows]
    (folder / "journal-000001.jsonl").write_bytes(b"".join(lines)[: -len(lines[-1]) // 2])


def test_a_study_goes_on_after_a_row_that_was_cut_off(tmp_path):
    first = run_study(QUICK, tmp_path)
    assert (first.done, first.resumed, first.interrupted) == (3, 0, False)
    rows = load_study(tmp_path)
    assert [row.key for row in rows] == list(QUICK.cases)
    cut_last_line(tmp_path)
    assert load_study(tmp_path) == rows[:2]
    again = run_study(QUICK, tmp_path)
    assert (again.done, again.resumed) == (3, 2)
    assert load_study(tmp_path) == rows


def test_a_study_grows_by_more_problems(tmp_path):
    run_study(replace(QUICK, problems=1), tmp_path)
    grown = run_study(replace(QUICK, problems=2), tmp_path)
    assert (grown.done, grown.resumed) == (2, 1)
    assert [row.seed for row in load_study(tmp_path)] == [0, 1]
    with pytest.raises(gp.FileFormatError, match="at least as many"):
        run_study(replace(QUICK, problems=1), tmp_path)


def test_a_case_without_an_answer_is_a_row_that_says_so(tmp_path):
    # The worker has no part in it: it looks for a kind of object that it does not know.
    settings = replace(QUICK, problems=1)
    object.__setattr__(settings, "object_kinds", ("wind",))
    assert run_study(settings, tmp_path).done == 1
    (row,) = load_study(tmp_path)
    assert not row.feasible
    assert "unknown kind of object 'wind'" in row.message


@pytest.mark.slow
def test_rows_do_not_depend_on_the_number_of_workers(tmp_path):
    shown = {"contact_set": "sphere", "loads": True, "enough": 1}
    settings = StudySettings(object_kinds=("cylinder", "sphere"), counts=(15,), problems=1, **shown)
    for workers in (1, 2):
        run_study(settings, tmp_path / str(workers), workers)
    one, two = (load_table(tmp_path / str(workers)) for workers in (1, 2))
    assert one.equals(two)
    assert any(one["passed"].to_pylist())


@pytest.mark.slow
def test_a_study_grows_and_is_written(tmp_path):
    settings = StudySettings(object_kinds=("cylinder",), counts=(15,), problems=1, contact_set="sphere", enough=1)
    run_study(settings, tmp_path)
    rows = load_study(tmp_path)
    assert [row.key for row in rows] == [("native", "cylinder", 15, 0)]
    assert rows[0] == study_case(settings, rows[0].key)
    more = replace(settings, problems=2)
    run_study(more, tmp_path, workers=2)
    grown = load_study(tmp_path)
    assert grown[:1] == rows
    assert [row.key for row in grown] == list(more.cases)
    assert all(row.normal_force_error < 0.1 and row.rest_displacement < 1e-3 for row in grown if row.rest_held)
    write_study(tmp_path, grown, more)
    page = (tmp_path / "study.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 3
    assert len(prediction_rows(grown)) == len(MARGINS)
    assert len(best_margins(grown)) <= 6
    with pytest.raises(gp.FileFormatError, match=r"other settings \(squeeze: 1.0 there, 2.0 asked for\)"):
        run_study(replace(more, squeeze=2.0), tmp_path)
    with pytest.raises(gp.FileFormatError, match="at least as many"):
        run_study(settings, tmp_path)


@pytest.mark.slow
def test_load_cases_hold_more(tmp_path):
    arguments = [
        "--sets",
        "native",
        "--counts",
        "15",
        "--objects",
        "sphere",
        "--problems",
        "2",
        "--contact-set",
        "sphere",
    ]
    arguments += ["--loads", "--friction-safety", "1.5", "--cpu-limit", "20", "--out", str(tmp_path / "study")]
    done = CliRunner().invoke(main, ["study-synergies", *arguments])
    assert done.exit_code == 0, done.output
    settings = json.loads(read_run_info(tmp_path / "study").spec)
    assert settings["loads"]
    assert settings["friction_safety"] == 1.5
    assert (settings["time_limit_s"], settings["cpu_limit_s"]) == (None, 20.0)
    for row in load_study(tmp_path / "study"):
        assert row.feasible
        assert row.margins["passive, six pushes [N]"] >= 1.0
        assert row.margins["least friction share"] >= 1.0 - 1.0 / 1.5 - 1e-6
        assert row.passed


def test_the_processor_time_of_a_search_is_limited():
    settings = StudySettings(counts=(1,), clearance=True, cpu_limit_s=0.2, time_limit_s=None)
    assert not study_case(settings, ("native", "cylinder", 1, 0)).feasible


def test_plans_of_the_paper_are_studied_too():
    settings = StudySettings(paper=True, joint_compliance=0.2)
    parameters = settings.problem(("native", "cylinder", 3, 0)).parameters
    assert parameters.weighted
    assert (parameters.force_law, parameters.joint_compliance) == ("controllable", 0.2)
    assert "the paper's force law" in settings_text(settings)


def test_a_study_says_how_hands_close_with_errors():
    settings = StudySettings(protocol="handed", errors=1, firmness=1.5)
    assert settings.test.firmness == settings.error_test.firmness == 1.5
    assert settings.error_test.carried == find_protocol("handed").carried
    assert "protocol handed, 1.5 times" in settings_text(settings)
    assert StudySettings(protocol="table", errors=1).error_test == find_protocol("table")
    floating = StudySettings(protocol="closing", errors=1)
    assert floating.error_test == find_protocol("free")
    assert floating.test.firmness == 1.0


@pytest.mark.parametrize("table", [False, True])
def test_joints_of_a_study_may_be_softer(table):
    settings = StudySettings(joint_compliance=0.5, loads=True, friction_safety=1.5, table=table)
    problem = settings.problem(("native", "cylinder", 3, 0))
    assert problem.parameters.joint_compliance == 0.5
    assert problem.loads.friction_safety == 1.5
    assert "0.5 rad/(N m)" in settings_text(settings)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--counts", "3-"], "counts"),
        (["--counts", "99"], "from 1 to"),
        (["--sets", "wind"], "wind"),
        (["--sets", ","], "sets"),
        (["--objects", "wind"], "unknown kind of object 'wind'"),
        (["--objects", ","], "objects"),
        (["--contact-set", "wind"], "wind"),
        (["--squeeze", "0"], "squeeze"),
        (["--firmness", "0.5"], "firmness"),
        (["--problems", "0"], "problems"),
        (["--cpu-limit", "0"], "cpu_limit"),
        (["--time-limit", "-1"], "time_limit"),
        (["--friction-safety", "0.5"], "friction_safety"),
        (["--errors", "-1"], "--errors"),
        (["--joint-compliance", "-1"], "joint_compliance"),
    ],
)
def test_mistakes_are_one_line(tmp_path, arguments, message):
    done = CliRunner().invoke(main, ["study-synergies", "--out", str(tmp_path / "study"), *arguments])
    assert done.exit_code == 2
    assert message in done.output
    assert "Traceback" not in done.output


@pytest.mark.parametrize("text", ["[]", "{", '{"problems": 20}'])
def test_the_folder_of_something_else_is_refused(tmp_path, text):
    (tmp_path / "run.json").write_text(text, encoding="utf-8")
    done = CliRunner().invoke(main, ["study-synergies", "--out", str(tmp_path)])
    assert done.exit_code == 2
    assert str(tmp_path) in done.output.replace("\n", "")
    assert "Traceback" not in done.output
    assert (tmp_path / "run.json").read_text(encoding="utf-8") == text


def test_lists():
    assert parse_counts("counts", "1-3,15,2") == (1, 2, 3, 15)
    assert parse_names("native, santello,,native") == ("native", "santello")
