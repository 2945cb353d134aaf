"""What a grasp withstands, in words and as an arrow."""

import numpy as np

import grasp_planner as gp
from grasp_planner.viewer.scene.margin import margin_arrow, withstands
from grasp_planner.viewer.text import story
from tests.stored import stored


def test_a_plan_at_the_least_force_has_no_margin_and_one_with_load_cases_has(planned):
    assert "no margin" in withstands(planned)
    held = stored("round_cylinder")
    assert held.feasible and held.problem.loads == gp.LoadCases()
    assert f"{held.passive_margin.size:.2f} N" in withstands(held)
    assert "stable" in withstands(held)
    assert withstands(held) in story(held)


def test_the_arrow_points_along_the_push_onto_the_object(planned):
    begin, end = margin_arrow(planned)
    push = end - begin
    np.testing.assert_allclose(push / np.linalg.norm(push), planned.passive_margin.direction[:3], atol=1e-9)
    assert np.linalg.norm(begin) > np.linalg.norm(end)
