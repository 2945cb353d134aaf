"""Starts near grasps that were found."""

from __future__ import annotations

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.multistart.pool import Pool
from grasp_planner.multistart.problem_rows import BatchedProblem
from grasp_planner.planning.neighbours import LESS_FORCE, NearGrasps
from grasp_planner.planning.planner import plan_grasps
from grasp_planner.planning.ranking import alike
from grasp_planner.problem.search_options import PlannerOptions

OFF = {"clearance": gp.ClearanceOptions.off(), "loads": gp.LoadCases.off()}
POINTS = PlannerOptions(solver="none", enough=1, starts=400)


@pytest.fixture(scope="module")
def problem() -> gp.GraspProblem:
    hand, cylinder = gp.load_hand("dlr_hit_ii_right"), gp.parse_object("cylinder:radius=0.03,height=0.15,mass=0.2")
    return gp.GraspProblem(hand, cylinder, n_synergies=3, contact_set="point", **OFF)


@pytest.fixture(scope="module")
def grasps(problem) -> tuple[gp.Grasp, ...]:
    return plan_grasps(problem, 12, seed=1, options=POINTS)


def test_a_start_is_near_a_grasp_along_its_synergies(problem, grasps, rng):
    near = NearGrasps(problem)
    near.add(grasps[0])
    states = near.states(200, rng)
    bend = states.joints - grasps[0].joint_angles
    inside = (states.joints > problem.hand.lower) & (states.joints < problem.hand.upper)
    free = inside.all(axis=1)
    assert free.sum() > 20
    np.testing.assert_allclose(bend[free] @ problem.synergies.complement(), 0.0, atol=1e-12)
    assert 0.01 < bend.std() < 0.05
    assert 0.002 < (states.translation - grasps[0].palm_pose.translation).std() < 0.008
    share = states.most_force / grasps[0].force_norm
    assert LESS_FORCE[0] <= share.min() < 0.7 < 1.1 < share.max() <= LESS_FORCE[1]
    # The forces turn with the palm, as seen from it they are those of the grasp.
    np.testing.assert_allclose(states.forces[5], grasps[0].forces @ grasps[0].palm_pose.rotation, atol=1e-12)


def test_what_is_found_from_there_takes_no_more_than_it_may(problem, grasps, rng):
    near, batched = NearGrasps(problem), BatchedProblem(problem)
    parents = sorted(grasps, key=lambda grasp: grasp.force_norm)[-4:]
    for grasp in parents:
        near.add(grasp)
    found = list(Pool(batched, 16).search(lambda number: near.states(number, rng), 64, lambda: None))
    assert len(found) > 20
    forces = [batched.contacts(each).force_norm[0] for each in found]
    assert all(force <= each.most_force[0] for force, each in zip(forces, found, strict=True))
    assert np.median(forces) < np.median([grasp.force_norm for grasp in parents])


def test_of_grasps_that_are_alike_the_one_with_the_least_force_is_remembered(problem, grasps, monkeypatch):
    near = NearGrasps(problem)
    for grasp in (*grasps, *grasps):
        near.add(grasp)
    assert len(near) == len(grasps)
    forces = sorted(grasp.force_norm for grasp in grasps)
    worse = gp.Grasp(problem, grasps[0].joint_angles, grasps[0].palm_pose, grasps[0].delta_sigma, 2 * grasps[0].forces)
    near.add(worse)
    alone = NearGrasps(problem)
    alone.add(worse)
    alone.add(grasps[0])
    for each, expected in ((near, min(forces)), (alone, grasps[0].force_norm)):
        asked = each.states(300, np.random.default_rng(0)).most_force
        assert LESS_FORCE[0] * expected <= asked.min() < 0.7 * expected
    assert len(alone) == 1
    monkeypatch.setattr("grasp_planner.planning.neighbours.MOST_GRASPS", 3)
    few = NearGrasps(problem)
    for grasp in grasps:
        few.add(grasp)
    assert len(few) == 3
    assert few.states(300, np.random.default_rng(0)).most_force.max() <= LESS_FORCE[1] * forces[2]


@pytest.mark.parametrize("text", ["cylinder:radius=0.03,height=0.15", "sphere:radius=0.035"])
def test_many_grasps_of_a_problem_are_feasible_and_differ(problem, text):
    """Most of what is tried is feasible, as it is near what was; links keep clear and pushes are withstood."""
    asked = gp.GraspProblem(problem.hand, gp.parse_object(text), n_synergies=3)
    grasps = plan_grasps(asked, 10, options=POINTS)
    assert len(grasps) == 10 and all(grasp.feasible for grasp in grasps)
    assert not any(alike(a, b) for i, a in enumerate(grasps) for b in grasps[:i])
    report = grasps[0].search
    assert report is not None and report.starts_feasible >= 0.5 * report.starts_tried
