"""KKT points, multipliers and sensitivities of small programs with known answers."""

import numpy as np
import pytest

from grasp_planner.optimisation.kkt import kkt_change, kkt_point
from grasp_planner.optimisation.kkt_path import moved_point
from grasp_planner.optimisation.lagrangian import NlpPoint, lagrangian_hessian, secant_hessian


def circle(p):
    """The point of the disc x² + y² ≤ p with the least x + 2 y; −√p (1, 2)/√5, λ = √(5/p)/2."""

    def evaluate(z):
        return NlpPoint(z[0] + 2 * z[1], np.array([1.0, 2.0]), np.array([p - z @ z]), -2.0 * z[None], 0)

    return evaluate


def test_the_point_the_multiplier_and_the_sensitivity_of_the_disc():
    p = 2.0
    found = kkt_point(circle(p), np.array([-0.3, -0.9]))
    np.testing.assert_allclose(found.z, -np.sqrt(p / 5) * np.array([1.0, 2.0]), atol=1e-9)
    assert found.multipliers == pytest.approx([np.sqrt(5 / p) / 2], rel=1e-8)
    assert found.stationarity < 1e-9
    change = kkt_change(found, np.zeros(2), np.array([1.0]))
    np.testing.assert_allclose(change.z, found.z / (2 * p), rtol=1e-6)
    np.testing.assert_allclose(change.multipliers, [-np.sqrt(5) / 4 * p**-1.5], rtol=1e-5)
    assert (change.mismatch < 1e-9, change.flat) == (True, 0)


def plane(z):
    """Min (x − 1)² + (x − y)²… in three variables, z[2] without any part in it; x + y = 1, x ≥ 0.8."""
    x, y, _ = z
    gradient = np.array([2 * (x - 1) + 2 * (x - y), -2 * (x - y), 0.0])
    rows = np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
    return NlpPoint((x - 1) ** 2 + (x - y) ** 2, gradient, np.array([x + y - 1, x - 0.8]), rows, 1)


def test_equalities_an_active_bound_and_a_flat_direction():
    found = kkt_point(plane, np.array([0.1, 0.2, 5.0]))
    np.testing.assert_allclose(found.z, [0.8, 0.2, 5.0], atol=1e-7)
    assert found.active.tolist() == [0, 1]
    assert found.multipliers[1] > 0.0
    change = kkt_change(found, np.zeros(3), np.array([0.0, -1.0]))
    np.testing.assert_allclose(change.z, [1.0, -1.0, 0.0], atol=1e-9)
    assert change.flat == 1


def test_constraints_that_cannot_all_follow_are_reported():
    found = kkt_point(plane, np.array([0.8, 0.2, 5.0]))
    held = kkt_change(found, np.zeros(3), np.array([-1.0, -1.0]), free=np.array([1, 2]))
    assert held.mismatch > 0.1


def test_the_point_of_the_disc_is_followed_to_another_disc():
    found = kkt_point(circle(2.0), np.array([-0.3, -0.9]))
    moved = moved_point(found, circle(3.0), found.z, found.multipliers)
    np.testing.assert_allclose(moved.z, -np.sqrt(3.0 / 5) * np.array([1.0, 2.0]), atol=1e-12)
    assert moved.multipliers == pytest.approx([np.sqrt(5 / 3.0) / 2], rel=1e-7)
    along = moved_point(found, circle(3.0), found.z, found.multipliers, free=np.array([1]))
    assert along.z[0] == found.z[0]
    assert along.z @ along.z == pytest.approx(3.0)


def test_a_point_that_no_longer_exists_is_not_followed():
    found = kkt_point(circle(2.0), np.array([-0.3, -0.9]))
    assert moved_point(found, circle(-1.0), found.z, found.multipliers) is None
    assert moved_point(found, circle(1e6), found.z, found.multipliers) is None, "too far for Newton's method"


def test_hessians_by_differences_and_by_steps(rng):
    root = rng.normal(size=(4, 4))
    exact = root + root.T
    row = rng.normal(size=4)

    def evaluate(z):
        value, slope = 0.5 * z @ exact @ z, exact @ z
        bend = np.array([z @ z])
        return NlpPoint(value, slope, bend, 2.0 * z[None], 1)

    z, multipliers = row, np.array([0.7])
    wanted = exact - 1.4 * np.eye(4)
    np.testing.assert_allclose(lagrangian_hessian(evaluate, z, multipliers), wanted, atol=1e-8)
    np.testing.assert_allclose(lagrangian_hessian(evaluate, z, multipliers, at=evaluate(z)), wanted, atol=1e-8)
    found = np.eye(4)
    for step in rng.normal(size=(5, 4)):  # as many directions as there are settle a constant Hessian
        found = secant_hessian(found, step, wanted @ step)
        np.testing.assert_allclose(found @ step, wanted @ step, atol=1e-9)
    np.testing.assert_allclose(found, wanted, atol=1e-6)
    assert secant_hessian(found, step, found @ step) is found
