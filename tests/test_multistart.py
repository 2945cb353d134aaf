"""The batched springs problem, row by row, against the terms of the search, Pinocchio and central differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.evaluation.state import StateEvaluator
from grasp_planner.multistart import pool as pool_room
from grasp_planner.multistart.pool import Pool
from grasp_planner.multistart.problem_rows import UNITS, BatchedProblem
from grasp_planner.multistart.states import States
from grasp_planner.multistart.tree import BatchedTree
from grasp_planner.planning import pooled_starts as pooled_room
from grasp_planner.planning.pooled_starts import pooled_starts, pressing_states
from grasp_planner.planning.pooled_starts import random_states as some_states
from grasp_planner.planning.program import GraspProgram
from grasp_planner.planning.starts import random_start
from grasp_planner.spatial import Pose
from grasp_planner.terms.registry import problem_constraints

LOADS = gp.LoadCases(
    force=1.0,
    torque=0.01,
    position_error=1e-4,
    wrenches=((0.0, 1.0, 0.0, 0.01, 0.0, 0.0),),
    max_normal_force=8.0,
    max_force_norm=6.0,
)
OFF = gp.ClearanceOptions.off()
CASES = {
    "point cylinder": ("dlr_hit_ii_right", "point", "cylinder:radius=0.03", 3, OFF),
    "round box": ("dlr_hit_ii_right", "sphere", "box:x=0.05,y=0.06,z=0.08,edge=0.01", 1, OFF),
    "left capsule": ("dlr_hit_ii_left", "sphere", "capsule:radius=0.025,height=0.07", 15, OFF),
    "allegro": ("allegro_right", "sphere", "ellipsoid:x=0.025,y=0.035,z=0.05", 8, OFF),
    "tendons": ("tendon_hand", "sphere", "sphere:radius=0.03", 2, OFF),
    "capped": ("dlr_hit_ii_right", "point", "cylinder:radius=0.03,height=0.08,caps=1,edge=0.01", 5, OFF),
}
FROZEN = {"load_friction", "load_min_normal", "load_max_normal", "load_torque"}
"""Rows whose derivatives hold the hand's passive answer fixed."""


def make_problem(name: str, **changes: object) -> gp.GraspProblem:
    hand, contact_set, text, n_synergies, clearance = CASES[name]
    fields = {"clearance": clearance, "loads": LOADS, "n_synergies": n_synergies, "contact_set": contact_set}
    return gp.GraspProblem(gp.load_hand(hand), gp.parse_object(text), **(fields | changes))


def random_states(problem: gp.GraspProblem, rng: np.random.Generator, count: int) -> tuple[list, States]:
    """Return random starts with random postures and forces, and their states."""
    hand, starts = problem.hand, []
    for _ in range(count):
        start = random_start(problem, rng)
        q = hand.lower + rng.random(hand.n_joints) * (hand.upper - hand.lower)
        forces = rng.normal(0.0, 2.0, (len(problem.frames), 3))
        starts.append(replace(start, joint_angles=q, contact_forces=forces))
    states = States(
        np.array([start.joint_angles for start in starts]),
        np.array([start.palm_pose.rotation for start in starts]),
        np.array([start.palm_pose.translation for start in starts]),
        np.array([start.contact_forces @ start.palm_pose.rotation for start in starts]),
        rng.uniform(1.0, 9.0, count),
    )
    return starts, states


def in_palm(problem: gp.GraspProblem, start: object) -> tuple[object, np.ndarray]:
    """Return the search's state at a start, and the map from the palm's own twist to the chart of the search."""
    evaluator = StateEvaluator(problem, start.palm_pose)
    x = evaluator.pack(start.joint_angles, start.palm_pose, start.delta_sigma, start.contact_forces)
    turn, layout = np.eye(evaluator.layout.size), evaluator.layout
    rotation = np.array(start.palm_pose.rotation)
    turn[layout.translation, layout.translation] = turn[layout.rotation, layout.rotation] = rotation
    return evaluator.evaluate(x), turn


@pytest.mark.parametrize("name", CASES)
def test_rows_equal_the_terms_of_the_search(name, rng):
    """Values and derivatives to 1e-11 of their largest; equilibrium in the palm frame instead of the object's."""
    compare_rows(make_problem(name), rng)


def test_rows_equal_the_terms_where_joints_bend_each_other(rng):
    problem = make_problem("tendons")
    root = rng.normal(size=(7, 7))
    parameters = replace(problem.parameters, joint_compliance=tuple(map(tuple, (root @ root.T + np.eye(7)).tolist())))
    compare_rows(replace(problem, parameters=parameters), rng)


def compare_rows(problem, rng):
    starts, states = random_states(problem, rng, 4)
    found = {rows.name: rows for rows in BatchedProblem(problem).rows(states) if rows.value.size}
    room = found.pop("most_force")
    terms = {term.name: term for term in problem_constraints(problem)}
    assert set(found) == {name for name in terms if terms[name].residual(problem, in_palm(problem, starts[0])[0]).size}
    for row, start in enumerate(starts):
        state, turn = in_palm(problem, start)
        assert room.value[row] == pytest.approx(states.most_force[row] - state.force_norm, rel=1e-11)
        assert room.derivative[row, 0] == pytest.approx(-state.d_force_norm @ turn, rel=1e-9, abs=1e-9)
        for key, rows in found.items():
            value, slope = rows.value[row], rows.derivative[row]
            expected, expected_slope = terms[key].residual(problem, state), terms[key].jacobian(problem, state) @ turn
            if key.startswith("equilibrium"):
                rotation = states.rotation[row]
                angular = slice(problem.hand.n_joints + 3, problem.hand.n_joints + 6)
                skews = np.cross(np.eye(3), value)
                slope = rotation @ slope
                slope[:, angular] += rotation @ skews.T  # the frame turns with the palm
                value = rotation @ value
            if key in {"load_min_normal", "load_max_normal", "load_torque"}:
                # The search has a block for each listed case and sphere; here stands the worst of them.
                blocks = expected.reshape(-1, value.size) if key != "load_torque" else None
                if blocks is not None:
                    np.testing.assert_allclose(value, blocks.min(axis=0), atol=1e-8)
                continue
            scale = max(1.0, float(np.abs(expected).max()))
            np.testing.assert_allclose(value, expected, atol=1e-11 * scale, err_msg=key)
            if key not in FROZEN:
                scale = max(1.0, float(np.abs(expected_slope).max()))
                np.testing.assert_allclose(slope, expected_slope, atol=1e-11 * scale, err_msg=key)


@pytest.mark.parametrize("hand_name", ["dlr_hit_ii_right", "allegro_right", "tendon_hand"])
def test_the_tree_equals_pinocchio(hand_name, rng):
    hand = gp.load_hand(hand_name)
    tree, q = BatchedTree(hand), rng.uniform(-0.5, 0.5, (3, hand.n_joints))
    placed, data = tree.place(q), hand.model.createData()
    joints = np.arange(1, hand.model.njoints)
    velocities = tree.velocities(placed, placed.translations[:, joints], joints)
    inverse = hand.palm_in_root.inverse()
    for row in range(3):
        pin.computeJointJacobians(hand.model, data, hand.full_configuration(q[row]))
        for joint in joints:
            pose = inverse * Pose.of(data.oMi[int(joint)])
            np.testing.assert_allclose(placed.rotations[row, joint], pose.rotation, atol=1e-12)
            np.testing.assert_allclose(placed.translations[row, joint], pose.translation, atol=1e-12)
            jacobian = pin.getJointJacobian(hand.model, data, int(joint), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            linear = np.array(inverse.rotation) @ jacobian[:3]
            np.testing.assert_allclose(velocities[row, joint - 1].T, linear, atol=1e-12)


def clear_problem(**options: object) -> gp.GraspProblem:
    clearance = gp.ClearanceOptions(**options)
    return make_problem("round box", clearance=clearance, loads=gp.LoadCases(), n_synergies=3)


@pytest.mark.parametrize("options", [{}, {"ground": -0.05}, {"link_object": "joint_centres"}])
def test_clearance_rows_by_central_differences(options, rng):
    """Where the same solids stay the closest, steps of the state change distances as the derivatives say."""
    problem = clear_problem(**options)
    batched = BatchedProblem(problem)
    _, states = random_states(problem, rng, 6)
    wide = np.full(problem.hand.n_joints, np.inf)
    names = [rows.name for rows in batched.rows(states)]
    assert {"self_collision", "tip_patch"} <= set(names)
    checked = 0
    for index, name in enumerate(names):
        if UNITS[name].symbol not in ("m", "1"):
            continue
        derivative = batched.rows(states)[index].derivative
        for column in range(problem.hand.n_joints + 6):
            step = np.zeros((len(states), batched.n_variables))
            step[:, column] = 1e-6
            up = batched.rows(states.stepped(step, -wide, wide))[index].value
            down = batched.rows(states.stepped(-step, -wide, wide))[index].value
            error = np.abs((up - down) / 2e-6 - derivative[:, :, column])
            checked += error.size
            assert np.median(error) < 1e-6
            assert (error < 1e-4 * max(1.0, np.abs(derivative).max())).mean() > 0.97, (name, column)
    assert checked > 500


def test_what_the_pool_finds_is_feasible_for_the_search(rng):
    """Without solids other than capsules the two sides agree; what is left is for the exact distances to settle."""
    problem = make_problem("point cylinder", loads=gp.LoadCases())
    starts = pooled_starts(problem, rng)
    for _ in range(3):
        start = next(starts)
        program = GraspProgram(problem, start.palm_pose)
        z = program.pack(start.joint_angles, start.palm_pose, start.delta_sigma, start.contact_forces)
        assert program.merit(z) < 1e-4


def test_a_start_that_is_not_finite_is_dropped_and_counted(rng):
    problem = make_problem("point cylinder", loads=gp.LoadCases.off())
    _, states = random_states(problem, rng, 8)
    broken = np.array(states.joints)
    broken[3] = np.nan
    pool = Pool(BatchedProblem(problem), 8)
    found = list(pool.search(lambda number: replace(states, joints=broken), 8, lambda: None))
    assert pool.count.not_finite == 1
    assert pool.count.starts == 8
    assert pool.count.found == len(found)
    assert pool.count.found + pool.count.dropped == 7


def test_a_pool_wider_than_memory_shrinks_and_goes_on(rng):
    """Of the ten million states asked for, some thousands fit; every start that is asked for is still taken."""
    problem = make_problem("point cylinder", loads=gp.LoadCases.off())
    batched = BatchedProblem(problem)
    pool, asked = Pool(batched, 10_000_000), []

    def make(number):
        asked.append(number)
        return some_states(batched, number, rng)

    found = list(pool.search(make, 200, lambda: None))
    assert asked[0] == pool_room.FIRST
    assert 100 < pool.width < 1_000_000
    assert pool.count.starts == sum(asked) == 200
    assert pool.count.found == len(found) > 0


def test_memory_for_one_state_is_always_asked_for(rng, monkeypatch):
    problem = make_problem("point cylinder", loads=gp.LoadCases.off())
    batched = BatchedProblem(problem)
    monkeypatch.setattr(pool_room, "MOST_BYTES", 1.0)
    pool = Pool(batched, 8)
    assert list(pool.search(lambda number: some_states(batched, number, rng), 12, lambda: None)) is not None
    assert (pool.width, pool.count.starts) == (1, 12)


def test_what_came_near_is_tried_when_nothing_is_found(rng, monkeypatch):
    """The pool remembers the nearest states that it drops; a round without any feasible one hands on these."""
    problem = make_problem("point cylinder", loads=gp.LoadCases())
    monkeypatch.setattr(pool_room, "SOLVED", 0.0)
    monkeypatch.setattr(pool_room, "REMEMBERED", 4)
    monkeypatch.setattr(pooled_room, "NEARLY", np.inf)
    monkeypatch.setattr(pooled_room, "force_closed", lambda batched, found: True)
    pool = Pool(BatchedProblem(problem), 8)
    starts = [gp.random_start(problem, rng) for _ in range(8)]
    assert list(pool.search(lambda _: pressing_states(pool.batched, starts), 8, lambda: None)) == []
    costs = [cost for cost, _ in pool.nearest]
    assert len(costs) == pool_room.REMEMBERED and costs == sorted(costs)
    monkeypatch.setattr(pooled_room, "ROUND", 8)
    handed = pooled_starts(problem, rng)
    assert all(next(handed).prepared for _ in range(pooled_room.HANDED))
    monkeypatch.setattr(pooled_room, "NEARLY", 0.0)
    assert not next(pooled_starts(problem, rng)).prepared


def test_the_same_seed_gives_the_same_starts():
    problem = make_problem("point cylinder", loads=gp.LoadCases.off())
    first, second = (next(pooled_starts(problem, np.random.default_rng(7))) for _ in range(2))
    assert first == second
