"""Margins in newtons: against bisection on the clear formulas, against each other, and on a case known by hand."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.judge.load_check import case_forces, response_matrix
from grasp_planner.judge.margins import Holding, passive_scales, worst_passive_margin
from grasp_planner.model.contacts import Contacts
from tests.stored import TOTAL, stored


@pytest.fixture(scope="module")
def held(right):
    """A grasp planned for a disturbance of 1 N."""
    found = stored("push")
    fields = {"n_synergies": 5, "parameters": TOTAL, "loads": gp.LoadCases()}
    assert found.problem == gp.GraspProblem.paper(right, gp.Cylinder(), **fields)
    return found


def withstands(grasp, wrench):
    """Return whether the passive answer to a disturbance stays in the true cones and the hand's limits."""
    response = response_matrix(grasp.problem, grasp.grasp_matrix, grasp.hand_jacobian)
    forces = case_forces(grasp.forces, response, wrench[None])[0]
    normals, hand = grasp.contacts.normals, grasp.problem.hand
    torques = np.abs(grasp.hand_jacobian.T @ forces.ravel())
    return (
        gp.model.friction_margins(forces, normals, grasp.problem.parameters.friction).min() >= -1e-9
        and gp.model.normal_forces(forces, normals).max() <= hand.max_normal_force + 1e-9
        and (torques <= hand.torque_limits + 1e-9).all()
    )


def bisected(grasp, wrench, largest=200.0):
    low, high = 0.0, largest
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if withstands(grasp, middle * wrench) else (low, middle)
    return low


def test_planned_disturbances_are_withstood(held):
    assert held.feasible
    # Friction is planned on 14 directions of the sphere with μ/1.2; the linear limits on the whole sphere.
    assert held.margins.passive.size >= 0.97
    for direction in np.vstack([np.eye(3), -np.eye(3)]):
        assert withstands(held, np.concatenate([direction, np.zeros(3)]))


def test_a_plan_at_the_force_minimum_has_no_passive_margin(planned):
    assert planned.margins.passive.size < 0.01
    assert planned.margins.active.size > 10 * planned.margins.passive.size


def test_passive_margins_agree_with_bisection(held, planned, rng):
    for grasp in (held, planned):
        worst = grasp.margins.passive
        assert worst.size == pytest.approx(bisected(grasp, worst.direction), abs=1e-5)
        task = grasp.margins.passive_tasks[0]
        assert task.size == pytest.approx(bisected(grasp, task.direction), abs=1e-5)
        np.testing.assert_allclose(task.direction, -grasp.problem.tasks[0].direction)
        random = rng.normal(size=(30, 3))
        wrenches = np.hstack([random / np.linalg.norm(random, axis=1, keepdims=True), np.zeros((30, 3))])
        for wrench, margin in zip(wrenches, grasp.passive_margins_along(wrenches), strict=True):
            assert bisected(grasp, wrench) == pytest.approx(margin.size, abs=1e-5)
            assert margin.size >= worst.size - 1e-6


def test_active_margins_exceed_passive_ones_and_are_reached_by_some_synergy_displacement(held):
    margins = held.margins
    assert margins.active.size >= margins.passive.size - 1e-6
    assert margins.active_tasks[0].size >= margins.passive_tasks[0].size - 1e-6


def test_re_squeezed_forces_are_those_the_springs_reach(held):
    """Whatever law planned the forces: the range of P with the stiffness in series, not that of (17)."""
    problem, parameters = held.problem, held.problem.parameters
    springs = gp.model.compliant_grasp(
        held.grasp_matrix,
        held.hand_jacobian,
        problem.synergies.basis,
        contact_stiffness=parameters.contact_stiffness,
        joint_stiffness=1.0 / problem.joint_compliance,
    )
    expected = gp.model.projector(gp.model.commanded_forces(springs))
    np.testing.assert_allclose(gp.model.projector(held._holding.internal), expected, atol=1e-7)
    paper = gp.model.internal_forces(
        held.grasp_matrix,
        held.hand_jacobian,
        problem.synergies.basis,
        held.stiffness,
        parameters.contact_stiffness,
    )
    assert np.abs(gp.model.projector(paper) - expected).max() > 0.05


def test_two_fingers_known_by_hand(right):
    """Two fingers press a ball with 5 N along x, stiffness the same everywhere; each takes half of any force.

    Across (z): slip when s/2 = μ 5 N. Along (x): one contact loses s/2, the ball is held until μ (5 − s/2) = 0
    or, with the limit of 6 N, until 5 + s/2 = 6.
    """
    normals = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    response = np.vstack([0.5 * np.eye(3, 6), 0.5 * np.eye(3, 6)])
    base = Holding(
        Contacts(-0.03 * normals, normals, np.zeros(2)),
        gp.model.HardFinger(),
        ("left", "right"),
        ("joint",),
        5.0 * normals,
        response,
        np.zeros((6, 0)),
        np.zeros((6, 1)),
        np.full(2, 0.8),
        np.inf,
        np.array([np.inf]),
    )
    across, along = np.eye(6)[2][None], np.eye(6)[0][None]
    assert passive_scales(base, across).min() == pytest.approx(8.0)
    assert passive_scales(base, along).min() == pytest.approx(10.0)
    assert passive_scales(replace(base, max_normal=6.0), along).min() == pytest.approx(2.0)
    worst = worst_passive_margin(base)
    # Slanted: |s/2 cos| = μ (5 − s/2 sin) is worst where tan = μ: s = 2 · 5 μ / √(1 + μ²).
    assert worst.size == pytest.approx(10.0 * 0.8 / np.hypot(1.0, 0.8), rel=1e-4)
    assert worst.gives_way.startswith("friction at ")


def test_motions_have_no_margin_of_their_own(right, planned):
    problem = gp.GraspProblem.paper(right, gp.Cylinder(), (gp.twist_task([0, 1, 0, 0, 0, 0]),), 6)
    grasp = gp.Grasp(problem, planned.joint_angles, planned.palm_pose, np.zeros(6))
    assert grasp.margins.passive_tasks == (None,)


def test_without_contact_stiffness_margins_are_not_numbers(planned):
    problem = replace(planned.problem, parameters=gp.GraspParameters(contact_stiffness=0.0))
    grasp = gp.Grasp(problem, planned.joint_angles, planned.palm_pose, planned.delta_sigma)
    assert np.isnan(grasp.margins.passive.size)
    assert np.isnan(grasp.margins.active.size)
