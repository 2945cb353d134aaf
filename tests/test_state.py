"""Every derivative the solver sees, against central differences; every value, against the clear formulas."""

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.evaluation.state import FRICTION_SMOOTHING, StateEvaluator
from grasp_planner.planning.program import GraspProgram
from grasp_planner.terms.objective import problem_objective
from grasp_planner.terms.registry import problem_constraints
from tests.finite_differences import central_differences, relative_error

OBJECTS = {
    "sphere": gp.Sphere(radius=0.03),
    "cylinder": gp.Cylinder(),
    "cylinder with caps": gp.Cylinder(caps=1, edge=0.01, height=0.06),
    "box": gp.Box(edge=0.01),
}
TASKS = {
    "force": (3, (gp.force_task([0.0, 1.0, 0.0]),)),
    "force and torque": (15, (gp.force_task([1.0, 1.0, 0.0]), gp.torque_task([0.0, 0.2, 1.0], 0.3))),
    "twist": (8, (gp.twist_task([0.0, 1.0, 0.0, 0.0, 0.0, 0.1]), gp.force_task([0.0, 0.0, 1.0], 2.0))),
    "one synergy": (1, (gp.force_task([0.3, 1.0, 0.0]),)),
}

LAWS = ("springs", "controllable")


def make_problem(
    hand, grasp_object, contact_set, task, torque_model="total", joint_compliance=0.1, force_law="controllable"
):
    n_s, tasks = TASKS[task]
    parameters = gp.GraspParameters(torque_model=torque_model, joint_compliance=joint_compliance, force_law=force_law)
    return gp.GraspProblem.paper(hand, grasp_object, tasks, n_s, parameters, contact_set=contact_set)


def random_point(problem, rng, spread=0.1):
    """Return an evaluator and a random x away from the reference pose of the chart."""
    start = gp.random_start(problem, rng)
    evaluator = StateEvaluator(problem, start.palm_pose)
    layout = evaluator.layout
    forces = rng.normal(0.0, 2.0, (len(problem.frames), 3)) if layout.n_forces else None
    x = evaluator.pack(start.joint_angles, start.palm_pose, rng.normal(0.0, 1e-4, problem.n_synergies), forces)
    x[layout.joints] = problem.hand.lower + (problem.hand.upper - problem.hand.lower) * rng.random(layout.n_joints)
    x[layout.translation] += rng.normal(0.0, 0.01, 3)
    x[layout.rotation] += rng.normal(0.0, spread, 3)
    return evaluator, x


def grasp_at(evaluator, x):
    """Return the grasp that stands at x."""
    problem, layout = evaluator.problem, evaluator.layout
    delta_sigma = np.zeros(problem.n_synergies) if layout.n_forces else x[layout.displacement]
    return gp.Grasp(problem, x[layout.joints], evaluator.palm_pose(x), delta_sigma, evaluator.forces_in_object(x))


def steps_of(layout):
    steps = np.full(layout.size, 2e-4)
    steps[layout.translation] = 2e-5
    steps[layout.displacement] = 1e-7
    return steps


def check_all(problem, rng):
    evaluator, x = random_point(problem, rng)
    state = evaluator.evaluate(x)
    steps = steps_of(evaluator.layout)
    for term in problem_constraints(problem):
        numeric = central_differences(lambda y, t=term: t.residual(problem, evaluator.evaluate(y)), x, steps)
        analytic = term.jacobian(problem, state)
        assert analytic.shape == numeric.shape
        if numeric.size:
            assert relative_error(analytic, numeric) < 1e-6, term.name
    for cost in (each.cost for each in problem_objective(problem).terms):
        numeric = central_differences(lambda y, c=cost: [c.value(problem, evaluator.evaluate(y))], x, steps)
        assert relative_error(cost.gradient(problem, state), numeric) < 1e-6, cost.name
    numeric = central_differences(lambda y: evaluator.evaluate(y).intensities.ravel(), x, steps)
    assert relative_error(state.d_intensities, numeric) < 1e-6


@pytest.mark.parametrize("force_law", LAWS)
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("contact_set", ["point", "sphere"])
@pytest.mark.parametrize("object_name", OBJECTS)
def test_derivatives_of_all_terms(hand, object_name, contact_set, task, force_law, rng):
    check_all(make_problem(hand, OBJECTS[object_name], contact_set, task, force_law=force_law), rng)


@pytest.mark.parametrize("contact_set", ["point", "sphere"])
def test_derivatives_with_internal_torques_and_uneven_compliance(right, contact_set, rng):
    compliance = tuple(rng.uniform(0.0, 0.5, 15))
    check_all(make_problem(right, OBJECTS["cylinder"], contact_set, "force", "internal", compliance), rng)


def test_derivatives_at_a_planned_grasp(planned):
    """Where the solver ends they count most: at the solution, with forces on the edge of their cones."""
    problem = planned.problem
    evaluator = StateEvaluator(problem, planned.palm_pose)
    x = evaluator.pack(planned.joint_angles, planned.palm_pose, planned.delta_sigma, planned.contact_forces)
    state, steps = evaluator.evaluate(x), steps_of(evaluator.layout) / 4
    for term in problem_constraints(problem):
        numeric = central_differences(lambda y, t=term: t.residual(problem, evaluator.evaluate(y)), x, steps)
        error = np.abs(term.jacobian(problem, state) - numeric).max(initial=0.0)
        assert error < 1e-6 * np.abs(numeric).max(initial=1.0)


@pytest.mark.parametrize(
    ("torque_model", "force_law"), [("total", "springs"), ("total", "controllable"), ("internal", "controllable")]
)
@pytest.mark.parametrize("contact_set", ["point", "sphere"])
@pytest.mark.parametrize("object_name", OBJECTS)
def test_the_fast_form_agrees_with_the_clear_formulas(hand, object_name, contact_set, torque_model, force_law, rng):
    problem = make_problem(hand, OBJECTS[object_name], contact_set, "force", torque_model, force_law=force_law)
    evaluator, x = random_point(problem, rng)
    state = evaluator.evaluate(x)
    layout = evaluator.layout
    grasp = grasp_at(evaluator, x)
    geometry = state.geometry
    np.testing.assert_allclose(geometry.points, grasp.contacts.points, atol=1e-13)
    np.testing.assert_allclose(geometry.normals, grasp.contacts.normals, atol=1e-12)
    np.testing.assert_allclose(geometry.gaps, grasp.contacts.gaps, atol=1e-13)
    np.testing.assert_allclose(geometry.jacobian, grasp.hand_jacobian, atol=1e-13)
    scale = np.abs(grasp.forces).max()
    np.testing.assert_allclose(state.forces, grasp.forces, atol=1e-9 * scale)
    forces, friction = grasp.forces, problem.parameters.friction
    tangential = np.linalg.norm(forces - grasp.normal_forces[:, None] * grasp.contacts.normals, axis=1)
    smooth = friction * grasp.normal_forces - np.hypot(tangential, FRICTION_SMOOTHING)
    np.testing.assert_allclose(state.friction_margins, smooth, atol=1e-9 * scale)
    assert (state.friction_margins <= grasp.friction_margins).all()
    np.testing.assert_allclose(state.torques, grasp.bending_torques, atol=1e-9 * scale)
    left = grasp.grasp_matrix @ grasp.forces.ravel() + problem.external_wrench
    if force_law == "springs":
        np.testing.assert_allclose(state.balance, left, atol=1e-9 * scale)
    else:
        assert state.balance.size == 0
        np.testing.assert_allclose(left, 0.0, atol=1e-9 * scale)
    assert state.force_norm == pytest.approx(grasp.force_norm, rel=1e-9)
    assert state.task_index == pytest.approx(grasp.task_index, rel=1e-8)
    soft = x[layout.joints] - grasp.reference_joint_angles + problem.joint_compliance * grasp.bending_torques
    assert np.linalg.norm(state.compliance) == pytest.approx(np.linalg.norm(soft), abs=1e-9)


def test_pose_chart_round_trip(right, rng):
    problem = gp.GraspProblem.paper(right, gp.Cylinder())
    evaluator = StateEvaluator(problem, pin.SE3.Random())
    pose = pin.SE3.Random()
    x = evaluator.pack(right.lower, pose, np.zeros(3))
    assert evaluator.palm_pose(x).isApprox(pose, 1e-10)


def test_a_common_rotation_about_the_cylinder_changes_no_size(right, rng):
    """Turning the hand about the axis of the cylinder turns the forces and leaves F, C (task turned too) alone."""
    axis_turn = pin.SE3(pin.exp3(np.array([0.0, 0.0, 0.7])), np.zeros(3))
    direction = np.array([0.0, 1.0, 0.0])
    values = []
    for motion in (pin.SE3.Identity(), axis_turn):
        task = gp.force_task(np.array(motion.rotation) @ direction)
        problem = gp.GraspProblem.paper(right, gp.Cylinder(), (task,))
        start = gp.random_start(problem, np.random.default_rng(3))
        grasp = gp.Grasp(problem, start.joint_angles, motion * start.palm_pose, np.full(3, 1e-4))
        values.append((grasp.force_norm, grasp.task_index, *grasp.normal_forces))
    np.testing.assert_allclose(values[0], values[1], rtol=1e-9)


def test_each_point_is_evaluated_once(right):
    problem = gp.GraspProblem.paper(right, gp.Cylinder())
    start = gp.standard_start(problem)
    program = GraspProgram(problem, start.palm_pose)
    z = program.pack(start.joint_angles, start.palm_pose, start.delta_sigma)
    nlp = program.build("two", 1.0)
    nlp.objective(z), nlp.equality(z), nlp.inequality(z)
    assert program.evaluations == 1
