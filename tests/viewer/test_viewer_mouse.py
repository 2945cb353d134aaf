"""Handles, the ball of the task, sliders, letters and links, with a mouse or a finger in headless Chromium."""

from __future__ import annotations

import numpy as np
import pytest

from grasp_planner.batch import GraspCase, RunRows, run_batch
from grasp_planner.batch.report import write_report
from grasp_planner.viewer import GraspViewer

from .browser_page import TURN, TURNED, Page, until

pytestmark = pytest.mark.slow

ARROW, ARC = 0.85, 0.65
"""Where an arrow and an arc of a handle are taken, as shares of its size."""


def best_axis(page, pose, length):
    """Return the axis of a handle that lies most across the view, and where its arrow begins and ends [pixels]."""
    origin = page.project(pose.translation)
    tips = [page.project(pose.translation + ARROW * length * pose.rotation[:, axis]) for axis in range(3)]
    axis = int(np.argmax([np.linalg.norm(tip - origin) for tip in tips]))
    return axis, origin, tips[axis]


@pytest.mark.parametrize("what", ["hand", "object"])
def test_handles_move_hand_and_object(page, viewer, what):
    box, gizmo, pose_now, node = {
        "hand": ("Move the hand", viewer.picture.hand_gizmo, lambda: viewer.session.live.hand_pose, "/hand_gizmo"),
        "object": (
            "Move the object",
            viewer.picture.object_gizmo,
            lambda: viewer.session.live.object_pose,
            "/object_gizmo",
        ),
    }[what]
    page.tab("Synergies")
    page.row(box).check()
    page.page.wait_for_function("(n) => window.__viserMutable.nodeRefFromName[n]?.visible", arg=node)
    page.steady()
    before = pose_now()
    axis, origin, tip = best_axis(page, before, gizmo.scale)
    page.drag(tip, tip + 0.35 * (tip - origin))
    until(lambda: np.linalg.norm(pose_now().translation - before.translation) > 0.005, 20.0)
    viewer.worker.drain()
    moved = before.rotation.T @ (pose_now().translation - before.translation)
    assert moved[axis] > 0.005
    assert np.abs(np.delete(moved, axis)).max() < 1e-6, "along its arrow only"
    assert np.allclose(pose_now().rotation, before.rotation, atol=1e-9)
    assert "data-model='broken'" in viewer.card.widget.content
    page.page.locator("[data-model='broken']").wait_for()
    page.row(box).uncheck()
    until(lambda: not gizmo.visible)


def test_handles_turn_the_hand(page, viewer):
    page.tab("Synergies")
    page.row("Move the hand").check()
    page.page.wait_for_function("() => window.__viserMutable.nodeRefFromName['/hand_gizmo']?.visible")
    page.steady()
    pose, length = viewer.session.live.hand_pose, ARC * viewer.picture.hand_gizmo.scale
    # The arc from the second axis to the third turns about the first, and so on.
    spread = []
    for axis in range(3):
        one, two = pose.rotation[:, axis - 2], pose.rotation[:, axis - 1]
        arc = [page.project(pose.translation + length * np.cos(t) * one + length * np.sin(t) * two) for t in (0.7, 1.0)]
        spread.append((np.linalg.norm(arc[1] - arc[0]), axis, arc))
    _, axis, arc = max(spread, key=lambda entry: entry[0])
    page.drag(*arc)
    until(lambda: not np.allclose(viewer.session.live.hand_pose.rotation, pose.rotation, atol=0.02), 20.0)
    viewer.worker.drain()
    turn = pose.rotation.T @ viewer.session.live.hand_pose.rotation
    assert turn[axis, axis] == pytest.approx(1.0, abs=1e-6), "about its own axis"
    assert np.allclose(viewer.session.live.hand_pose.translation, pose.translation, atol=1e-6)
    page.row("Move the hand").uncheck()
    until(lambda: not viewer.picture.hand_gizmo.visible)


def test_the_ball_turns_the_task(page, viewer):
    viewer.display.boxes["cones"].value = viewer.display.boxes["forces"].value = False
    viewer.worker.drain()
    page.steady()
    before = viewer.session.problem.tasks[0].direction[:3].copy()
    ball = page.project(viewer.picture._grasp.task_handle.position)
    page.drag(ball, ball + np.array([40.0, -90.0]))
    until(lambda: not np.allclose(viewer.session.problem.tasks[0].direction[:3], before, atol=0.05), 20.0)
    viewer.worker.drain()
    after = viewer.session.problem.tasks[0].direction[:3]
    drawn = page.project(viewer.picture._grasp.task_handle.position) - page.project(np.zeros(3))
    wanted = ball + np.array([40.0, -90.0]) - page.project(np.zeros(3))
    cosine = drawn @ wanted / np.linalg.norm(drawn) / np.linalg.norm(wanted)
    assert cosine > 0.97, "the arrow points where the mouse went"
    assert np.linalg.norm(after) == pytest.approx(1.0)
    viewer.display.boxes["cones"].value = viewer.display.boxes["forces"].value = True
    viewer.worker.drain()


def test_a_slider_follows_the_mouse(page, viewer):
    page.tab("Synergies")
    slider = viewer.synergies.sliders[0]
    begin, end = page.track("σ1")
    page.drag(begin + 0.4 * (end - begin), begin + 0.75 * (end - begin))
    until(lambda: abs(slider.value - 1.0) < 0.1)
    until(lambda: viewer.session.live.sigma[0] == slider.value)
    name = page.page.locator("xpath=//label[normalize-space()='σ1']").get_attribute("for")
    labels = page.page.locator(f'[id="{name}"] .mantine-Slider-markLabel')
    until(lambda: labels.all_inner_texts() == [mark.label for mark in slider._marks if mark.label is not None])


def test_a_finger_drags_a_slider_and_the_hand_follows(browser, viewer):
    page = Page(browser, f"{viewer.url}/?fixedDpr=1", touch=True)
    page.tab("Synergies")
    joint = "/hand/joint_1/joint_2/joint_3"
    before = page.page.evaluate(TURN, joint)
    begin, end = page.track("σ1")
    page.swipe(begin + 0.5 * (end - begin), begin + 0.25 * (end - begin))
    until(lambda: abs(viewer.synergies.sliders[0].value + 1.0) < 0.1)
    until(lambda: viewer.session.live.sigma[0] == viewer.synergies.sliders[0].value)
    page.page.wait_for_function(TURNED, arg=[joint, before])
    page.close()


def test_a_letter_says_what_it_means_at_a_touch(browser, viewer):
    page = Page(browser, f"{viewer.url}/?fixedDpr=1", touch=True)
    page.page.locator("[data-cell][data-term='floor']").tap()
    note = page.page.locator("#term-note")
    assert "least F" in note.inner_text()
    page.page.locator("th[data-term='f_n']").tap()
    assert "normal" in note.inner_text()
    page.page.get_by_text("Does it hold").tap()
    note.wait_for(state="hidden")
    page.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run of three rows."""
    path = tmp_path_factory.mktemp("runs") / "mouse"
    settings = {"starts": 3, "enough": 1}
    tasks = ("force:+y", "force:+x", "force:+z")
    run_batch([GraspCase(task=(task,), n_synergies=15, settings=settings) for task in tasks], path, workers=1)
    return path


def test_a_link_of_the_report_opens_its_row(browser, folder):
    report = write_report(folder, pictures=1)
    viewer = GraspViewer(rows=RunRows(folder, row=0))
    try:
        context = browser.new_context(viewport={"width": 1100, "height": 760})
        page = context.new_page()
        page.goto(report.as_uri())
        page.locator("#port").fill(str(viewer.server.get_port()))
        with context.expect_page() as opened:
            page.locator(".rows a[data-row='2']").click()
        until(lambda: viewer.run.rows.row == 2)
        tab = opened.value
        tab.set_default_timeout(120_000)
        tab.get_by_text("Row 2").first.wait_for()
        assert viewer.session.problem.tasks[0].text == "force:0,0,1"
        page.locator("#row").fill("1")
        page.locator("#any").click()
        until(lambda: viewer.run.rows.row == 1)
        context.close()
        steps = Page(browser, f"{viewer.url}/?row=0&fixedDpr=1")
        steps.page.get_by_text("Row 0").first.wait_for()
        steps.page.get_by_role("button", name="next", exact=True).first.click()
        until(lambda: viewer.run.rows.row == 1)
        steps.page.get_by_text("Row 1").first.wait_for()
        steps.page.get_by_role("combobox", name="task", exact=True).click()
        steps.page.get_by_role("option", name="force:+z").click()
        until(lambda: viewer.run.rows.shown == [2])
        steps.page.get_by_text("1 of 1 shown").wait_for()
        steps.close()
    finally:
        viewer.stop()
