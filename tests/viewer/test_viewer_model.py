"""The model behind the sliders, without a server: posture, squeeze, closing, shapes, words."""

import base64
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.drawing import look, shapes
from grasp_planner.grasp.joint_rows import joint_rows
from grasp_planner.grasp.verdict import Violation
from grasp_planner.judge.load_check import command_matrix
from grasp_planner.model.task import Ellipsoid
from grasp_planner.problem.term import METRE, ONE, RADIAN, Unit
from grasp_planner.viewer import text
from grasp_planner.viewer.compare import compare_table
from grasp_planner.viewer.export_text import export_overlay
from grasp_planner.viewer.live import LiveState, contact_share, evaluate
from grasp_planner.viewer.opening import approach, close_along
from grasp_planner.viewer.panels.synergies import SynergyRange, limit_marks, synergy_ranges
from grasp_planner.viewer.presets import paper_presets
from grasp_planner.viewer.scene.clearances import closest_lines, link_clearances
from grasp_planner.viewer.scene.draw_extras import torque_arrows
from grasp_planner.viewer.session import Session
from grasp_planner.viewer.squeeze import best_squeeze
from grasp_planner.viewer.verdict_card import verdict_card


def test_a_loaded_grasp_is_reproduced_by_its_sliders(grasp):
    _, again = evaluate(LiveState.of(grasp))
    assert np.allclose(again.joint_angles, grasp.joint_angles, atol=1e-9)
    assert again.feasible


def test_page_and_exported_page_tell_the_joints_in_degrees_and_those_at_a_limit(grasp):
    hand = grasp.problem.hand
    q = 0.5 * (hand.lower + hand.upper)
    q[0], q[-1] = hand.lower[0], hand.upper[-1]
    ends = replace(grasp, joint_angles=q)
    rows = joint_rows(ends)
    assert [row.at_limit for row in rows] == [True, *[False] * (len(q) - 2), True]
    assert np.radians([row.angle for row in rows]) == pytest.approx(q)
    assert np.radians([row.reference for row in rows]) == pytest.approx(ends.reference_joint_angles)
    assert 1e-3 * np.array([row.torque for row in rows]) == pytest.approx(ends.joint_torques)
    assert f"| {hand.joint_names[0]} ⚠ | {text.fixed(rows[0].angle, 1)} |" in text.joint_table(ends)
    told = f"<td>{rows[3].name}</td><td>{text.fixed(rows[3].angle, 1)}</td>"
    assert told in export_overlay(ends, "")


def test_moving_a_slider_moves_the_hand_along_that_synergy(grasp):
    # With stiff joints, so that no spring gives.
    stiff = replace(grasp.problem, parameters=replace(grasp.problem.parameters, joint_compliance=0.0))
    grasp = gp.Grasp(stiff, grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma)
    state = LiveState.of(grasp)
    step = np.zeros(grasp.problem.n_synergies)
    step[0] = -0.2
    _, moved = evaluate(replace(state, sigma=state.sigma + step))
    change = moved.joint_angles - grasp.joint_angles
    expected = grasp.problem.synergies.basis @ step
    hand = grasp.problem.hand
    free = (moved.joint_angles > hand.lower + 1e-6) & (moved.joint_angles < hand.upper - 1e-6)
    assert np.abs(change - expected)[free].max() < 1e-6
    assert not moved.feasible


def test_forces_set_in_with_contact(grasp):
    away = grasp.palm_pose.se3()
    away.translation = away.translation + np.array([0.0, 0.0, 0.5]) + 0.02
    state = LiveState.of(gp.Grasp(grasp.problem, grasp.joint_angles, away, grasp.delta_sigma))
    lifted = replace(state, hand_pose=pin.SE3(np.eye(3), np.array([0.5, 0.0, 0.0])))
    _, far = evaluate(lifted)
    assert contact_share(far) == 0.0
    assert contact_share(grasp) == pytest.approx(1.0, abs=1e-4)


def test_the_automatic_squeeze_is_feasible_and_not_stronger_than_the_planners(grasp):
    best = best_squeeze(grasp)
    squeezed = replace(grasp, contact_forces=best)
    assert squeezed.friction_margins.min() > -1e-7
    assert squeezed.force_norm <= 1.001 * grasp.force_norm
    # Only what the motors can change has changed: few of them leave most internal forces as they are.
    by_motors = command_matrix(grasp.problem, grasp.grasp_matrix, grasp.hand_jacobian)
    change = (best - grasp.contact_forces).ravel()
    moved = np.linalg.lstsq(by_motors, change, rcond=None)[0]
    assert np.abs(change).max() > 1e-3
    assert np.abs(change - by_motors @ moved).max() < 1e-9
    assert np.linalg.matrix_rank(by_motors) < grasp.intensities.size - 6


def test_turning_the_object_turns_gravity_in_its_frame(grasp):
    state = LiveState.of(grasp)
    quarter = pin.SE3(pin.rpy.rpyToMatrix(np.pi / 2, 0.0, 0.0), np.zeros(3))
    turned = state.with_object_pose(quarter)
    assert np.allclose(turned.problem.parameters.gravity, quarter.rotation.T @ [0, 0, -9.81])
    back = turned.with_object_pose(pin.SE3.Identity())
    assert np.allclose(back.problem.parameters.gravity, [0, 0, -9.81])
    assert np.allclose(back.palm_pose.homogeneous, grasp.palm_pose.homogeneous)


def test_fewer_synergies_show_the_nearest_posture_they_can_make(grasp):
    state = LiveState.of(grasp).with_problem(replace(grasp.problem, n_synergies=1))
    assert state.sigma.shape == (1,)
    assert not state.offset.any()
    full = LiveState.of(grasp)
    posture = full.problem.synergies.joint_angles(full.sigma) + full.offset
    assert np.allclose(state.sigma, state.problem.synergies.coordinates(posture))


@pytest.mark.parametrize("synergy", [0, 1])
def test_closing_stops_each_finger_at_the_surface(grasp, synergy):
    path = close_along(grasp, synergy)
    last = gp.Grasp(grasp.problem, path.postures[-1], grasp.palm_pose, grasp.delta_sigma)
    for frame, gap in zip(grasp.problem.frames, last.contacts.gaps, strict=True):
        if frame.name in path.touched:
            assert abs(gap) < 1e-6
    assert set(path.touched) | set(path.missed) == {frame.name for frame in grasp.problem.frames}
    hand = grasp.problem.hand
    assert (path.postures >= hand.lower - 1e-12).all()
    assert (path.postures <= hand.upper + 1e-12).all()


def test_the_approach_ends_in_the_grasp_and_begins_away_from_it(grasp):
    path = approach(grasp, 20)
    assert np.array_equal(path[-1], grasp.joint_angles)
    first = gp.Grasp(grasp.problem, path[0], grasp.palm_pose, grasp.delta_sigma)
    assert np.median(first.contacts.gaps) > 0.005
    assert np.abs(np.diff(path, axis=0)).max() < 0.3


def ellipsoid(*lengths):
    return Ellipsoid(np.eye(3), np.array(lengths, dtype=float), 1, bool(np.isinf(lengths).any()))


@pytest.mark.parametrize(
    ("lengths", "cut", "word"),
    [
        ((2.0, 1.5, 1.0), 0, "its longest axis is 2 times"),
        ((14.0, 5.0, 1.0), 0, "its longest axis is 14 times"),
        ((900.0, 1.5, 1.0), 1, "900"),
        ((np.inf, 1.5, 1.0), 1, "tube"),
        ((np.inf, np.inf, 1.0), 2, "plates"),
        ((np.inf, np.inf, np.inf), 3, "every direction"),
    ],
)
def test_ellipsoids_are_drawn_as_what_they_are(lengths, cut, word):
    shape = shapes.ellipsoid_shape(ellipsoid(*lengths))
    assert len(shape.cut_axes) == cut
    assert word in shape.note
    if not len(shape.vertices):
        return
    assert np.isfinite(shape.vertices).all()
    assert np.abs(shape.vertices).max() < 2 * shapes.HALF_LENGTH
    # Every point lies on the surface x² / l² = const.
    inverse = np.where(np.isfinite(lengths), 1.0 / np.square(lengths), 0.0)
    level = (shape.vertices**2) @ inverse
    assert np.allclose(level, level[0], rtol=1e-6)
    if not cut:
        assert np.abs(shape.vertices).max(axis=0) == pytest.approx(
            shapes.HALF_LENGTH * np.array(lengths) / lengths[0], 0.02
        )


def test_the_cone_has_the_angle_of_friction():
    vertices, faces = shapes.cone_mesh(0.8, 0.02)
    rim = vertices[np.isclose(vertices[:, 2], 0.02)]
    assert np.linalg.norm(rim[:, :2], axis=1).max() == pytest.approx(0.8 * 0.02)
    assert faces.min() >= 0
    assert faces.max() < len(vertices)


def test_the_card_says_feasible_or_why_not(grasp):
    assert "data-model='met'" in verdict_card(grasp)
    pushed = grasp.palm_pose.se3()
    pushed.translation = pushed.translation + np.array([0.004, 0.0, 0.0])
    broken = gp.Grasp(grasp.problem, grasp.joint_angles, pushed, grasp.delta_sigma)
    card = verdict_card(broken)
    assert "data-model='broken'" in card
    assert "off the surface by up to" in card
    assert "mm" in card


def test_unknown_violations_are_shown_with_their_unit(grasp):
    assert text.reason(Violation("self_clearance", 0.002, METRE)) == "self clearance violated by 2 mm"
    assert text.reason(Violation("kinetic_energy", 0.5, Unit("J"))) == "kinetic energy violated by 0.5 J"
    assert text.quantity(np.pi, RADIAN) == "180 °"
    assert text.quantity(0.25, ONE) == "0.25"


def test_objects_and_tasks_are_told_in_words():
    assert text.object_words(gp.Cylinder()) == "cylinder, 60 × 60 × 150 mm, 200 g"
    assert text.task_words(gp.parse_task("torque:-z")) == "torque about −z"
    assert text.task_words(gp.parse_task("force:3,4,0")) == "force along (0.60, 0.80, 0.00)"


def test_nothing_foreign_reaches_the_page_unescaped(grasp):
    card = verdict_card(grasp, "<img src=x onerror=alert(1)>")
    assert "<img" not in card
    overlay = export_overlay(grasp, "<script>alert(1)</script>")
    assert "<script>alert" not in overlay
    assert "&lt;script&gt;alert" in overlay


def test_an_exported_page_tells_everything_and_carries_the_grasp(grasp):
    overlay = export_overlay(grasp, "A title")
    file = re.search(r"data:application/json;base64,([A-Za-z0-9+/=]+)", overlay)
    assert base64.b64decode(file[1]).decode() == gp.grasp_json(grasp)
    for name in grasp.problem.hand.joint_names:
        assert f"<td>{name}</td>" in overlay
    for words in ("<b>Why it holds.</b>", "<b>Task.</b>", "force ellipsoid", "friction margin", "survives errors"):
        assert words in overlay
    assert "**" not in overlay


def test_all_numbers_of_all_requirements_are_listed(grasp):
    table = text.violation_table(grasp)
    for name in grasp.violations:
        assert text.readable(name) in table
    measures = text.measure_table(grasp)
    for name in ("force-closure margin", "internal forces commanded", "softest shift"):
        assert name in measures
    assert "ε, sum" not in measures, "what takes long is left to the command line"
    assert {line.replace("\\|", "").count("|") for line in measures.splitlines()[:-2]} == {4}
    assert "do not touch" in text.measure_table(grasp, in_contact=False)
    assert text.joint_table(grasp).count("\n") == len(grasp.problem.hand.joint_names) + 1
    assert "friction cone" in text.contact_details(grasp, 0)
    assert compare_table(grasp, grasp).count("|") > 20


def test_results_are_ranked_feasible_first(grasp):
    session = Session(grasp)
    worse = gp.Grasp(grasp.problem, grasp.joint_angles - 0.2, grasp.palm_pose, grasp.delta_sigma)
    assert session.add_result(worse)
    assert session.add_result(grasp)
    assert session.results[0] is grasp
    session.show_result(99)
    assert session.shown == 1


def test_the_presets_are_those_of_the_paper():
    presets = paper_presets()
    assert len(presets) == 11
    kinds = set()
    for preset in presets.values():
        problem = preset.problem()
        kinds.add((problem.n_synergies, problem.tasks[0].text, problem.parameters.force_weight))
        assert f"F = {preset.cell.force_norm:g} N" in preset.about
        assert problem.grasp_object == gp.Cylinder()
    axes = (("force:0,1,0", 1e-6), ("force:1,0,0", 1e-5))
    assert {(n, task, weight) for n in (1, 2, 3, 15) for task, weight in axes} <= kinds
    assert {(3, "force:0,1,0", ratio) for ratio in (1e-9, 1e-6, 1.0)} <= kinds


def test_a_feasible_grasp_whose_links_penetrate_says_so(grasp):
    assert "✔ clear of all links" in verdict_card(grasp)
    plain = replace(grasp.problem, clearance=gp.ClearanceOptions.off(), synergy_set="native", n_synergies=15)
    through = gp.plan_grasp(plain, options=gp.PlannerOptions(starts=4, enough=1))
    assert through.feasible
    depth = -min(entry.distance for entry in through.clearances if not entry.exempt)
    assert depth > 1e-3, "else this shows nothing"
    card = verdict_card(through)
    assert "✘ clear of all links" in card
    assert "leaves out clearances" in card
    assert "data-rungs='1'" in card


def test_limits_are_marked_where_joints_stop_a_synergy(grasp):
    problem, hand = grasp.problem, grasp.problem.hand
    besides = grasp.joint_angles - problem.synergies.joint_angles(grasp.sigma)
    for index, entry in enumerate(synergy_ranges(problem, grasp.sigma, besides)):
        assert entry.low <= grasp.sigma[index] <= entry.high
        for end, name in ((entry.low, entry.low_joint), (entry.high, entry.high_joint)):
            sigma = grasp.sigma.copy()
            sigma[index] = end
            q = problem.synergies.joint_angles(sigma) + besides
            assert (q >= hand.lower - 1e-9).all() and (q <= hand.upper + 1e-9).all()
            joint = hand.joint_index(name)
            assert min(abs(q[joint] - hand.lower[joint]), abs(q[joint] - hand.upper[joint])) < 1e-9


@pytest.mark.parametrize(
    ("low", "high", "marks"),
    [
        (-0.52, 1.35, [(-0.52, "−0.52"), (1.35, "1.35")]),
        (-9.0, 1.0, [(-2.0, "−2.00"), (1.0, "1.00")]),
        (0.1, 0.3, [(0.1, "0.10 … 0.30"), (0.3, None)]),
    ],
)
def test_marks_do_not_write_over_each_other(low, high, marks):
    found = limit_marks(SynergyRange(low, high, "a", "b"))
    assert [(mark.value, mark.label) for mark in found] == marks


def test_torques_are_drawn_along_the_joint_axes(grasp):
    arrows = torque_arrows(grasp)
    lengths = np.linalg.norm(arrows[:, 1] - arrows[:, 0], axis=1)
    assert np.allclose(lengths, look.TORQUE_SCALE * np.abs(grasp.joint_torques))


def test_clearances_are_shown_where_a_grasp_knows_them(grasp):
    near = SimpleNamespace(
        kind="link_object",
        link_a="index_medial",
        link_b="object",
        distance=-0.002,
        point_a=np.zeros(3),
        point_b=np.ones(3),
        exempt=False,
    )
    far = SimpleNamespace(**{**vars(near), "link_a": "palm", "distance": 0.2})
    meant = SimpleNamespace(**{**vars(near), "link_a": "index_distal", "exempt": True})
    knowing = SimpleNamespace(clearances=(near, far, meant))
    found = link_clearances(knowing)
    assert found["index_medial"] == (-0.002, "object")
    assert found["palm"] == (0.2, "object")
    assert "index_distal" not in found
    assert closest_lines(knowing).shape == (1, 2, 3)
    assert closest_lines(SimpleNamespace()).shape == (0, 2, 3)
