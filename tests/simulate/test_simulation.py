"""What holds and what does not."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.analysis.off_plan import Errors, off_plan, resized
from grasp_planner.closing.path import free_posture, reference_path
from grasp_planner.simulate import (
    PROTOCOLS,
    Protocol,
    World,
    find_protocol,
    protocol_from,
    simulate_grasp,
    simulation_json,
    survival,
)
from grasp_planner.simulate.gate import check_posture


def test_a_squeezed_grasp_holds(held, tips_only):
    found = simulate_grasp(held, tips_only, squeeze=2.0, ladder=False)
    assert found.passed, found.verdict
    assert found.forces_held == 6
    assert found.rest.displacement < 2e-4
    np.testing.assert_allclose(found.rest.forces.sum(axis=0), -found.grasp.problem.external_wrench[:3], atol=1e-3)


def test_where_nothing_slips_forces_are_those_predicted(held, tips_only):
    found = simulate_grasp(held, replace(tips_only, friction=1.2, hold_s=0.2), squeeze=2.0, ladder=False)
    assert found.rest.displacement < 1e-5
    np.testing.assert_allclose(found.rest.normal_forces, found.grasp.normal_forces, rtol=0.02)
    np.testing.assert_allclose(found.rest.forces, found.grasp.forces, atol=0.1)
    np.testing.assert_allclose(found.rest.forces.sum(axis=0), -found.grasp.problem.external_wrench[:3], atol=1e-3)
    assert found.surface_error < 1e-6


def test_with_a_little_more_friction_than_planned_the_plan_itself_rests_where_it_should(held, tips_only):
    found = simulate_grasp(held, replace(tips_only, friction=0.88, hold_s=0.2), ladder=False)
    assert found.rest.displacement < 5e-5
    assert found.rest.normal_force_error < 0.05


def test_less_friction_than_planned_loses_the_object(held, tips_only):
    found = simulate_grasp(held, replace(tips_only, friction=0.2, hold_s=0.2), squeeze=2.0, ladder=False)
    assert not found.passed
    assert not found.rest.held


def test_closing_from_an_open_hand_ends_in_the_grasp(held, tips_only):
    found = simulate_grasp(held, replace(tips_only, start="open"), squeeze=2.0, ladder=False)
    assert found.passed, found.verdict
    assert found.rest.displacement < 1e-3


def test_the_open_hand_is_clear_of_the_object(held):
    path = reference_path(held)
    report = check_posture(held, free_posture(held, path.open), "open", "contacts", 1e-3)
    assert report.object_overlap == 0.0
    np.testing.assert_array_equal(path.squeezing, held.sigma)


def test_an_open_hand_loses_the_object(held, tips_only):
    q = free_posture(held, reference_path(held).open)
    opened = gp.Grasp(held.problem, q, held.palm_pose, np.zeros(15))
    found = simulate_grasp(opened, replace(tips_only, hold_s=0.2), ladder=False)
    assert not found.passed
    assert not found.rest.held
    assert "lost before any push" in found.verdict


def test_a_buried_hand_is_refused(held, tips_only):
    shifted = held.palm_pose.se3()
    shifted.translation = shifted.translation - 0.02 * held.contacts.normals[0]
    buried = gp.Grasp(held.problem, held.joint_angles, shifted, held.delta_sigma)
    found = simulate_grasp(buried, tips_only)
    assert not found.gate_passed
    assert found.rest is None
    assert found.directions == ()
    assert "overlaps the object" in found.verdict


def test_links_in_the_object_are_refused(planned):
    found = simulate_grasp(planned, find_protocol("plan"))
    assert planned.overlap("link_object") > 1e-3  # planned without clearances
    assert not found.passed
    assert found.gates[0].object_overlap == pytest.approx(planned.overlap("link_object"))


def test_the_same_simulation_twice_is_the_same(held, tips_only):
    quick = replace(tips_only, hold_s=0.2, torques=False)
    first, second = (simulation_json(simulate_grasp(held, quick, squeeze=2.0, ladder=False)) for _ in range(2))
    assert first == second
    assert json.loads(first)["protocol"]["friction"] is None


def test_the_ladder_brackets_the_load_that_is_lost(held, tips_only):
    found = simulate_grasp(held, replace(tips_only, hold_s=0.2, torques=False, ladder_accuracy=0.2), squeeze=2.0)
    for report in found.directions:
        assert 0.0 < report.load_held < report.load_lost
        assert report.load_lost - report.load_held <= 0.2 * report.load_lost
    assert found.weakest("force") == min(report.load_held for report in found.directions)
    # More than all friction cones together can give along the axis is never held.
    limit = found.friction * np.linalg.norm(found.grasp.forces, axis=1).sum() * 3
    assert found.weakest("force") < limit


@pytest.mark.slow
def test_the_benchmark_protocol_runs(held):
    protocol = replace(find_protocol("dexgraspbench"), geometry="contacts")
    found = simulate_grasp(held, protocol, squeeze=2.0, ladder=False)
    assert found.mass == 0.1
    assert found.friction == 0.6
    assert found.passed, found.verdict


def test_the_numbers_of_the_benchmark_protocol():
    protocol = PROTOCOLS["dexgraspbench"]
    assert (protocol.mass, protocol.friction, protocol.gravity, protocol.force) == (0.1, 0.6, False, 1.0)
    assert (protocol.hold_s, protocol.max_displacement, protocol.max_rotation_deg) == (2.0, 0.05, 15.0)
    np.testing.assert_allclose(protocol.check_times, 0.2 * np.arange(1, 11))
    assert PROTOCOLS["dexgraspbench-hard"].friction == 0.3


@pytest.mark.parametrize(
    ("fields", "message"),
    [({"mass": -1.0}, "mass"), ({"timestep": 0.1}, "timestep"), ({"geometry": "all"}, "geometry")],
)
def test_wrong_protocols(fields, message):
    with pytest.raises(gp.GraspPlannerError, match=message):
        Protocol("mine", **fields)


def test_protocols_survive_json():
    protocol = PROTOCOLS["dexgraspbench"]
    assert protocol_from(json.loads(json.dumps(protocol.__dict__))) == protocol
    with pytest.raises(gp.NameNotFoundError, match="wind"):
        protocol_from({"wind": 1.0})


def test_a_simulation_that_diverges_has_lost_the_object_and_leaves_no_log(held, tips_only, tmp_path, monkeypatch):
    from grasp_planner.simulate import World
    from grasp_planner.simulate.engine import quiet_warnings

    monkeypatch.chdir(tmp_path)
    world = World(held, tips_only)
    world.reset(held.joint_angles, held.sigma)
    world.data.qvel[:] = 1e11
    with quiet_warnings():
        world.run(0.01)
    assert not world.within_limits
    assert not list(tmp_path.iterdir())


def test_a_hand_closes_around_a_free_object_that_weighs_once_it_is_closed(held):
    protocol = replace(find_protocol("free"), geometry="contacts", hold_s=0.2)
    world = World(held, protocol)
    world.weigh(False)
    np.testing.assert_array_equal(world.model.opt.gravity, 0.0)
    world.weigh(True)
    np.testing.assert_array_equal(world.model.opt.gravity, held.problem.parameters.gravity)
    found = simulate_grasp(held, protocol, squeeze=2.0, ladder=False)
    assert found.rest.held
    np.testing.assert_allclose(found.rest.forces.sum(axis=0), -held.problem.external_wrench[:3], atol=0.05)


def test_dry_friction_of_the_joints_is_in_the_scene(held, tips_only):
    world = World(held, replace(tips_only, joint_friction=0.01))
    np.testing.assert_array_equal(np.unique(world.model.dof_frictionloss), [0.0, 0.01])
    assert (world.model.dof_frictionloss == 0.01).sum() == held.problem.hand.n_joints


def test_what_is_off_the_plan_is_off_by_the_errors(held):
    rng = np.random.default_rng(0)
    off = off_plan(held, Errors(palm=2e-3, turn_deg=2.0, radius=1e-3), -1.0, rng)
    assert np.linalg.norm(off.palm_pose.translation - held.palm_pose.translation) == pytest.approx(2e-3)
    turn = off.palm_pose.rotation @ held.palm_pose.rotation.T
    assert np.degrees(np.arccos((np.trace(turn) - 1.0) / 2.0)) == pytest.approx(2.0)
    assert off.problem.grasp_object.radius == pytest.approx(held.problem.grasp_object.radius - 1e-3)
    same = off_plan(held, Errors(), 1.0, rng)
    np.testing.assert_allclose(same.palm_pose.rotation, held.palm_pose.rotation, atol=1e-12)


def test_a_box_grows_on_both_sides():
    box = resized(gp.Box(x=0.04, y=0.05, z=0.06), 1e-3)
    assert (box.x, box.y, box.z) == pytest.approx((0.042, 0.052, 0.062))


def test_the_table_of_survival_is_seeded_and_says_what_fails(held, monkeypatch):
    seen = []

    def tested(grasp, protocol, *, path, ladder=True):
        seen.append((grasp.palm_pose.translation.tolist(), protocol.mass, protocol.friction, protocol.table, path))
        what = {"is_another_object": False, "gate_passed": True, "rest": None}
        return SimpleNamespace(passed=protocol.friction is None, verdict="failed", **what)

    monkeypatch.setattr("grasp_planner.simulate.off_plan.simulate_grasp", tested)
    rows = {row.name: row for row in survival(held, seed=3, samples=2)}
    first = list(seen)
    assert rows["as planned"].survived == rows["as planned"].tried == 1
    assert rows["palm 2 mm, 2°"].tried == 2
    assert (rows["all at once"].survived, rows["all at once"].worst) == (0, "failed")
    assert all(path is held.closing.path for *_, path in seen)
    seen.clear()
    survival(held, seed=3, samples=2)
    assert [each[0] for each in seen] == [each[0] for each in first]
    assert not any(each[3] for each in seen[:-1])
    seen.clear()
    survival(held, seed=3, samples=2, protocol=PROTOCOLS["table"])
    assert [each[0] for each in seen] == [each[0] for each in first]
    assert all(each[3] for each in seen)
