"""Grasps moved towards each other: derivatives, that they stay grasps, and that they come to share a subspace."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.evaluation.state import StateEvaluator
from grasp_planner.synergy_design import compact as compact
from tests.finite_differences import central_differences, relative_error
from tests.test_state import make_problem, random_point, steps_of


def free_problem(hand, grasp_object, **options):
    problem = gp.GraspProblem.paper(hand, grasp_object, (gp.force_task([0.0, 1.0, 0.0]),), 3, **options)
    return compact.fully_actuated_problem(problem)


def grasp_of(problem, free):
    return gp.Grasp(problem, free.joint_angles, pin.SE3(free.palm_pose), free.displacement)


@pytest.mark.parametrize("law", ["controllable", "springs"])
@pytest.mark.parametrize("contact_set", ["point", "sphere"])
def test_derivatives_of_the_distance(hand, contact_set, law, rng):
    problem = compact.fully_actuated_problem(make_problem(hand, gp.Sphere(0.035), contact_set, "force"))
    problem = replace(problem, parameters=replace(problem.parameters, force_law=law))
    evaluator, x = random_point(problem, rng)
    joints = hand.n_joints
    scatter = compact.Scatter(rng.normal(size=joints), np.diag(rng.uniform(0.0, 0.1, joints)))
    cost = compact.SpanDistance(scatter.mean, scatter.metric(0.05), compact.displacement_scale(problem))
    numeric = central_differences(lambda y: [cost.value(problem, evaluator.evaluate(y))], x, steps_of(evaluator.layout))
    assert relative_error(cost.gradient(problem, evaluator.evaluate(x)), numeric) < 1e-6


@pytest.fixture(scope="module")
def grasps(right):
    """Fully actuated grasps of three spheres, with their problems."""
    problems = [free_problem(right, gp.Sphere(radius)) for radius in (0.033, 0.037, 0.041)]
    options = gp.PlannerOptions(starts=10, enough=1)
    planned = [gp.plan_grasp(problem, seed=1, options=options) for problem in problems]
    assert all(grasp.feasible for grasp in planned)
    return problems, [compact.free_grasp(grasp) for grasp in planned]


def test_grasps_come_to_share_a_subspace_and_stay_grasps(grasps):
    problems, moved = grasps
    scale = compact.displacement_scale(problems[0])
    scatter = compact.scatter_of(moved, 0.0)
    for epsilon in (0.1, 0.05, 0.03, 0.02):
        moved = [compact.moved_closer(p, g, scatter, epsilon) for p, g in zip(problems, moved, strict=True)]
        scatter = compact.scatter_of(moved, scale)

    def outside_one(found):
        references = np.array([grasp.reference for grasp in found])
        sizes = np.linalg.svd(references - references.mean(axis=0), compute_uv=False)
        return np.linalg.norm(sizes[1:])

    assert outside_one(moved) < 0.35 * outside_one(grasps[1])
    for problem, free in zip(problems, moved, strict=True):
        grasp = grasp_of(problem, free)
        assert grasp.is_feasible(1e-4), grasp.violations
        np.testing.assert_allclose(grasp.reference_joint_angles, free.reference, atol=1e-9)
        assert np.isfinite(free.distance)


def test_a_grasp_far_from_its_object_stays_as_it_is(grasps):
    problems, (first, *_) = grasps
    away = np.array(first.palm_pose)
    away[:3, 3] += 0.5
    lost = replace(first, palm_pose=away)
    found = compact.moved_closer(problems[0], lost, compact.scatter_of(grasps[1], 0.0), 0.1)
    np.testing.assert_array_equal(found.joint_angles, lost.joint_angles)
    assert np.isfinite(found.distance)


def test_springs_come_to_share_a_line_and_the_set_is_that_line(right):
    """Moved in a flattened scatter, the references of three grasps end on one line: one motor does for all."""
    problems = [gp.GraspProblem(right, gp.Sphere(radius), n_synergies=1) for radius in (0.034, 0.038, 0.042)]
    free = [compact.fully_actuated_problem(problem) for problem in problems]
    planned = [gp.plan_grasp(p, seed=1, options=gp.PlannerOptions(starts=20, enough=1)) for p in free]
    assert all(grasp.feasible for grasp in planned)
    moved = [compact.free_grasp(grasp) for grasp in planned]
    scatter = compact.scatter_of(moved, 0.0)
    for epsilon in (0.1, 0.05, 0.02, 0.01, 0.005):
        flat = scatter.flattened(1)
        moved = [compact.moved_closer(p, g, flat, epsilon) for p, g in zip(free, moved, strict=True)]
        scatter = compact.scatter_of(moved, 0.0)
    line = gp.SynergySpace(right.joint_names, scatter.mean, scatter.directions(1))
    for problem, each in zip(problems, moved, strict=True):
        away = each.reference - line.joint_angles(line.coordinates(each.reference))
        assert np.abs(away).max() < np.radians(0.2)
        grasp = gp.Grasp(
            compact.fully_actuated_problem(problem),
            each.joint_angles,
            pin.SE3(each.palm_pose),
            np.zeros(right.n_joints),
            contact_forces=each.contact_forces,
        )
        assert grasp.is_feasible(1e-3), grasp.violations


def test_a_flattened_scatter_keeps_its_widest_directions(rng):
    axes, _ = np.linalg.qr(rng.normal(size=(5, 5)))
    scatter = compact.Scatter(np.zeros(5), (axes * np.array([4.0, 3.0, 2.0, 1.0, 0.5])) @ axes.T)
    flat = scatter.flattened(2)
    np.testing.assert_allclose(np.linalg.eigvalsh(flat.covariance), [0.0, 0.0, 0.0, 3.0, 4.0], atol=1e-12)
    widest = scatter.directions(2)
    np.testing.assert_allclose(np.abs(widest.T @ axes), np.eye(2, 5), atol=1e-12)
    assert (widest.sum(axis=0) > 0.0).all()


def test_the_set_begins_with_what_grasps_share(rng):
    names = tuple("abcdef")
    shared, _ = np.linalg.qr(rng.normal(size=(6, 2)))
    references = 0.2 * rng.normal(size=(30, 2)) @ shared.T + 0.3
    zero, pose = np.zeros(6), np.eye(4)
    scatter = compact.scatter_of([compact.FreeGrasp(zero, pose, zero, each) for each in references], 1.0)
    others = rng.normal(size=(40, 6)) * np.array([1.0, 0.9, 0.8, 0.7, 0.6, 0.5])
    space = compact.spanning_synergies(names, scatter, others, 0.01)
    np.testing.assert_allclose(space.mean, references.mean(axis=0))
    np.testing.assert_allclose(space.basis.T @ space.basis, np.eye(6), atol=1e-12)
    np.testing.assert_allclose(shared - space.basis[:, :2] @ space.basis[:, :2].T @ shared, 0.0, atol=1e-9)
    assert (np.diff(space.variance[2:]) <= 1e-12).all(), "the others by what they explain"
    np.testing.assert_allclose(space.variance, np.var(others @ space.basis, axis=0, ddof=1))


def test_displacements_count_in_the_scatter(rng):
    zero, pose = np.zeros(4), np.eye(4)
    pressed = [compact.FreeGrasp(zero, pose, each, zero) for each in rng.normal(size=(5, 4))]
    scatter = compact.scatter_of(pressed, 2.0)
    moved = np.array([2.0 * grasp.displacement for grasp in pressed])
    np.testing.assert_allclose(scatter.covariance, compact.DISPLACEMENT_WEIGHT * moved.T @ moved / 5)
    assert np.linalg.eigvalsh(scatter.metric(0.1)).max() <= compact.UNIT_SPREAD**2 / 0.1**2 + 1e-12


def test_the_reference_is_the_grasps_own(grasps):
    problems, (first, *_) = grasps
    grasp = grasp_of(problems[0], first)
    evaluator = StateEvaluator(problems[0], grasp.palm_pose)
    state = evaluator.evaluate(evaluator.pack(grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma))
    np.testing.assert_allclose(state.reference, grasp.reference_joint_angles, atol=1e-9)


@pytest.mark.slow
def test_the_script_makes_a_set(tmp_path):
    script = Path(__file__).parents[1] / "scripts" / "make_compact_synergies.py"
    output = tmp_path / "set.csv"
    options = f"--objects 2 --counts 5 --workers 1 --output {output}".split()
    done = subprocess.run([sys.executable, str(script), *options], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    space = gp.load_synergies(output)
    np.testing.assert_allclose(space.basis.T @ space.basis, np.eye(15), atol=1e-9)
    assert "--objects 2 --counts 5" in space.provenance
