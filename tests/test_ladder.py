"""The ladder of the verdict: what is true of a grasp, from the model up to errors of the palm."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.analysis import ladder
from grasp_planner.spatial import Pose

from .stored import stored


@pytest.fixture(scope="module")
def grasp():
    return stored("clear")


@pytest.fixture(scope="module")
def rungs(grasp):
    return ladder.verdict_ladder(grasp)


def test_the_rungs_say_what_is_true_of_a_default_grasp(grasp, rungs):
    assert tuple(rung.name for rung in rungs) == ladder.RUNGS
    assert [rung.met for rung in rungs[:4]] == [True] * 4
    assert f"{grasp.passive_margin.size:.2f} N" in rungs[2].text
    assert grasp.closing.text.endswith(rungs[3].text)
    held = sum(report.holds for report in ladder.palm_errors(grasp))
    assert f"holds in {held} of 6 directions" in rungs[4].text
    assert rungs[4].met == (held == 6)
    assert ladder.height(rungs) == 4 + rungs[4].met


def test_a_plain_problem_says_what_it_leaves_out_and_what_that_costs():
    rungs = ladder.verdict_ladder(stored("paper"))
    assert rungs[0].met
    assert "leaves out clearances and disturbances" in rungs[0].text
    assert rungs[1].met is False
    assert "mm inside" in rungs[1].text
    assert ladder.height(rungs) == 1


def test_what_does_not_meet_the_model_stands_on_no_rung(grasp):
    away = Pose(grasp.palm_pose.rotation, grasp.palm_pose.translation + np.array([0.0, 0.01, 0.01]))
    rungs = ladder.verdict_ladder(replace(grasp, palm_pose=away))
    assert rungs[0].met is False
    assert "surface" in rungs[0].text
    assert [rung.met for rung in rungs[2:]] == [None] * 3
    assert ladder.height(rungs) == 0


def test_a_push_is_held_if_it_is_as_large_as_asked(grasp):
    plain = replace(grasp, problem=replace(grasp.problem, loads=gp.LoadCases.off()))
    assert ladder.holds_rung(plain).met == (plain.passive_margin.size >= 0.8)
    assert ladder.holds_rung(plain).text.endswith("; 0.8 N wanted")
    assert "0.8 N wanted (1 N asked along sampled directions)" in ladder.holds_rung(grasp).text


@pytest.mark.parametrize("asked", [1.0, 0.333, 2.5])
@pytest.mark.parametrize("share", [0.5, 0.79, 0.79999, 0.8, 0.80001, 0.99, 1.2])
def test_the_push_printed_reaches_what_is_wanted_just_where_the_rung_is_met(asked, share):
    margin = SimpleNamespace(size=share * asked)
    loads = SimpleNamespace(force=asked)
    rung = ladder.holds_rung(
        SimpleNamespace(feasible=True, passive_margin=margin, problem=SimpleNamespace(loads=loads))
    )
    held, wanted = (float(number) for number in re.findall(r"([\d.]+) N", rung.text)[:2])
    assert (held >= wanted) == rung.met == (share >= 0.8), rung.text


def test_the_palm_is_off_by_what_is_said_to_both_sides(grasp, monkeypatch):
    seen = []
    monkeypatch.setattr(ladder, "close_grasps", lambda off, path, **_: [seen.append((each, path)) for each in off])
    ladder.palm_errors(grasp, 0.003)
    shifts = np.array([moved.palm_pose.translation - grasp.palm_pose.translation for moved, _ in seen])
    np.testing.assert_allclose(np.linalg.norm(shifts, axis=1), 0.003)
    np.testing.assert_allclose(shifts.sum(axis=0), 0.0, atol=1e-15)
    for _, path in seen:
        np.testing.assert_allclose(path.squeezing, grasp.sigma, err_msg="the references are those of the plan")
