"""What a grasp withstands, in words and as an arrow."""

from dataclasses import replace

import numpy as np

import grasp_planner as gp
from grasp_planner.analysis import contact_set
from grasp_planner.model import grasp_stiffness, moved_stiffness
from grasp_planner.viewer.scene.draw_extras import StiffnessDrawing, stiffness_ellipsoid
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


def test_the_stiffness_ellipsoid_is_that_of_a_shift_at_the_centre_of_compliance(planned):
    centre, ellipsoid = stiffness_ellipsoid(planned)
    shifts = np.linalg.inv(moved_stiffness(grasp_stiffness(contact_set(planned).springs), centre))[:3, :3]
    again = ellipsoid.axes @ np.diag(1.0 / ellipsoid.lengths) @ ellipsoid.axes.T
    np.testing.assert_allclose(again, shifts, atol=1e-9 * np.abs(shifts).max())
    assert (np.diff(ellipsoid.lengths) <= 0.0).all(), "longest first"


def test_the_stiffness_ellipsoid_is_drawn_where_it_is_asked_for_and_springs_hold(planned):
    server = LocalServer()
    try:
        drawing, shown = StiffnessDrawing(server.scene), DisplayOptions(stiffness_ellipsoid=True)
        drawing.draw(planned, shown, in_contact=True)
        np.testing.assert_allclose(drawing._mesh.position, stiffness_ellipsoid(planned)[0], atol=1e-6)
        for options, touching in ((DisplayOptions(), True), (shown, False)):
            drawing.draw(planned, options, in_contact=touching)
            assert drawing._mesh is None
    finally:
        server.stop()
    rigid = replace(planned.problem.parameters, contact_stiffness=0.0)
    assert stiffness_ellipsoid(replace(planned, problem=replace(planned.problem, parameters=rigid))) is None
