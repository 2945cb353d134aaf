"""The page without a browser: widgets are set from Python, which runs their callbacks; then the worker is awaited."""

import json
import time
from dataclasses import replace

import numpy as np
import pytest
import viser
from viser import _icons

import grasp_planner as gp
from grasp_planner.drawing import look
from grasp_planner.records.grasp_record import grasp_record
from grasp_planner.viewer import icons
from grasp_planner.viewer.panels.chapters import ABOUT, CHAPTERS
from grasp_planner.viewer.scene.colours import instance_colours
from grasp_planner.viewer.scene.draw_grasp import DisplayOptions, GraspDrawing
from grasp_planner.viewer.server import LocalServer
from grasp_planner.viewer.verdict_card import headline
from grasp_planner.viewer.worker import Worker


def settle(viewer):
    assert viewer.worker.drain(30.0)


def until(condition, timeout_s=60.0):
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, "the condition did not come true"
        time.sleep(0.01)


def plan_and_wait(viewer, timeout_s=90.0):
    viewer.plan.plan.value = True
    until(lambda: viewer.planning.busy)
    until(lambda: not viewer.planning.busy, timeout_s)
    settle(viewer)


def watch_drawings(viewer, monkeypatch):
    """Return a list that fills with the previews drawn and what is said of them."""
    drawn, draw = [], viewer.picture.draw

    def record(session, options):
        if session.preview is not None:
            drawn.append((session.preview.grasp, session.preview.message))
        draw(session, options)

    monkeypatch.setattr(viewer.picture, "draw", record)
    return drawn


def test_the_page_opens_with_a_feasible_grasp_and_its_verdict_on_top(viewer, grasp):
    assert "data-model='met'" in viewer.card.widget.content
    assert "data-model='broken'" not in viewer.card.widget.content
    for word in ("F", "floor", "C", "angle", "α"):
        assert f">{word}</div>" in viewer.card.widget.content


def test_every_chapter_says_what_it_is_about(viewer, client):
    tabs = next(widget for widget in client.widgets.values() if "_tab_labels" in widget["props"])
    assert tuple(tabs["props"]["_tab_labels"])[: len(CHAPTERS)] == CHAPTERS
    texts = [widget["props"].get("content", "") for widget in client.widgets.values()]
    for chapter in CHAPTERS:
        assert any(ABOUT[chapter] in text for text in texts)
    assert set(ABOUT) == set(CHAPTERS)


def test_the_task_chapter_tells_what_the_task_costs(viewer, grasp):
    viewer.problem.axis.value = "+z"
    settle(viewer)
    assert "force along +z" in viewer.task._story.content
    for symbol, value, _ in headline(viewer.session.grasp):
        assert f"| {symbol} | {value} |" in viewer.task._costs.content


def test_a_synergy_slider_moves_the_hand_and_the_verdict_follows(viewer):
    before = viewer.session.grasp.joint_angles
    slider = viewer.synergies.sliders[0]
    slider.value = slider.value + 0.2
    settle(viewer)
    assert not np.allclose(viewer.session.grasp.joint_angles, before)
    assert "data-model='broken'" in viewer.card.widget.content
    viewer.synergies.reset.value = True
    settle(viewer)
    assert np.allclose(viewer.session.live.sigma, 0.0)
    assert np.allclose(viewer.synergies.sigma, 0.0)


def test_the_newest_slider_value_wins(viewer):
    slider = viewer.synergies.sliders[1]
    start = slider.value
    runs = len(viewer.worker.durations)
    for step in range(40):
        slider.value = start + 0.002 * step
    settle(viewer)
    assert viewer.session.live.sigma[1] == pytest.approx(start + 0.002 * 39)
    assert len(viewer.worker.durations) - runs < 40


def test_dragging_a_slider_does_not_freeze_the_drawing(viewer):
    """How fast it is, ``scripts/benchmark_viewer.py`` measures; here only a freeze fails."""
    slider = viewer.synergies.sliders[0]
    for step in range(25):
        slider.value = 0.001 * step
        settle(viewer)
    assert np.median(viewer.worker.efforts[-25:]) < 1.0


def test_the_number_of_synergies_can_be_changed(viewer):
    viewer.synergies.count.value = 2
    settle(viewer)
    assert viewer.session.problem.n_synergies == 2
    assert len(viewer.synergies.sliders) == 2


def test_gizmos_move_hand_and_object(viewer):
    gizmo = viewer.picture.hand_gizmo
    viewer.worker.submit(lambda: viewer.session.set_hand_pose(viewer.session.live.hand_pose))
    settle(viewer)
    viewer.synergies.move_hand.value = True
    settle(viewer)
    assert gizmo.visible
    moved = viewer.session.live.object_pose.se3()
    moved.translation = np.array([0.0, 0.0, 0.05])
    viewer.worker.submit(lambda: viewer.session.set_object_pose(moved))
    settle(viewer)
    assert "data-model='broken'" in viewer.card.widget.content
    viewer.synergies.move_hand.value = False
    settle(viewer)
    assert not gizmo.visible


def test_close_ends_with_fingertips_on_the_surface(viewer, monkeypatch):
    drawn = watch_drawings(viewer, monkeypatch)
    viewer.synergies.close.value = True
    settle(viewer)
    assert len({tuple(grasp.joint_angles) for grasp, message in drawn if "Closing along synergy 1" in message}) > 10
    assert viewer.session.note.startswith("closed along synergy 1")
    closed = [grasp for grasp, message in drawn if "Closing along synergy 1" in message][-1]
    assert np.abs(closed.contacts.gaps).max() < 1e-6
    # Then the springs bend under the squeeze that is shown with it, of several newtons.
    assert np.abs(viewer.session.grasp.contacts.gaps).max() < 0.02


def test_play_closing_returns_to_the_grasp(viewer, grasp):
    viewer.grasp_panel.play.value = True
    settle(viewer)
    assert np.array_equal(viewer.session.grasp.joint_angles, grasp.joint_angles)
    assert "data-model='met'" in viewer.card.widget.content


def test_object_task_and_parameters_change_the_problem_and_nothing_else(viewer, grasp):
    viewer.problem.direction.value = (1.0, 0.0, 0.0)
    viewer.problem._sizes["radius"].value = 0.031
    viewer.problem.parameters.widgets["friction"].value = 0.5
    settle(viewer)
    problem = viewer.session.problem
    assert problem.tasks[0].text == "force:1,0,0"
    assert problem.grasp_object == replace(grasp.problem.grasp_object, radius=0.031)
    assert problem.parameters.friction == 0.5
    assert problem.parameters.force_weight == grasp.problem.parameters.force_weight


def test_what_has_to_keep_clear_can_be_chosen(viewer, grasp):
    viewer.problem.clearance.widgets["link_object"].value = "joint_centres"
    viewer.problem.clearance.widgets["self_collision"].value = False
    settle(viewer)
    assert viewer.session.problem.clearance == replace(
        grasp.problem.clearance, link_object="joint_centres", self_collision=False
    )
    assert "self_collision" not in viewer.session.grasp.violations


def test_every_shape_of_the_library_can_be_chosen_or_says_why_not(viewer):
    for kind in viewer.problem.kind.options:
        viewer.problem.kind.value = kind
        settle(viewer)
        assert viewer.session.problem.grasp_object.kind == kind or viewer.share.last_error


def test_an_impossible_problem_is_refused_with_its_reason(viewer):
    before = viewer.session.problem
    viewer.problem.loads.widgets["min_normal_force"].value = 1e3
    settle(viewer)
    assert "less than the largest" in viewer.share.last_error
    assert viewer.session.problem == before
    assert viewer.problem.loads.widgets["min_normal_force"].value == 0.1, "the widget shows what holds"


def test_more_tasks_are_read_as_text(viewer):
    viewer.problem.more.value = "torque:+z*0.5 force:+x"
    settle(viewer)
    assert [task.text for task in viewer.session.problem.tasks[1:]] == ["torque:0,0,1*0.5", "force:1,0,0"]
    viewer.problem.more.value = "nonsense"
    settle(viewer)
    assert "nonsense" in viewer.problem._more._complaint.content
    assert len(viewer.session.problem.tasks) == 3, "what held holds on"


def test_fingers_can_be_left_out(viewer):
    viewer.problem._fingers["little"].value = False
    settle(viewer)
    assert [frame.name for frame in viewer.session.problem.frames] == ["thumb", "index", "middle", "ring"]
    again = gp.grasp_from_record(grasp_record(viewer.session.grasp)).problem
    assert again.contacts == ("thumb", "index", "middle", "ring")


def test_what_is_shown_follows_the_boxes(viewer):
    for box in viewer.display.boxes.values():
        box.value = True
    settle(viewer)
    assert any("velocity ellipsoid" in note for note in viewer.picture.notes)
    viewer.display.boxes["forces"].value = False
    settle(viewer)
    assert not viewer.server.scene.get_handle_by_name("/object/forces_5").visible
    for name, box in viewer.display.boxes.items():
        box.value = bool(getattr(type(viewer.display.options)(), name))
    settle(viewer)


def test_pinning_compares_two_grasps(viewer):
    viewer.compare.pin.value = True
    viewer.synergies.count.value = 3
    settle(viewer)
    assert "pinned" in viewer.compare.compared.content
    assert viewer.server.scene.get_handle_by_name("/ghost_pinned").visible
    viewer.compare.unpin.value = True
    settle(viewer)
    assert viewer.session.pinned is None


def test_clicking_shows_the_numbers_of_contacts_and_links(viewer):
    viewer.picture.clicked(("contact", 1))
    settle(viewer)
    assert "Contact index" in viewer.grasp_panel._selected.content
    colours = viewer.picture._grasp.contact_handle.batched_colors
    assert (np.asarray(colours[1]) == instance_colours(look.SELECTED)).all()
    assert (np.asarray(colours[0]) == instance_colours(look.CONTACT)).all()
    viewer.picture.clicked(("link", "index_medial"))
    settle(viewer)
    assert "index_pip" in viewer.grasp_panel._selected.content
    assert (np.asarray(viewer.picture._grasp.contact_handle.batched_colors) == instance_colours(look.CONTACT)).all()
    painted = [mesh.color for name, mesh in viewer.picture._hand.meshes.items() if "index_medial" in name]
    assert look.SELECTED in [tuple(colour) for colour in painted]


def test_colours_of_copies_are_linear_light():
    # What the screen makes of linear light, by the inverse transfer function, is the colour that was meant.
    shares = instance_colours([look.FORCE, look.TASK, look.CONTACT]) / 255.0
    again = np.where(shares <= 0.0031308, 12.92 * shares, 1.055 * shares ** (1 / 2.4) - 0.055)
    assert 255.0 * again == pytest.approx(np.array([look.FORCE, look.TASK, look.CONTACT]), abs=7.0)
    assert instance_colours((0, 255, 255)).tolist() == [0, 255, 255]


def test_fingers_and_fingertips_have_their_colours(viewer):
    colours = {tuple(mesh.color) for mesh in viewer.picture._hand.meshes.values()}
    assert {look.HAND, look.PAD, look.PALM} <= colours


def test_there_are_arrows_for_all_forces_before_their_colours_come(grasp):
    # A page may draw between two messages, and complains of more colours than arrows.
    server = LocalServer()
    try:
        drawing = GraspDrawing(server.scene, grasp.problem)
        assert len(drawing._forces.points) == len(grasp.contacts.points)
        drawing.draw(grasp, DisplayOptions())
        assert len(drawing._forces.colors) == len(drawing._forces.points) == len(grasp.contacts.points)
    finally:
        server.stop()


def test_looking_at_the_grasp_moves_the_camera_of_every_page(viewer, client):
    viewer.display.look.value = True
    settle(viewer)
    client.until(lambda: "SetCameraPositionMessage" in client.kinds)


def test_the_synergy_sliders_carry_their_limits(viewer, client):
    slider, other = viewer.synergies.sliders[:2]
    before = slider._marks
    assert len(before) == 2
    other.value = other.value + 0.1
    settle(viewer)
    assert slider._marks != before, "the limits of one synergy depend on the others"
    wanted = [mark.value for mark in slider._marks]
    uuid = client.widget("σ1")["uuid"]
    client.until(lambda: [mark["value"] for mark in client.widgets[uuid]["props"]["_marks"]] == wanted)


def test_dragging_the_ball_turns_the_task(viewer):
    viewer.picture.task_dragged(np.array([0.0, 0.0, 0.2]))
    settle(viewer)
    assert viewer.session.problem.tasks[0].text == "force:0,0,1"


def test_a_grasp_goes_out_and_in_as_json(viewer, grasp):
    content = viewer.share._json()
    viewer.worker.submit(lambda: viewer.share.open_bytes(content))
    settle(viewer)
    assert viewer.session.note == "opened from a file"
    assert viewer.session.grasp.feasible
    assert np.allclose(viewer.session.grasp.joint_angles, grasp.joint_angles)


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[1, 2]", b'{"schema_version": NaN}', b"\xff\xfe", b"{}" + b" " * 6_000_000]
)
def test_bad_files_are_refused_with_a_message_and_change_nothing(viewer, grasp, content):
    viewer.share._open(None, content)
    settle(viewer)
    assert "the uploaded file" in viewer.share.last_error
    assert viewer.session.grasp is grasp


def test_a_file_that_names_unknown_things_is_refused(viewer, grasp):
    record = json.loads(viewer.share._json())
    record["hand"] = "../../etc/passwd"
    viewer.share._open(None, json.dumps(record).encode())
    settle(viewer)
    assert viewer.share.last_error
    assert viewer.session.grasp is grasp


def test_errors_in_the_worker_are_reported_and_survived():
    seen, drawn = [], []
    worker = Worker(lambda: drawn.append(1), seen.append)
    worker.submit(lambda: 1 / 0)
    worker.submit(lambda: seen.append("alive"))
    assert worker.drain()
    assert seen == ["ZeroDivisionError: division by zero", "alive"]
    worker.stop()


@pytest.mark.slow
def test_planning_shows_progress_and_ranked_results(viewer, easy_problem, monkeypatch):
    viewer.worker.submit(lambda: viewer.session.set_problem(easy_problem))
    settle(viewer)
    drawn, before = watch_drawings(viewer, monkeypatch), tuple(viewer.session.grasp.joint_angles)
    viewer.plan.enough.value, viewer.plan.starts.value = 2, 10
    plan_and_wait(viewer)
    results = viewer.session.results
    assert results
    assert viewer.session.shown == 0
    assert viewer.plan.curves.visible
    assert "done" in viewer.plan.status.content
    if len(results) > 1:
        viewer.plan.browse.value = "next"
        settle(viewer)
        assert viewer.session.shown == 1
    postures = {tuple(grasp.joint_angles) for grasp, message in drawn if message.startswith("Searching")}
    # A quick search on a busy machine shows few of its iterations.
    assert postures - {before}, "the hand moves through the iterations"
    viewer.display.boxes["seed_ghost"].value = True
    settle(viewer)
    assert viewer.server.scene.get_handle_by_name("/ghost_seed").visible


@pytest.mark.slow
def test_planning_in_the_page_finds_what_the_planner_finds(viewer, easy_problem):
    viewer.worker.submit(lambda: viewer.session.set_problem(easy_problem))
    settle(viewer)
    viewer.plan.enough.value, viewer.plan.starts.value = 1, 6
    plan_and_wait(viewer)
    best = gp.plan_grasp(easy_problem, options=gp.PlannerOptions(starts=6, enough=1))
    for _ in range(2):  # the second search begins while a result of the first is shown
        assert viewer.session.results[0].objective == pytest.approx(best.objective, rel=1e-9)
        assert viewer.session.shown == 0
        assert not viewer.share.last_error
        plan_and_wait(viewer)


@pytest.mark.slow
def test_cancel_does_not_wait_for_the_search_and_planning_goes_on_working(viewer, easy_problem):
    viewer.worker.submit(lambda: viewer.session.set_problem(easy_problem))
    viewer.plan.enough.value, viewer.plan.starts.value = 50, 500
    settle(viewer)
    for iterations in (0, 10):
        viewer.plan.plan.value = True
        until(lambda: viewer.planning.busy)
        until(lambda count=iterations: len(viewer.plan._history) >= count)
        began = time.perf_counter()
        viewer.plan.cancel.value = True
        until(lambda: not viewer.planning.busy)
        assert time.perf_counter() - began < 5.0
    settle(viewer)
    assert viewer.plan.cancel.disabled
    assert not viewer.plan.plan.disabled
    viewer.plan.enough.value, viewer.plan.starts.value = 1, 2
    plan_and_wait(viewer)
    assert "done" in viewer.plan.status.content


@pytest.mark.slow
def test_the_hand_follows_the_sliders_while_planning(viewer, easy_problem):
    viewer.worker.submit(lambda: viewer.session.set_problem(easy_problem))
    viewer.plan.enough.value, viewer.plan.starts.value = 50, 500
    settle(viewer)
    viewer.plan.plan.value = True
    until(lambda: viewer.planning.busy)
    durations = []
    for step in range(20):
        began = time.perf_counter()
        viewer.synergies.sliders[0].value = 0.3 + 0.005 * step
        until(lambda value=0.3 + 0.005 * step: viewer.session.live.sigma[0] == value)
        durations.append(time.perf_counter() - began)
    viewer.plan.cancel.value = True
    until(lambda: not viewer.planning.busy)
    settle(viewer)
    assert np.median(durations) < 2.0


@pytest.mark.slow
def test_a_preset_plans_a_figure_of_the_paper(viewer):
    viewer.compare.preset.value = next(name for name in viewer.compare.preset.options if name.startswith("15"))
    viewer.plan.enough.value, viewer.plan.starts.value = 1, 10
    viewer.compare.show_preset.value = True
    until(lambda: viewer.planning.busy)
    until(lambda: not viewer.planning.busy, 90.0)
    settle(viewer)
    assert viewer.session.problem.n_synergies == 15
    assert viewer.session.results


def test_the_icons_of_a_page_are_read_in_one_go(monkeypatch):
    opened = []

    class Counted(icons._KeptOpen):
        def __init__(self, path):
            opened.append(path)
            super().__init__(path)

    monkeypatch.setattr(icons, "_KeptOpen", Counted)
    read, usual = _icons.svg_from_icon.__wrapped__, _icons.zipfile
    apart = [read(viser.Icon.ROCKET), read(viser.Icon.PIN)]
    with icons.icons_read_once():
        assert [read(viser.Icon.ROCKET), read(viser.Icon.PIN)] == apart
    assert len(opened) == 1
    assert _icons.zipfile is usual
