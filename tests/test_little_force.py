"""Least force first, then the best task: the default objective, its floor, and several grasps that differ."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.analysis.optimality_program import OptimalityProgram, most_force
from grasp_planner.cli.main import main
from grasp_planner.grasp.squeeze import squeezed_forces
from grasp_planner.judge.load_check import command_matrix
from grasp_planner.planning.program import GraspProgram, _little_force
from grasp_planner.planning.ranking import alike
from grasp_planner.records.grasp_files import grasp_list_json, parse_grasp_record
from grasp_planner.terms.closing_normals import ClosingNormals
from grasp_planner.terms.registry import problem_constraints

from .finite_differences import central_differences, relative_error
from .stored import stored

BALL = gp.Sphere(radius=0.035)
FEW = gp.PlannerOptions(starts=8, enough=3)


@pytest.fixture(scope="module")
def problem(right):
    """A ball, three synergies, everything by default."""
    return gp.GraspProblem(right, BALL)


@pytest.fixture(scope="module")
def grasps(problem):
    """Three grasps of it that differ."""
    return gp.plan_grasps(problem, 3, options=FEW)


def test_weights_are_the_papers_or_none(right, problem):
    assert not problem.parameters.weighted
    assert (gp.GraspProblem.paper(right, BALL).parameters.force_weight) == 1e-6
    one = gp.GraspProblem(right, BALL, parameters=gp.GraspParameters(force_weight=0.1)).parameters
    assert (one.force_weight, one.task_weight) == (0.1, 1.0)
    other = gp.GraspProblem(right, BALL, parameters=gp.GraspParameters(task_weight=2.0)).parameters
    assert (other.force_weight, other.task_weight) == (1e-6, 2.0)
    assert one.without_hand(right).force_weight == 0.1


def test_the_best_task_takes_at_most_a_multiple_of_the_least_force(problem, grasps):
    best = grasps[0]
    assert best.feasible
    assert best.search.least_force <= best.force_norm * 1.001
    assert best.force_norm <= problem.parameters.force_factor * best.search.least_force * (1 + 1e-5)
    closing = problem.parameters.closing_preference * ClosingNormals().clear_value(best)
    assert best.objective == pytest.approx(best.task_index + closing, rel=1e-9) and closing > 0.0


def test_no_finger_idles(problem, grasps):
    least = problem.parameters.least_share
    assert least == 0.05
    for grasp in grasps:
        assert grasp.normal_forces.min() >= (least - 1e-5) * grasp.normal_forces.sum()
    terms = {term.name for term in problem_constraints(problem)}
    freer = replace(problem, parameters=replace(problem.parameters, least_share=0.0))
    assert terms - {term.name for term in problem_constraints(freer)} == {"finger_share"}
    assert "finger_share" not in grasps[0].violations, "an idle finger is no violation"


def test_a_larger_factor_buys_a_better_task(problem, grasps):
    parameters = replace(problem.parameters, force_factor=4.0)
    start = gp.GraspStart(grasps[0].joint_angles, grasps[0].palm_pose, np.zeros(3), grasps[0].contact_forces)
    freer = gp.plan_grasp(
        replace(problem, parameters=parameters), start=start, options=gp.PlannerOptions(starts=1, enough=1)
    )
    assert freer.feasible
    assert freer.task_index < grasps[0].task_index


def test_several_grasps_differ_and_are_in_order(grasps):
    assert len(grasps) == 3
    assert all(grasp.feasible for grasp in grasps)
    assert not any(alike(a, b) for i, a in enumerate(grasps) for b in grasps[:i])
    assert all(alike(grasp, grasp) for grasp in grasps)
    assert [grasp.closing.holds for grasp in grasps] == sorted((g.closing.holds for g in grasps), reverse=True)


@pytest.mark.parametrize("count", [0, -1, 1001, True, 1.5])
def test_a_count_out_of_range_is_named(problem, count):
    with pytest.raises(gp.InvalidValueError, match="count"):
        gp.plan_grasps(problem, count)


def test_a_list_is_read_by_number(grasps, tmp_path):
    file = tmp_path / "several.json"
    file.write_text(grasp_list_json(grasps), encoding="utf-8")
    assert len(json.loads(file.read_text())) == 3
    for number, grasp in enumerate(grasps, start=1):
        found = gp.grasp_from_record(gp.read_grasp_record(tmp_path / f"several.json#{number}"))
        np.testing.assert_array_equal(found.joint_angles, grasp.joint_angles)
        assert found.search.least_force == grasp.search.least_force
        assert found.problem == grasp.problem
    assert gp.read_grasp_record(file) == gp.read_grasp_record(tmp_path / "several.json#1")
    with pytest.raises(gp.FileFormatError, match="holds 3 grasps, not 4"):
        gp.read_grasp_record(tmp_path / "several.json#4")
    with pytest.raises(gp.FileFormatError, match="holds 0 grasps"):
        parse_grasp_record(b"[]", "empty")


def test_the_command_writes_a_list(tmp_path, capsys):
    file = tmp_path / "several.json"
    arguments = ["plan", "--object", "sphere:radius=0.035", "--grasps", "2", "--starts", "6", "--json", str(file)]
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 0
    assert "2 of 2 grasps that differ" in capsys.readouterr().out
    assert [entry["feasible"] for entry in json.loads(file.read_text())] == [True, True]


def test_the_floor_with_load_cases_lies_between_the_floor_without_and_the_force(grasps):
    for grasp in grasps:
        assert grasp.force_norm_floor < grasp.load_force_floor <= grasp.force_norm * (1 + 1e-6)
        quiet = gp.Grasp(
            replace(grasp.problem, loads=gp.LoadCases.off()),
            grasp.joint_angles,
            grasp.palm_pose,
            grasp.delta_sigma,
            grasp.contact_forces,
        )
        assert quiet.load_force_floor == quiet.force_norm_floor


def test_forces_a_little_above_the_floor_exist_and_below_it_do_not(grasps):
    """Any forces at these contacts that hold all cases have at least the floor: those found by descent, too."""
    grasp = grasps[0]
    loads = grasp.problem.loads
    harder = replace(grasp.problem, loads=replace(loads, force=1.2 * loads.force))
    again = gp.Grasp(harder, grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma, grasp.contact_forces)
    assert again.load_force_floor > grasp.load_force_floor
    assert np.isclose(again.force_norm_floor, grasp.force_norm_floor)


@pytest.mark.parametrize("name", ["round_sphere", "push"])
def test_derivatives_of_little_force(name):
    grasp = stored(name)
    program = GraspProgram(grasp.problem, grasp.palm_pose)
    z = program.pack(grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma, grasp.contact_forces)
    _, slope = _little_force(program.state(z), 1e-5)
    numeric = central_differences(lambda at: [_little_force(program.state(at), 1e-5)[0]], z, 1e-5)
    assert relative_error(slope * program.scale, numeric) < 1e-6


def test_post_optimality_keeps_the_force_the_search_allowed(grasps):
    program = OptimalityProgram(grasps[0])
    assert most_force(grasps[0]) == pytest.approx(1.5 * grasps[0].search.least_force, rel=1e-4)
    assert any(name.startswith("most_force") for name in program.names())
    rows = program.terms.index(next(term for term in program.terms if term.name == "most_force"))
    term = program.terms[rows]
    state = program.base.state(program.z)
    assert term.residual(program.base.problem, state)[0] == pytest.approx(program.most_force - grasps[0].force_norm)
    given = replace(grasps[0], search=None)
    assert most_force(given) == given.force_norm


def test_squeezing_moves_the_motors_and_nothing_else(grasps):
    grasp = grasps[0]
    forces = squeezed_forces(grasp, grasp.contact_forces, 2.0)
    change = (forces - grasp.contact_forces).ravel()
    by_motors = command_matrix(grasp.problem, grasp.grasp_matrix, grasp.hand_jacobian)
    moved, *_ = np.linalg.lstsq(by_motors, change, rcond=None)
    np.testing.assert_allclose(by_motors @ moved, change, atol=1e-6)
    np.testing.assert_allclose(grasp.grasp_matrix @ change, 0.0, atol=1e-9)
    assert np.linalg.norm(change) > 0.1
    np.testing.assert_allclose(squeezed_forces(grasp, grasp.contact_forces, 1.0), grasp.contact_forces, atol=1e-8)
