"""The study of synergies: rows that go on, correlations, the page, mistakes."""

import math

import numpy as np
import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli import main
from grasp_planner.cli_options import parse_counts
from grasp_planner.synergy_study import (
    MARGINS,
    StudyRow,
    StudySettings,
    area_under_roc,
    joint_spring_stiffness,
    least_friction_share,
    rank_correlation,
    run_study,
    study_case,
)
from grasp_planner.synergy_study_page import count_rows, margin_rows, write_study


def made_up(weakest, margin, seed):
    return StudyRow("native", 3, seed, True, False, weakest > 1.0, 6, weakest, 1e-4, 0.01, {"F": margin})


def test_correlation_and_roc_of_known_rows():
    rows = [made_up(weakest, margin, k) for k, (weakest, margin) in enumerate([(0.5, 1.0), (0.9, 2.0), (1.5, 4.0)])]
    rows.append(StudyRow("native", 3, 9, False))
    rho, _, count = rank_correlation(rows, "F")
    assert (rho, count) == (pytest.approx(1.0), 3)
    assert area_under_roc(rows, "F") == 1.0
    turned = [made_up(row.weakest_force, -row.margins["F"], row.seed) for row in rows[:3]]
    assert rank_correlation(turned, "F")[0] == pytest.approx(-1.0)
    assert area_under_roc(turned, "F") == 0.0
    assert math.isnan(rank_correlation(rows, "no such")[0])


def test_margins_of_a_grasp(planned):
    share = least_friction_share(planned)
    assert -1e-5 < share < 1.0
    assert joint_spring_stiffness(planned) > 0.0
    assert all(np.isfinite(margin(planned)) for margin in MARGINS.values())


def test_a_study_goes_on_and_is_written(tmp_path):
    settings = StudySettings(counts=(15,), problems=2, contact_set="sphere", squeeze=2.0)
    first = next(run_study(settings, tmp_path))
    rows = list(run_study(settings, tmp_path))
    assert [row.seed for row in rows] == [0, 1]
    assert rows[0] == first
    assert rows[0] == study_case(settings, "native", 15, 0)
    assert len((tmp_path / "rows.jsonl").read_text(encoding="utf-8").splitlines()) == 2
    write_study(tmp_path, rows, settings)
    page = (tmp_path / "study.html").read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 2
    table = count_rows(rows, settings)
    assert table[0][:4] == ["native", "15", "2", str(sum(row.feasible for row in rows))]
    assert len(margin_rows(rows)) == len(MARGINS)
    with pytest.raises(gp.FileFormatError, match="other settings"):
        next(run_study(StudySettings(counts=(15,), problems=3), tmp_path))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--counts", "3-"], "counts"),
        (["--counts", "99"], "from 1 to"),
        (["--sets", "wind"], "wind"),
        (["--contact-set", "wind"], "wind"),
        (["--squeeze", "0"], "squeeze"),
        (["--problems", "0"], "problems"),
    ],
)
def test_mistakes_are_one_line(tmp_path, arguments, message):
    done = CliRunner().invoke(main, ["study-synergies", "--out", str(tmp_path / "study"), *arguments])
    assert done.exit_code == 2
    assert message in done.output
    assert "Traceback" not in done.output


def test_counts():
    assert parse_counts("counts", "1-3,15,2") == (1, 2, 3, 15)
