"""Load cases: derivatives, the fast form against the clear formulas, and what plans with them withstand."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import grasp_planner as gp
from grasp_planner.judge.load_check import case_forces, response_matrix
from grasp_planner.problem.load_cases import sphere_directions, wrench_of_text
from grasp_planner.terms.registry import REQUIREMENTS, judged_requirements, problem_constraints
from tests.finite_differences import central_differences, relative_error
from tests.test_state import OBJECTS, make_problem, random_point, steps_of

LOADS = {
    "practical": gp.LoadCases(),
    "everything": gp.LoadCases(
        force=0.7,
        torque=0.02,
        acceleration=8.0,
        position_error=1e-4,
        rotation_error=2e-3,
        wrenches=((0.3, 0.0, -0.2, 0.0, 0.01, 0.0), (0.0, 0.0, 1.0, 0.0, 0.0, 0.0)),
        friction_safety=1.3,
        max_normal_force=9.0,
        max_force_norm=12.0,
    ),
    "limits only": gp.LoadCases(force=0.0),
}


def check_derivatives(problem, rng):
    evaluator, x = random_point(problem, rng)
    state, steps = evaluator.evaluate(x), steps_of(evaluator.layout)
    terms = [term for term in problem_constraints(problem) if term.name.startswith("load_")]
    assert len(terms) == 4 + (problem.loads.max_force_norm is not None)
    for term in terms:
        numeric = central_differences(lambda y, t=term: t.residual(problem, evaluator.evaluate(y)), x, steps)
        analytic = term.jacobian(problem, state)
        assert analytic.shape == numeric.shape
        if numeric.size:
            assert relative_error(analytic, numeric) < 2e-6, term.name


@pytest.mark.parametrize("loads", LOADS)
@pytest.mark.parametrize("contact_set", ["point", "sphere"])
@pytest.mark.parametrize("object_name", OBJECTS)
def test_derivatives(hand, object_name, contact_set, loads, rng):
    problem = make_problem(hand, OBJECTS[object_name], contact_set, "force")
    check_derivatives(replace(problem, loads=LOADS[loads]), rng)


@pytest.mark.parametrize("name", ["allegro_right", "tendon_hand"])
@pytest.mark.parametrize("object_name", OBJECTS)
def test_derivatives_of_other_hands(name, object_name, rng):
    hand = gp.load_hand(name)
    check_derivatives(gp.GraspProblem.paper(hand, OBJECTS[object_name], n_synergies=2, loads=LOADS["everything"]), rng)


def test_derivatives_with_internal_torques_and_uneven_compliance(right, rng):
    compliance = tuple(rng.uniform(0.0, 0.5, 15))
    problem = make_problem(right, OBJECTS["cylinder"], "sphere", "force", "internal", compliance)
    check_derivatives(replace(problem, loads=LOADS["everything"]), rng)


@pytest.mark.parametrize("loads", LOADS)
@pytest.mark.parametrize("contact_set", ["point", "sphere"])
def test_the_fast_form_agrees_with_the_clear_formulas(right, contact_set, loads, rng):
    problem = replace(make_problem(right, gp.Cylinder(), contact_set, "force"), loads=LOADS[loads])
    evaluator, x = random_point(problem, rng)
    layout = evaluator.layout
    grasp = gp.Grasp(problem, x[layout.joints], evaluator.palm_pose(x), x[layout.displacement])
    state = evaluator.evaluate(x)
    found = {name: violation.value for name, violation in grasp.violations.items()}
    assert max(0.0, -state.loads.friction.min()) == pytest.approx(found["load_friction"], abs=1e-5)
    normal = max(found["load_min_normal"], found["load_max_normal"])
    assert max(0.0, -state.loads.normal.min()) == pytest.approx(normal, abs=1e-6)
    assert max(0.0, -state.loads.torque.min()) == pytest.approx(found["load_torque"], abs=1e-6)


def test_the_passive_answer_balances_the_disturbance_and_minimises_elastic_energy(planned, rng):
    """Of all changes of force that balance Δw the springs take the one of least energy (Castigliano)."""
    problem, grasp, jacobian = planned.problem, planned.grasp_matrix, planned.hand_jacobian
    response = response_matrix(problem, grasp, jacobian)
    disturbance = rng.normal(size=6) * [1, 1, 1, 0.02, 0.02, 0.02]
    change = (case_forces(planned.forces, response, disturbance[None])[0] - planned.forces).ravel()
    np.testing.assert_allclose(grasp @ change, -disturbance, atol=1e-9)
    compliance = np.eye(15) / problem.parameters.contact_stiffness + (jacobian * 0.1) @ jacobian.T
    internal = np.linalg.svd(grasp)[2][6:].T
    assert np.abs(internal.T @ compliance @ change).max() < 1e-12


def test_the_hull_of_the_directions_contains_what_it_says():
    for edges, count, radius in ((False, 14, 0.805), (True, 26, 0.862)):
        directions = sphere_directions(edges=edges)
        assert directions.shape == (count, 3)
        assert -ConvexHull(directions).equations[:, 3].max() >= radius


def test_the_paper_problem_has_no_load_cases(right):
    problem = gp.GraspProblem.paper(right, gp.Cylinder())
    assert not problem.loads.active
    of_loads = {term.name for term in REQUIREMENTS if term.name.startswith("load_")}
    assert len(of_loads) == 5
    assert not of_loads & {term.name for term in judged_requirements(problem)}


def test_limits_come_from_the_hand(right):
    problem = gp.GraspProblem.paper(right, gp.Cylinder(), loads=gp.LoadCases())
    assert problem.max_normal_force == 10.0
    assert problem.torque_limits[:3].tolist() == [1.15, 1.15, 0.6]
    without = replace(problem, loads=gp.LoadCases(hand_limits=False))
    assert np.isinf(without.max_normal_force)
    assert np.isinf(without.torque_limits).all()


@pytest.mark.parametrize(
    "bad",
    [
        {"force": -1.0},
        {"friction_safety": 0.5},
        {"max_normal_force": 0.05},
        {"wrenches": ((1.0, 2.0),)},
        {"hand_limits": 1},
        {"torque": float("nan")},
    ],
)
def test_wrong_values_are_named(bad):
    with pytest.raises(gp.GraspPlannerError):
        gp.LoadCases(**bad)


def test_disturbances_need_stiff_contacts(right):
    soft = gp.GraspParameters(contact_stiffness=0.0)
    with pytest.raises(gp.InvalidValueError, match="contact_stiffness"):
        gp.GraspProblem.paper(right, gp.Cylinder(), parameters=soft, loads=gp.LoadCases())


def test_wrench_text():
    assert wrench_of_text("1,2,3") == (1.0, 2.0, 3.0, 0.0, 0.0, 0.0)
    with pytest.raises(gp.InvalidValueError):
        wrench_of_text("1,2")


@pytest.mark.slow
def test_why_not_names_the_load_that_is_too_large(right):
    """Fingertips that bear 10 N cannot hold against 60 N from any side; some smaller push they can."""
    problem = gp.GraspProblem.paper(right, gp.Cylinder(), n_synergies=15, loads=gp.LoadCases(force=60.0))
    attempt = gp.plan_grasp(problem, options=gp.PlannerOptions(starts=2, enough=1, max_iterations=80))
    assert not attempt.feasible
    assert any(name.startswith("load_") for name in attempt.failures())
    diagnosis = gp.explain_infeasibility(attempt, only=("disturbing force",), time_limit_s=25.0)
    change = diagnosis.smallest_change
    assert change.parameter == "disturbing force"
    assert 0.0 <= change.needed < 60.0
    assert change.grasp.feasible
