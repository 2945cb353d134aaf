"""The gallery of grasps that differ: its order, its cards, what a click does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from grasp_planner import PlannerOptions
from grasp_planner.planning.ranking import alike
from grasp_planner.viewer.equivalent import command_text, python_text
from grasp_planner.viewer.session import Session

from .browser_page import until
from .test_viewer_app import plan_and_wait, settle


@pytest.fixture
def other(grasp):
    """Another posture, which does not meet the model."""
    return replace(grasp, joint_angles=grasp.joint_angles - 0.2)


def test_of_grasps_that_are_alike_the_better_one_has_a_place(grasp, other):
    session = Session(grasp)
    near = replace(grasp, joint_angles=grasp.joint_angles + 0.01)
    assert not near.feasible
    assert session.add_result(near)
    assert session.add_result(grasp), "a better one takes the place of one like it"
    assert not session.add_result(near)
    assert not session.add_result(other)
    assert [id(each) for each in session.results] == [id(grasp), id(other)]


def test_the_order_of_the_search_holds_and_what_is_shown_stays(grasp, other):
    session = Session(grasp)
    session.add_result(grasp)
    session.add_result(other)
    session.show_result(0)
    session.take_best([replace(other)])
    assert alike(session.results[0], other)
    assert session.results[1] is grasp
    assert session.shown == 1


def test_a_search_begun_while_a_result_is_shown_has_results_too(grasp, other):
    session = Session(grasp)
    session.add_result(grasp)
    session.show_result(0)
    session.forget_results()
    assert session.add_result(other), "the first of the new search"
    session.take_best([other])
    assert session.results == [other]
    assert session.shown is None, "the grasp shown is of the search before"


def test_a_card_tells_force_angle_and_closing_and_a_click_shows_it(viewer, grasp, other):
    gallery = viewer.plan.gallery

    def search():
        viewer.session.add_result(other)
        viewer.session.add_result(grasp)
        viewer.session.dirty = True

    viewer.worker.submit(search)
    until(lambda: len(gallery.pictures) == 2 and all(picture is not None for picture in gallery.pictures))
    best, last = gallery.buttons
    assert best.label.startswith(f"1 · {grasp.force_norm:.2f} N")
    assert ("closes ✔" in best.label) == grasp.closing.holds
    assert "does not meet" in last.label
    assert gallery.pictures[0].shape == (190, 340, 3)
    assert not np.array_equal(*gallery.pictures)
    last.value = True
    settle(viewer)
    assert viewer.session.shown == 1
    assert (best.color, last.color) == ("gray", "green")
    viewer.worker.submit(lambda: viewer.session.results.clear())
    viewer.worker.submit(viewer.session.mark_dirty)
    settle(viewer)
    assert not gallery.buttons


def test_how_many_are_asked_for_is_part_of_command_and_python(viewer, grasp):
    viewer.plan.count.value = 3
    settle(viewer)
    assert "--grasps 3" in viewer.share._same.content
    written = viewer.share._told
    viewer.synergies.sliders[0].value += 0.01
    settle(viewer)
    assert viewer.share._told is written, "not anew for every move of the hand"
    viewer.plan.count.value = 1
    settle(viewer)
    assert "--grasps" not in viewer.share._same.content
    assert "--grasps" not in command_text(grasp.problem, PlannerOptions(), 0, 1)
    assert "gp.plan_grasps(problem, 3, seed=2)" in python_text(grasp.problem, 2, 3)


@pytest.mark.slow
def test_planning_several_fills_the_gallery_with_grasps_that_differ(viewer, easy_problem):
    viewer.worker.submit(lambda: viewer.session.set_problem(easy_problem))
    settle(viewer)
    viewer.plan.count.value, viewer.plan.starts.value, viewer.plan.enough.value = 2, 20, 1
    plan_and_wait(viewer)
    viewer.plan.count.value = 1
    results = viewer.session.results
    assert sum(each.feasible for each in results) >= 2
    assert not any(alike(a, b) for i, a in enumerate(results) for b in results[:i])
    assert len(viewer.plan.gallery.buttons) == len(results)
