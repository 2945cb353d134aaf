"""Links that hold the state of the page."""

import base64
import urllib.request
from dataclasses import replace
from urllib.parse import parse_qsl

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.drawing.camera import good_view
from grasp_planner.viewer.state_link import is_state, parse_state, state_query

from ..stored import stored
from .browser_page import until
from .test_viewer_inputs import PROBLEMS

NAVIGATED = {"Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}


def posed(problem, seed=0):
    rng = np.random.default_rng(seed)
    hand = problem.hand
    pose = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3))
    forces = None
    if problem.parameters.force_law == "springs":
        forces = rng.normal(size=(len(problem.frames), problem.contact_model.dimension))
    return gp.Grasp(problem, rng.uniform(hand.lower, hand.upper), pose, rng.normal(size=problem.n_synergies), forces)


def keys(query):
    return dict(parse_qsl(query, keep_blank_values=True))


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_link_opens_the_same_problem_search_and_posture(name):
    grasp, options = posed(PROBLEMS[name]), gp.PlannerOptions(starts=7, time_limit_s=2.5, phase_one=False)
    opened = parse_state(keys(state_query(grasp, options, 3, 2)))
    assert opened.grasp.problem == grasp.problem
    assert (opened.options, opened.seed, opened.count, opened.posed) == (options, 3, 2, True)
    np.testing.assert_array_equal(opened.grasp.joint_angles, grasp.joint_angles)
    np.testing.assert_array_equal(opened.grasp.delta_sigma, grasp.delta_sigma)
    np.testing.assert_allclose(opened.grasp.palm_pose.homogeneous, grasp.palm_pose.homogeneous, atol=1e-12)
    if grasp.contact_forces is not None:
        np.testing.assert_array_equal(opened.grasp.contact_forces, grasp.contact_forces)


def test_a_grasp_is_as_feasible_by_its_link_as_it_was(grasp):
    assert parse_state(keys(state_query(grasp))).grasp.feasible


def test_a_link_written_by_hand_may_leave_out_what_is_usual():
    opened = parse_state({"object": "sphere:radius=0.03", "n_synergies": "2", "fixedDpr": "1"})
    assert opened.grasp.problem == gp.GraspProblem(gp.load_hand(), gp.Sphere(radius=0.03), n_synergies=2)
    assert not opened.posed
    assert not is_state({"fixedDpr": "1", "initialCameraFov": "2"})


@pytest.mark.parametrize(
    ("query", "word"),
    [
        ({"hand": "/etc/passwd"}, "hand of the link"),
        ({"hand": "dlr_hit_ii_right:thumb_abd=0"}, "hand of the link"),
        ({"object": "mesh:/etc/passwd"}, "needs no file"),
        ({"frition": "0.5"}, "frition"),
        ({"friction": "-1"}, "friction"),
        ({"task": "force:+w"}, "task axis"),
        ({"paper": "1"}, "yes or no"),
        ({"loads.hand_limits": "maybe"}, "yes or no"),
        ({"grasps": "0"}, "grasps"),
        ({"seed": "1" * 5000}, "seed"),
        ({"posture": "AAAA"}, "posture"),
        ({"posture": "é"}, "posture"),
        ({"posture": base64.urlsafe_b64encode(np.full(40, np.nan).tobytes()).decode()}, "posture"),
    ],
)
def test_a_link_that_does_not_fit_is_refused_in_one_line(query, word):
    with pytest.raises(gp.GraspPlannerError, match=word) as caught:
        parse_state(query)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 1500


def test_the_posture_of_another_hand_is_refused(grasp):
    query = keys(state_query(grasp)) | {"hand": "allegro_right"}
    with pytest.raises(gp.InvalidValueError, match="posture"):
        parse_state(query)


def test_what_needs_a_file_or_code_is_in_no_link(grasp):
    own = replace(grasp.problem, synergy_space=grasp.problem.hand.synergies().truncated(5))
    with pytest.raises(gp.InvalidValueError, match="synergies, costs"):
        state_query(posed(own))
    outside = replace(grasp.problem.hand, description=grasp.problem.hand.description.model_copy(update={"name": "x"}))
    with pytest.raises(gp.InvalidValueError, match="the hand of a link"):
        state_query(posed(replace(grasp.problem, hand=outside)))


def navigate(viewer, query):
    request = urllib.request.Request(f"{viewer.url}/?{query}", headers=NAVIGATED)
    urllib.request.urlopen(request, timeout=30.0).read(10)


def test_a_page_opened_by_a_link_shows_it_and_only_a_person_can_open_one(viewer):
    shown = stored("clear")
    query = state_query(shown, gp.PlannerOptions(starts=9), 4, 2)
    viewer.share.show(viewer.control.options, 0, 1)
    before = viewer.session.grasp
    urllib.request.urlopen(f"{viewer.url}/?{query}", timeout=30.0).read(10)
    viewer.worker.drain()
    assert viewer.session.grasp is before, "not navigated to"
    navigate(viewer, query)
    until(lambda: viewer.session.problem == shown.problem)
    viewer.worker.drain()
    assert viewer.control.options.starts == 9
    assert (viewer.plan.seed.value, viewer.control.count) == (4, 2)
    again = parse_state(keys(viewer.share.query()))
    assert (again.grasp.problem, again.options.starts) == (shown.problem, 9), "and it gives the same link again"
    assert "opened from a link" in viewer.card.widget.content
    viewer.plan.search.enter(gp.PlannerOptions())
    viewer.plan.seed.value, viewer.plan.count.value = 0, 1


def test_a_broken_link_changes_nothing_and_says_so(viewer):
    before = viewer.session.grasp
    navigate(viewer, "friction=nonsense")
    until(lambda: "friction" in viewer.share.last_error)
    assert viewer.session.grasp is before


def test_a_page_that_is_opened_looks_at_what_is_shown_by_then(viewer):
    camera = viewer.server.initial_camera
    there = pin.SE3(pin.exp3(np.array([0.0, 0.0, 1.0])), np.array([0.0, 0.7, 0.2]))
    viewer.worker.submit(lambda: viewer.session.show(stored("clear"), object_pose=there))
    assert viewer.worker.drain()
    assert np.linalg.norm(camera.look_at - there.translation) > 0.3, "no page asked yet"
    navigate(viewer, "")
    until(lambda: np.linalg.norm(camera.look_at - there.translation) < 0.15)
    assert viewer.worker.drain()
    np.testing.assert_allclose(there.actInv(camera.position), good_view(stored("clear"))[0], atol=1e-9)
