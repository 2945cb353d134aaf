"""The last step of a default search: joints come off their stops, where force and task allow it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.analysis.sensitivity import optimum_near
from grasp_planner.planning import off_stops as step
from grasp_planner.planning import planner, ranking
from grasp_planner.planning.program import joint_bounds

from .stored import stored

TWO = math.radians(2.0)


def room(grasp: gp.Grasp) -> np.ndarray:
    """How far every joint is from its nearer stop [rad]."""
    hand = grasp.problem.hand
    return np.minimum(grasp.joint_angles - hand.lower, hand.upper - grasp.joint_angles)


@pytest.fixture(scope="module")
def found(right):
    """A default plan as the starts end, and what the search makes of it at last."""
    problem = gp.GraspProblem(right, gp.Capsule(radius=0.025, height=0.1), n_synergies=8)
    kept: list[gp.Grasp] = []

    def noted(grasp, most_force, check, *, closing):
        kept.append(grasp)
        return step.off_stops(grasp, most_force, check, closing=closing)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(planner, "off_stops", noted)
        moved = gp.plan_grasp(problem, options=gp.PlannerOptions(starts=4, enough=1))
    return kept[0], moved


def test_joints_come_off_their_stops_at_the_same_force_and_nearly_the_same_task(found):
    plain, moved = found
    assert room(plain).min() < TWO
    assert moved.feasible
    assert room(moved).min() > TWO
    assert moved.force_norm <= 1.5 * moved.search.least_force * (1 + step.MORE_FORCE)
    assert moved.alignments[0][0] <= plain.alignments[0][0] + ranking.MORE_ANGLE_DEG
    assert moved.objective <= step.MORE_COST * plain.objective
    assert moved.search.least_force is not None


def nothing() -> None:
    """Never stop."""


@pytest.mark.parametrize(("where", "name", "most"), [(step, "MORE_COST", 0.9), (ranking, "MORE_ANGLE_DEG", -180.0)])
def test_a_task_that_would_suffer_keeps_the_grasp(found, monkeypatch, where, name, most):
    plain, _ = found
    monkeypatch.setattr(where, name, most)
    assert step.off_stops(plain, plain.force_norm, nothing, closing=False) is plain


def test_a_hand_that_would_close_no_more_keeps_the_grasp(found, monkeypatch):
    plain, _ = found

    class Closing:
        def __init__(self, grasp):
            self.holds = self.holds_free = room(grasp).min() < TWO
            self.slip = np.zeros(5)

    monkeypatch.setattr(gp.Grasp, "closing", property(Closing))
    assert step.off_stops(plain, plain.force_norm, nothing, closing=True) is plain
    assert step.off_stops(plain, plain.force_norm, nothing, closing=False) is not plain


def test_less_force_is_never_given_up_for_it(found):
    plain, _ = found
    moved = step.off_stops(plain, 10.0 * plain.force_norm, nothing, closing=False)
    assert moved.force_norm <= 10.0 * plain.force_norm
    stayed = step.off_stops(plain, 0.0, nothing, closing=False)
    assert stayed.force_norm <= plain.force_norm * (1 + step.MORE_FORCE)


def test_the_optimum_near_such_a_grasp_keeps_its_reserve(found):
    _, moved = found
    assert step.kept_reserve(moved) == step.STOP_RESERVE
    near = optimum_near(moved)
    assert room(near).min() > TWO
    assert near.force_norm == pytest.approx(moved.force_norm, rel=1e-3)


def test_weights_and_grasps_on_stops_keep_no_reserve(found):
    assert step.kept_reserve(found[0]) == 0.0
    assert step.kept_reserve(stored("paper")) == 0.0
    weighted = replace(found[1].problem, parameters=gp.GraspParameters(force_weight=1e-4))
    assert step.kept_reserve(replace(found[1], problem=weighted)) == 0.0


def test_a_search_that_is_cancelled_there_keeps_what_it_found(right, monkeypatch):
    problem, asked = gp.GraspProblem(right, gp.Sphere(radius=0.035), n_synergies=8), []

    def interrupted(grasp, most_force, check, *, closing):
        asked.append(grasp)
        check()
        raise AssertionError("the check ends it")

    monkeypatch.setattr(planner, "off_stops", interrupted)
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(starts=2, enough=1), cancel=lambda: bool(asked))
    assert grasp.feasible
    assert grasp.search.cancelled


def test_a_reserve_takes_at_most_a_tenth_of_a_range_at_either_end(right):
    hand = right
    lower, upper = joint_bounds(hand, 10.0)
    np.testing.assert_allclose(lower - hand.lower, 0.1 * (hand.upper - hand.lower))
    np.testing.assert_allclose(hand.upper - upper, 0.1 * (hand.upper - hand.lower))
    lower, upper = joint_bounds(hand, 0.01)
    np.testing.assert_allclose([lower - hand.lower, hand.upper - upper], 0.01)
