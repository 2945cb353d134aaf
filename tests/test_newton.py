"""Second-order steps: known optima, kept bounds, violations that are taken off, and the search's own phase two."""

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.optimisation.kkt import kkt_residual
from grasp_planner.optimisation.newton import solve_newton
from grasp_planner.optimisation.nlp import NonlinearProgram, solve_nlp
from grasp_planner.studies.benchmark_problems import BenchmarkCase

NONE = lambda z: (np.zeros(0), np.zeros((0, len(z))))  # noqa: E731
BOUNDLESS = np.full(2, np.inf)


def program(objective, equality=NONE, inequality=NONE, lower=-BOUNDLESS, upper=BOUNDLESS):
    return NonlinearProgram(objective, equality, inequality, np.array(lower, float), np.array(upper, float))


def rosenbrock(z):
    x, y = z
    return (1 - x) ** 2 + 100 * (y - x**2) ** 2, np.array([2 * (x - 1) - 400 * x * (y - x**2), 200 * (y - x**2)])


def within_circle(radius):
    return lambda z: (np.array([radius**2 - z @ z]), -2.0 * z[None])


def on_circle(radius):
    return lambda z: (np.array([z @ z - radius**2]), 2.0 * z[None])


def product(z):
    """Problem 71 of Hock and Schittkowski (1981)."""
    a, b, c, d = z
    return a * d * (a + b + c) + c, np.array([d * (2 * a + b + c), a * d, a * d + 1, a * (a + b + c)])


HS71 = program(
    product,
    lambda z: (np.array([z @ z - 40.0]), 2.0 * z[None]),
    lambda z: (np.array([np.prod(z) - 25.0]), (np.prod(z) / z)[None]),
    np.ones(4),
    np.full(4, 5.0),
)


def test_known_optimum_with_equality_inequality_and_bounds():
    found = solve_newton(HS71, np.array([1.0, 5.0, 5.0, 1.0]))
    assert found.converged
    np.testing.assert_allclose(found.z, [1.0, 4.74299963, 3.82114998, 1.37940829], atol=1e-7)
    assert kkt_residual(HS71, found.z) < 1e-7


@pytest.mark.parametrize("radius", [0.5, 1.0, 2.0])
def test_curved_valley_within_a_circle(radius):
    sought = program(rosenbrock, inequality=within_circle(radius))
    found = solve_newton(sought, np.array([-0.3, 0.1]))
    assert found.converged
    assert kkt_residual(sought, found.z) < 1e-6
    assert found.z @ found.z <= radius**2 + 1e-7
    if radius == 2.0:
        np.testing.assert_allclose(found.z, [1.0, 1.0], atol=1e-6)


def test_residual_is_large_where_nothing_is_optimal_and_sees_bounds():
    sought = program(lambda z: (float(z.sum()), np.ones(2)), lower=[0.0, 0.0])
    assert kkt_residual(sought, np.array([0.5, 0.0])) == pytest.approx(1.0)
    assert kkt_residual(sought, np.zeros(2)) < 1e-12
    turned = program(lambda z: (-float(z.sum()), -np.ones(2)), lower=[0.0, 0.0])
    assert kkt_residual(turned, np.zeros(2)) == pytest.approx(1.0)


def test_negative_curvature_is_left():
    """x² − y² on a circle: (0, ±1) are its minima; (1, 0), a maximum, meets the first-order conditions too."""
    sought = program(lambda z: (z[0] ** 2 - z[1] ** 2, np.array([2 * z[0], -2 * z[1]])), on_circle(1.0))
    found = solve_newton(sought, np.array([1.0, 1e-3]))
    assert found.converged
    np.testing.assert_allclose(np.abs(found.z), [0.0, 1.0], atol=1e-6)


def test_bounds_are_kept_by_every_step():
    seen = []
    solve_newton(HS71, np.array([9.0, -1.0, 3.0, 2.0]), callback=lambda z: seen.append(np.array(z)))
    assert seen
    assert all((z >= 1.0).all() and (z <= 5.0).all() for z in seen)


def test_violation_is_taken_off_also_where_the_objective_is_steep():
    """The slope of the objective is a thousand times the constraint's: a small weight would leave the violation."""
    sought = program(
        lambda z: (1e3 * z[0], np.array([1e3, 0.0])), on_circle(1.0), lambda z: (z[1:] - 0.5, np.eye(2)[1:])
    )
    found = solve_newton(sought, np.array([-3.0, 2.0]))
    assert found.converged
    np.testing.assert_allclose(found.z, [-np.sqrt(0.75), 0.5], atol=1e-6)


def test_what_cannot_be_met_ends_near_with_no_claim():
    sought = program(
        lambda z: (float(z @ z), 2.0 * z), lambda z: (np.array([z[0] - 1.0, z[0] + 1.0]), np.array([[1.0, 0.0]] * 2))
    )
    found = solve_newton(sought, np.array([0.3, 0.7]))
    assert not found.converged
    assert abs(found.z[0]) <= 1.0 + 1e-6


def test_iteration_limit_is_kept_and_said():
    found = solve_newton(program(rosenbrock), np.array([-1.2, 1.0]), max_iterations=3)
    assert not found.converged
    assert found.iterations <= 6
    assert "limit" in found.message


@pytest.mark.parametrize("n_synergies", [3, 15])
def test_search_with_second_derivatives_finds_a_grasp(n_synergies):
    problem = BenchmarkCase(0, n_synergies).problem()
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(enough=1, solver="newton"))
    assert grasp.feasible
    assert grasp.search.options.solver == "newton"


def test_both_solvers_agree_from_the_same_point():
    point = np.array([1.5, 4.0, 4.0, 1.5])
    first, second = solve_nlp(HS71, point), solve_newton(HS71, point)
    np.testing.assert_allclose(second.z, first.z, atol=1e-4)
    assert kkt_residual(HS71, second.z) <= kkt_residual(HS71, first.z) + 1e-12
