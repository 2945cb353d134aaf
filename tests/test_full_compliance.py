"""Joints that bend each other: C_q as a full matrix, through formulas, search, judge, closing, simulation and files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.analysis.knobs import _compliance_knob
from grasp_planner.analysis.problem_parameters import parameters_of
from grasp_planner.closing.equilibrium import RestSolver
from grasp_planner.closing.newton import RestEvaluator
from grasp_planner.closing.rest import Anchors, Conditions
from grasp_planner.closing.together import run_together
from grasp_planner.exceptions import MAX_VALUE
from grasp_planner.judge.load_check import command_matrix, response_matrix
from grasp_planner.model import compliance as soft
from grasp_planner.model.quasi_static import compliant_grasp, quasi_static_maps
from grasp_planner.problem.from_settings import PROBLEM_SETTINGS
from grasp_planner.records.grasp_files import parse_grasp_record
from grasp_planner.records.grasp_record import grasp_record
from tests.finite_differences import central_differences
from tests.stored import stored
from tests.test_loads import LOADS
from tests.test_loads import check_derivatives as check_load_derivatives
from tests.test_stability import equilibrium
from tests.test_state import check_all, grasp_at, make_problem, random_point


def spd(size, rng, softness=0.1):
    """Return a symmetric positive definite matrix whose entries off the diagonal count."""
    turn = np.linalg.qr(rng.normal(size=(size, size)))[0]
    matrix = (turn * rng.uniform(0.3, 1.7, size)) @ turn.T * softness
    return 0.5 * (matrix + matrix.T)


def rows(matrix):
    return tuple(map(tuple, np.asarray(matrix).tolist()))


def with_full(grasp, rng):
    """Return a stored grasp whose joints bend each other."""
    problem = grasp.problem
    parameters = replace(problem.parameters, joint_compliance=rows(spd(problem.hand.n_joints, rng)))
    return replace(grasp, problem=replace(problem, parameters=parameters))


def test_the_formulas_are_those_of_the_matrix(rng):
    jacobian, c_q, torques = rng.normal(size=(9, 7)), spd(7, rng), rng.normal(size=7)
    np.testing.assert_allclose(soft.softened(jacobian, c_q), jacobian @ c_q)
    np.testing.assert_allclose(soft.bent(c_q, torques), c_q @ torques)
    np.testing.assert_allclose(soft.joint_stiffness(c_q) @ c_q, np.eye(7), atol=1e-12)
    stiffness = soft.hand_stiffness(jacobian, 0.1, c_q)
    np.testing.assert_allclose(np.linalg.inv(stiffness), 0.1 * np.eye(9) + jacobian @ c_q @ jacobian.T, atol=1e-10)
    settled = soft.actual_posture(np.zeros(7), c_q, lambda q: torques)
    np.testing.assert_allclose(settled, -c_q @ torques, atol=1e-10)


@pytest.mark.parametrize("columns", [None, 4])
def test_a_diagonal_matrix_is_its_diagonal(columns, rng):
    diagonal, jacobian = rng.uniform(0.1, 1.0, 7), rng.normal(size=(9, 7))
    torques = rng.normal(size=7 if columns is None else (7, columns))
    np.testing.assert_allclose(soft.bent(np.diag(diagonal), torques), soft.bent(diagonal, torques))
    np.testing.assert_allclose(soft.softened(jacobian, np.diag(diagonal)), soft.softened(jacobian, diagonal))


@pytest.mark.parametrize(("torque_model", "law"), [("total", "springs"), ("internal", "controllable")])
def test_derivatives_of_all_terms(right, torque_model, law, rng):
    c_q = rows(spd(15, rng))
    problem = make_problem(right, gp.Cylinder(), "sphere", "force", torque_model, c_q, law)
    assert problem.joint_compliance.shape == (15, 15)
    check_all(problem, rng)


def test_derivatives_of_load_cases(right, rng):
    problem = make_problem(right, gp.Cylinder(), "sphere", "force", joint_compliance=rows(spd(15, rng)))
    check_load_derivatives(replace(problem, loads=LOADS["everything"]), rng)


@pytest.mark.parametrize("law", ["springs", "controllable"])
def test_the_search_sees_what_the_judge_sees(right, law, rng):
    c_q = spd(15, rng)
    problem = make_problem(right, gp.Cylinder(), "sphere", "force", joint_compliance=rows(c_q), force_law=law)
    evaluator, x = random_point(problem, rng)
    state, grasp = evaluator.evaluate(x), grasp_at(evaluator, x)
    np.testing.assert_allclose(state.forces, grasp.forces, atol=1e-9 * np.abs(grasp.forces).max())
    wanted = grasp.joint_angles + c_q @ grasp.joint_torques
    np.testing.assert_allclose(state.reference, wanted, atol=1e-9 * np.abs(wanted).max())
    np.testing.assert_allclose(grasp.sigma, problem.synergies.coordinates(wanted), rtol=1e-8)


def test_load_cases_are_those_of_the_quasi_static_answer(rng):
    grasp = with_full(stored("push"), rng)
    problem, jacobian = grasp.problem, grasp.hand_jacobian
    springs = compliant_grasp(
        grasp.grasp_matrix,
        jacobian,
        problem.synergies.basis,
        contact_stiffness=problem.parameters.contact_stiffness,
        joint_stiffness=np.linalg.inv(problem.joint_compliance),
    )
    maps = quasi_static_maps(springs)
    response = response_matrix(problem, grasp.grasp_matrix, jacobian)
    np.testing.assert_allclose(maps.wrench.contact_forces, -response, atol=1e-8 * np.abs(response).max())
    commands = command_matrix(problem, grasp.grasp_matrix, jacobian)
    np.testing.assert_allclose(maps.commands.contact_forces, commands, atol=1e-8 * np.abs(commands).max())


def test_stability_is_the_derivative_of_the_equilibrium(rng):
    grasp = with_full(stored("point_cylinder"), rng)
    numeric = -central_differences(lambda nu: equilibrium(grasp, nu), np.zeros(6), np.repeat([2e-6, 1e-4], 3))
    scale = np.repeat([1.0, 1.0 / grasp.stability.length], 3)
    off = scale[:, None] * (grasp.stability.stiffness - numeric) * scale
    assert np.abs(off).max() < 1e-5 * np.abs(scale[:, None] * numeric * scale).max()


def test_closing_rests_at_the_plan_and_against_stops(rng):
    grasp = with_full(stored("point_cylinder"), rng)
    problem, n_c = grasp.problem, len(grasp.problem.frames)
    solver, q = RestSolver(problem, grasp.palm_pose, 200), grasp.joint_angles
    centres = grasp.configuration.contact_centres(problem.frames)
    anchors = Anchors(centres, np.tile(q, (n_c, 1)), np.full(n_c, True))
    reference = q + problem.joint_compliance @ grasp.joint_torques
    away = replace(solver.begin(q + 1e-3), forces=0.95 * grasp.forces)
    sought = solver.solve(away, Conditions(reference, anchors, problem.external_wrench))
    (found,) = run_together(RestEvaluator(problem), [sought])
    np.testing.assert_allclose(found.forces, grasp.forces, atol=2e-3)
    np.testing.assert_allclose(found.q, q, atol=1e-5)
    # Free, with a reference beyond a stop: the other joints bend as K_q says, the stopped one barely passes its limit.
    free = Anchors(centres, np.tile(q, (n_c, 1)), np.full(n_c, False))
    reference, hand = np.array(q), problem.hand
    reference[2] = hand.upper[2] + 0.2
    sought = solver.solve(solver.begin(q), Conditions(reference, free))
    (rest,) = run_together(RestEvaluator(problem), [sought])
    stiffness, others = np.linalg.inv(problem.joint_compliance), (rest.q > hand.lower) & (rest.q < hand.upper)
    assert 0.0 < rest.q[2] - hand.upper[2] < 0.02 and others.sum() > 9
    np.testing.assert_allclose((stiffness @ (rest.q - reference))[others], 0.0, atol=1e-4)


def test_the_step_to_rest_has_the_derivative_of_the_residual(rng):
    grasp = with_full(stored("point_cylinder"), rng)
    springs, hand = RestEvaluator(grasp.problem).springs, grasp.problem.hand
    q, torques = grasp.joint_angles, rng.normal(0.0, 0.1, 15)
    reference = np.array(q)
    reference[2] = hand.upper[2] + 0.3

    def offs(at, tau):
        return springs(at[None], reference[None], tau[None])[0][0]

    rest = q - offs(q, torques)
    np.testing.assert_allclose(offs(rest, torques), 0.0, atol=1e-9)
    (yielding,) = springs(rest[None], reference[None], torques[None])[1]
    numeric = central_differences(lambda tau: rest - offs(rest, tau), torques, 1e-4)
    np.testing.assert_allclose(-yielding, numeric, atol=1e-8)


def test_knobs_and_parameters_scale_the_whole_matrix(rng):
    grasp = with_full(stored("push"), rng)
    c_q = grasp.problem.joint_compliance
    np.testing.assert_allclose(_compliance_knob(grasp.problem, 1.0, "softer").apply(2.0).joint_compliance, 2.0 * c_q)
    (scaled,) = (each for each in parameters_of(grasp) if each.name == "joint compliance")
    np.testing.assert_allclose(scaled.apply(0.1).joint_compliance, 1.1 * c_q)


def test_files_and_texts_keep_the_matrix(rng):
    grasp = with_full(stored("push"), rng)
    again = gp.grasp_from_record(parse_grasp_record(grasp_record(grasp).model_dump_json().encode(), "a.json"))
    assert again.problem == grasp.problem
    setting = PROBLEM_SETTINGS["joint_compliance"]
    assert setting.of_text(setting.text(((0.2, -0.1), (-0.1, 0.3)))) == ((0.2, -0.1), (-0.1, 0.3))
    assert setting.of_text("0.2") == 0.2 and setting.of_text("0.1,0.2") == (0.1, 0.2)


def test_a_matrix_that_is_diagonal_is_the_same_problem(right):
    def problem(c_q):
        return gp.GraspProblem.paper(right, gp.Cylinder(), parameters=gp.GraspParameters(joint_compliance=c_q))

    assert problem(rows(0.1 * np.eye(15))) == problem(0.1)


BAD = {
    "not symmetric": ([[0.2, 0.1], [0.0, 0.2]], "symmetric positive definite"),
    "not definite": ([[0.1, 0.2], [0.2, 0.1]], "symmetric positive definite"),
    "singular": ([[0.1, 0.1], [0.1, 0.1]], "symmetric positive definite"),
    "not square": ([[0.1, 0.0, 0.0], [0.0, 0.1, 0.0]], r"shape \(2, 2\)"),
    "ragged": ([[0.1, 0.0], [0.1]], "finite numbers"),
    "not a number": ([[0.1, float("nan")], [0.0, 0.1]], "finite numbers"),
    "a text": ([["a", 0.0], [0.0, 0.1]], "finite numbers"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_matrix_is_one_line(case):
    value, allowed = BAD[case]
    with pytest.raises(gp.InvalidValueError, match=allowed) as caught:
        gp.GraspParameters(joint_compliance=value)
    assert caught.value.field == "joint_compliance"
    assert "\n" not in str(caught.value) and len(str(caught.value)) < MAX_VALUE + 250


def test_a_matrix_of_another_size_is_one_line(right):
    parameters = gp.GraspParameters(joint_compliance=rows(0.1 * np.eye(14) + 0.01))
    with pytest.raises(gp.InvalidValueError, match=r"joint_compliance: got \(14, 14\), allowed: .*\(15, 15\)"):
        gp.GraspProblem.paper(right, gp.Cylinder(), parameters=parameters)


def described(tmp_path, joint):
    source = gp.hand_library()["tendon_hand"]
    text = source.read_text(encoding="utf-8")
    text = text.replace("structural = 0.1", f"joint = {joint}\nstructural = 0.1")
    start, end = text.index("[compliance.joint]"), text.index("[tendons.motors]")
    path = tmp_path / "hand.toml"
    path.write_text((text[:start] + text[end:]).replace('"tendon_hand.urdf"', f'"{source.parent}/tendon_hand.urdf"'))
    return path


def test_a_description_may_hold_a_matrix(tmp_path, rng):
    c_q = spd(7, rng)
    hand = gp.load_hand(described(tmp_path, c_q.tolist()))
    np.testing.assert_allclose(hand.joint_compliance, c_q, atol=1e-15)
    problem = gp.GraspProblem.paper(hand, gp.Sphere(radius=0.03), n_synergies=2)
    assert problem.joint_compliance.shape == (7, 7)
    assert problem.parameters.without_hand(hand).joint_compliance is None


@pytest.mark.parametrize(
    ("joint", "reason"),
    [
        ((-np.eye(7)).tolist(), "symmetric positive definite"),
        (np.eye(6).tolist(), r"got \(6, 6\), allowed: .*\(7, 7\)"),
        ([[0.1, 0.2], [0.3]], r"\(7, 7\)"),
        ('"soft"', "compliance.joint"),
    ],
)
def test_a_bad_matrix_in_a_description_is_one_line(tmp_path, joint, reason):
    with pytest.raises(gp.GraspPlannerError, match=reason) as caught:
        gp.load_hand(described(tmp_path, joint))
    assert "compliance.joint" in str(caught.value) and "\n" not in str(caught.value)


def test_springs_across_joints_in_simulation(right, rng):
    pytest.importorskip("mujoco")
    from grasp_planner.simulate import find_protocol
    from grasp_planner.simulate.world import World

    grasp = with_full(stored("round_15"), rng)
    world, problem = World(grasp, find_protocol("plan")), grasp.problem
    sigma = rng.normal(size=problem.n_synergies)
    world.reset(grasp.joint_angles, sigma)
    away = problem.synergies.joint_angles(sigma) - grasp.joint_angles
    torques = world.data.qfrc_spring + world.data.qfrc_actuator
    index = [world.model.joint(name).dofadr[0] for name in problem.hand.joint_names]
    np.testing.assert_allclose(torques[index], np.linalg.solve(problem.joint_compliance, away), atol=1e-8)
