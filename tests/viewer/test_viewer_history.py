"""Undo and redo."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.viewer.history import APART_S, MOST, History
from grasp_planner.viewer.panels.changes import REDO, UNDO
from grasp_planner.viewer.session import Session


@pytest.fixture
def clock():
    """A clock that is set by hand."""
    made = SimpleNamespace(now=100.0)
    made.read = lambda: made.now
    return made


@pytest.fixture
def session(grasp, clock):
    """A session whose changes come a while apart."""
    made = Session(grasp, "test")
    made._history = History(clock.read)
    return made


def after_a_while(clock, change):
    clock.now += 2 * APART_S
    change()


def test_states_come_back_in_their_order_and_go_forth_again(clock):
    history = History(clock.read)
    for number in range(4):
        after_a_while(clock, lambda number=number: history.note(number, "move"))
    assert [history.back(present) for present in (4, 3, 2, 1, 0)] == [3, 2, 1, 0, None]
    assert [history.forth(present) for present in (0, 1)] == [1, 2]
    history.note(2, "other")
    assert history.forth(9) is None, "a new change ends what could be redone"
    assert history.back(9) == 2


def test_a_drag_is_one_change_and_old_ones_are_forgotten(clock):
    history = History(clock.read)
    for number in range(50):
        clock.now += 0.4 * APART_S
        history.note(number, "sigma")
    history.note(50, "hand")
    assert [history.back(60), history.back(50), history.back(0)] == [50, 0, None]
    for number in range(2 * MOST):
        after_a_while(clock, lambda number=number: history.note(number, "sigma"))
    found = [history.back(0) for _ in range(MOST + 1)]
    assert found[-2:] == [MOST, None]


def changes(session):
    """Return one change of every kind."""
    problem = session.problem
    pose = replace(session.live.hand_pose, translation=session.live.hand_pose.translation + 0.01)
    bottle = replace(problem, grasp_object=gp.Cylinder(radius=0.031))
    return (
        lambda: session.set_sigma(session.live.sigma + 0.1),
        lambda: session.set_hand_pose(pose),
        lambda: session.set_object_pose(pose),
        lambda: session.set_squeeze(1.5, False),
        session.reset_posture,
        lambda: session.set_problem(bottle),
        lambda: session.set_problem(replace(session.problem, tasks=(gp.parse_task("torque:+z"),))),
        lambda: session.set_posture(session.grasp.joint_angles + 0.01, "elsewhere"),
        lambda: session.show(replace(session.grasp, joint_angles=0.9 * session.grasp.joint_angles), "another"),
    )


def test_every_change_is_undone_and_redone(session, clock):
    shown = []
    for change in changes(session):
        session.update()
        shown.append(session.grasp)
        after_a_while(clock, change)
    session.update()
    last = session.grasp
    assert all(one != other for one, other in zip(shown, [*shown[1:], last], strict=True))
    for grasp in reversed(shown):
        version = session.version, session.problem_version
        session.undo()
        session.update()
        assert session.problem == grasp.problem
        np.testing.assert_allclose(session.grasp.joint_angles, grasp.joint_angles, atol=1e-9)
        np.testing.assert_allclose(session.grasp.palm_pose.homogeneous, grasp.palm_pose.homogeneous, atol=1e-12)
        assert (session.version, session.problem_version) > version, "the widgets have to follow"
    assert session.grasp is shown[0], "the very grasp, not one like it"
    session.undo()
    assert session.grasp is shown[0]
    for _ in shown:
        session.redo()
    session.update()
    assert session.problem == last.problem
    np.testing.assert_allclose(session.grasp.joint_angles, last.joint_angles, atol=1e-9)


def test_the_buttons_of_the_page_undo_what_a_widget_did(viewer, grasp):
    viewer.synergies.count.value = 2
    viewer.worker.drain()
    assert viewer.session.problem.n_synergies == 2
    viewer.changes.buttons.value = UNDO
    viewer.worker.drain()
    assert viewer.session.grasp is grasp
    assert viewer.synergies.count.value == len(viewer.synergies.sliders) == grasp.problem.n_synergies
    viewer.changes.buttons.value = REDO
    viewer.worker.drain()
    assert viewer.session.problem.n_synergies == viewer.synergies.count.value == 2
