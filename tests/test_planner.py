"""Planning the paper's case and others; what happens when no grasp exists; stopping."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.planning.attempt import AttemptSolver
from grasp_planner.studies.benchmark import plan_case
from grasp_planner.studies.benchmark_problems import BenchmarkCase

PAPER = {  # [Mavrogiannis2014] table I: F [N] and angle [°] with all 15 synergies
    "y": ([0.0, 1.0, 0.0], 1e-6, 1.97, 3.43),
    "x": ([1.0, 0.0, 0.0], 1e-5, 2.36, 1.77),
}


@pytest.mark.parametrize("case", PAPER)
def test_fifteen_synergies_beat_the_papers_table_from_the_infeasible_start(right, case):
    direction, weight, force, angle = PAPER[case]
    parameters = gp.GraspParameters(force_weight=weight)
    problem = gp.GraspProblem.paper(right, gp.Cylinder(), (gp.force_task(direction),), 15, parameters)
    start = gp.standard_start(problem)
    at_start = gp.Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma)
    assert at_start.contacts.gaps.min() > 0.001, "the start has no contact"
    grasp = gp.plan_grasp(problem)
    assert grasp.feasible
    assert grasp.max_violation < 1e-6
    assert grasp.force_norm <= force
    assert grasp.alignments[0][0] <= angle
    assert grasp.force_norm_floor <= grasp.force_norm * (1 + 1e-6)


def test_three_synergies_give_a_verified_grasp(planned):
    assert planned.feasible
    assert planned.force_closed
    assert planned.friction_margins.min() >= 0.0
    np.testing.assert_allclose(
        planned.grasp_matrix @ planned.forces.ravel(), -planned.problem.external_wrench, atol=1e-9
    )
    soft = planned.reference_joint_angles - 0.1 * planned.joint_torques
    np.testing.assert_allclose(planned.joint_angles, soft, atol=1e-9)


def test_the_planned_posture_is_the_fixed_point_of_the_soft_hand(planned):
    """Relaxing the hand from its reference with the planned torques gives the planned posture; eq. (10)."""
    forces = planned.forces.ravel()
    problem = planned.problem

    def torques(q):
        jacobian = gp.model.hand_jacobian(problem.hand, problem.frames, q, planned.palm_pose, planned.contacts.points)
        return gp.model.joint_torques(jacobian, forces)

    q = gp.model.actual_posture(planned.reference_joint_angles, problem.joint_compliance, torques)
    np.testing.assert_allclose(q, planned.joint_angles, atol=1e-8)


@pytest.mark.parametrize("contact_set", ["point", "sphere"])
@pytest.mark.parametrize("grasp_object", [gp.Sphere(radius=0.035), gp.Box(edge=0.01)], ids=["sphere", "box"])
def test_other_objects_and_fingertips(right, grasp_object, contact_set):
    problem = gp.GraspProblem.paper(right, grasp_object, (gp.force_task([1, 0, 1]),), 6, contact_set=contact_set)
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(enough=1))
    assert grasp.feasible, grasp.verdict


def test_a_torque_and_a_twist_task(right):
    tasks = (gp.torque_task([0, 0, 1], 1e-3), gp.twist_task([0, 0, 1, 0, 0, 0], 1e-6))
    problem = gp.GraspProblem.paper(right, gp.Cylinder(), tasks, 8)
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(enough=1))
    assert grasp.feasible, grasp.verdict
    assert len(grasp.transmission_ratios) == 2


def test_the_papers_torque_model(right):
    parameters = gp.GraspParameters(torque_model="internal")
    problem = gp.GraspProblem.paper(right, gp.Cylinder(), n_synergies=5, parameters=parameters)
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(enough=1))
    assert grasp.feasible, grasp.verdict


def test_left_hand_plans_too():
    problem = gp.GraspProblem.paper(gp.load_hand("dlr_hit_ii_left"), gp.Cylinder(), n_synergies=5)
    assert gp.plan_grasp(problem, options=gp.PlannerOptions(enough=1)).feasible


def test_same_seed_same_grasp(right):
    problem = gp.GraspProblem.paper(right, gp.Sphere(), n_synergies=5)
    options = gp.PlannerOptions(starts=3, enough=3, max_iterations=12)  # random starts too; they need not arrive
    first, second = (gp.plan_grasp(problem, seed=7, options=options) for _ in range(2))
    assert first.search.starts_tried == 3
    np.testing.assert_array_equal(first.joint_angles, second.joint_angles)
    np.testing.assert_array_equal(first.delta_sigma, second.delta_sigma)
    assert first.search.starts_tried == second.search.starts_tried


def test_forces_scale_with_the_weight_of_the_object(right, planned):
    """Twice the mass with twice the displacement doubles every contact force."""
    heavy = gp.GraspProblem.paper(right, gp.Cylinder(mass=0.4))
    doubled = gp.Grasp(heavy, planned.joint_angles, planned.palm_pose, 2 * planned.delta_sigma)
    np.testing.assert_allclose(doubled.forces, 2 * planned.forces, rtol=1e-8, atol=1e-8)


def test_an_impossible_grasp_returns_the_best_attempt_and_says_what_fails(right):
    """A cylinder of 30 cm radius without friction worth speaking of can't be held."""
    problem = gp.GraspProblem.paper(
        right, gp.Cylinder(radius=0.3), n_synergies=2, parameters=gp.GraspParameters(friction=0.05)
    )
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(starts=3, max_iterations=60))
    assert not grasp.feasible
    assert grasp.status == "infeasible"
    failures = grasp.failures()
    assert failures or not grasp.force_closed
    for name, found in failures.items():
        assert f"{name} {found.value:.3g} {found.unit.symbol}" in grasp.verdict


def test_callback_sees_every_iteration_and_the_history_is_kept(right):
    records = []
    problem = gp.GraspProblem.paper(right, gp.Sphere(), n_synergies=15)
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(starts=1), callback=records.append)
    assert [record.iteration for record in records if record.phase == "two"] == list(
        range(1, grasp.search.iterations + 1)
    )
    last = grasp.search.history[-1]
    assert last.force_norm == pytest.approx(grasp.force_norm, rel=1e-6)
    assert {"surface", "compliance", "friction", "region"} <= set(last.violations)


def test_cancelling_returns_the_best_so_far(right):
    calls = []

    def cancel():
        calls.append(1)
        return len(calls) > 20

    problem = gp.GraspProblem.paper(right, gp.Cylinder(), n_synergies=2)
    grasp = gp.plan_grasp(problem, cancel=cancel)
    assert grasp.search.cancelled
    assert grasp.status in ("cancelled", "feasible")
    assert grasp.search.iterations + grasp.search.phase_one_iterations <= 20


def test_a_time_limit_ends_the_search(right):
    problem = gp.GraspProblem.paper(right, gp.Cylinder(radius=0.3), n_synergies=1)
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(starts=10_000, enough=10_000, time_limit_s=0.5))
    assert grasp.search.time_s < 5.0
    assert grasp.search.starts_tried < 10_000


def test_a_given_start_is_used(right, planned):
    start = gp.GraspStart(planned.joint_angles, planned.palm_pose, planned.delta_sigma)
    again = gp.plan_grasp(planned.problem, start=start, options=gp.PlannerOptions(starts=1))
    assert again.feasible
    assert again.objective <= planned.objective * (1 + 1e-6)


@pytest.mark.parametrize("field", ["starts", "enough", "max_iterations", "tolerance", "time_limit_s"])
def test_bad_options_are_named(field):
    with pytest.raises(gp.InvalidValueError) as caught:
        gp.PlannerOptions(**{field: 0})
    assert caught.value.field == field


@pytest.mark.slow
@pytest.mark.parametrize(("n_s", "least"), [(15, 7), (5, 7), (3, 6)])
def test_most_random_problems_are_solved(right, n_s, least):
    """Eight of the benchmark's random problems; the benchmark does a hundred."""
    results = [plan_case(BenchmarkCase(seed, n_s), 60.0, 1) for seed in range(8)]
    assert sum(result.feasible for result in results) >= least


@pytest.mark.parametrize("law", ["springs", "controllable"])
@pytest.mark.parametrize("n_synergies", [3, 15])
def test_without_a_solver_grasps_are_taken_as_they_are_found(law, n_synergies):
    """No phase two, no search for little force, no closing: several feasible grasps of one problem, all different."""
    problem = BenchmarkCase(0, n_synergies).problem()
    problem = replace(problem, parameters=replace(problem.parameters, force_law=law))
    options = gp.PlannerOptions(enough=1, solver="none", starts=200)
    found = gp.plan_grasps(problem, 4, seed=1, options=options)
    assert all(grasp.feasible for grasp in found)
    assert len(found) == 4
    assert all(record.phase == "one" for grasp in found for record in grasp.search.history)
    assert not any("closing" in vars(grasp) for grasp in found)
    best = gp.plan_grasp(problem, seed=1, options=replace(options, enough=6))
    assert best.search.least_force <= best.force_norm <= 1.5 * best.search.least_force * (1.0 + 1e-9)


def test_what_phase_one_found_is_not_lost(right, monkeypatch):
    """Where phase two spoils every start, a feasible point that one of them began from is the grasp."""
    problem = gp.GraspProblem(
        right, gp.Cylinder(radius=0.03, height=0.15, mass=0.2), clearance=gp.ClearanceOptions.off()
    )
    run = AttemptSolver._run

    def spoiled(self, attempt, phase):
        if phase == "one":
            return run(self, attempt, phase)
        attempt.z = attempt.z + 1.0
        return None

    monkeypatch.setattr(AttemptSolver, "_run", spoiled)
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(starts=3))
    assert grasp.feasible
    assert grasp.search.starts_feasible == 1
    assert grasp.search.starts_tried == 3
