"""What a grasp withstands, in words and as an arrow."""

from dataclasses import replace

import numpy as np

import grasp_planner as gp
from grasp_planner.analysis import contact_set
from grasp_planner.model import stiffness_ellipsoid
from grasp_planner.viewer.scene.draw_extras import StiffnessDrawing
from grasp_planner.viewer.scene.draw_grasp import DisplayOptions
from grasp_planner.viewer.scene.margin import margin_arrow, withstands
from grasp_planner.viewer.server import LocalServer
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


def test_the_stiffness_ellipsoid_is_drawn_where_it_is_asked_for_and_springs_hold(planned):
    server = LocalServer()
    try:
        drawing, shown = StiffnessDrawing(server.scene), DisplayOptions(stiffness_ellipsoid=True)
        drawing.draw(planned, shown, in_contact=True)
        centre = stiffness_ellipsoid(contact_set(planned).springs)[0]
        np.testing.assert_allclose(drawing._mesh.position, centre, atol=1e-6)
        rigid = replace(planned.problem.parameters, contact_stiffness=0.0)
        springless = replace(planned, problem=replace(planned.problem, parameters=rigid))
        for grasp, options, touching in (
            (planned, DisplayOptions(), True),
            (planned, shown, False),
            (springless, shown, True),
        ):
            drawing.draw(grasp, options, in_contact=touching)
            assert drawing._mesh is None
    finally:
        server.stop()
