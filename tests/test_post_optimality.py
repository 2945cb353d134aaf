"""Post-optimality: predicted against solved anew, the validity radius, tolerance and improvement."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.analysis.improve import withstood
from grasp_planner.analysis.optimality_program import OptimalityProgram
from grasp_planner.analysis.problem_parameters import parameters_of
from grasp_planner.analysis.sensitivity import optimum_near, post_optimality
from grasp_planner.analysis.tolerance import least_tolerance
from grasp_planner.analysis.validity import Prediction, carried_palm
from grasp_planner.evaluation.state import StateEvaluator
from grasp_planner.judge.load_check import case_forces
from grasp_planner.model.compliance import series_stiffness
from grasp_planner.optimisation.kkt import kkt_point
from tests.stored import stored


def settled(n_synergies, loads):
    """Return a stored optimum of the native synergies."""
    grasp = optimum_near(stored(f"native_{n_synergies}{'_push' if loads.active else ''}"))
    assert grasp.feasible
    return grasp


@pytest.fixture(scope="module")
def plain():
    """The optimum of the paper's problem with three synergies."""
    return settled(3, gp.LoadCases.off())


def check_against_solving_anew(grasp, names):
    """Compare dF*/dp and dz*/dp with central differences of optima solved anew, well inside the validity radius."""
    parameters = {parameter.name: parameter for parameter in parameters_of(grasp)}
    found = post_optimality(grasp, [parameters[name] for name in names])
    assert found.stationarity < 1e-6
    for sensitivity in found.sensitivities:
        parameter = parameters[sensitivity.name]
        step = min(0.2 * sensitivity.up, 0.2 * sensitivity.down, 0.01 * parameter.scale)
        assert step > 0.0
        sides = [optimum_near(replace(found.grasp, problem=parameter.apply(sign * step))) for sign in (1, -1)]
        force = (sides[0].force_norm - sides[1].force_norm) / (2 * step)
        objective = (sides[0].objective - sides[1].objective) / (2 * step)
        assert sensitivity.d_force_norm == pytest.approx(force, rel=0.05), sensitivity.name
        assert sensitivity.d_objective == pytest.approx(objective, rel=0.05), sensitivity.name
    return found


@pytest.mark.slow
def test_three_synergies_answer_as_predicted(plain):
    found = check_against_solving_anew(plain, ["friction μ", "mass", "object rx"])
    assert found.sensitivity("friction μ").d_force_norm < 0.0, "more friction, less force"
    assert found.sensitivity("mass").d_force_norm > 0.0
    assert found.curvature > 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n_synergies", "loads"),
    [(3, gp.LoadCases()), (15, gp.LoadCases()), (15, gp.LoadCases.off())],
    ids=["3, loads", "15, loads", "15, paper"],
)
def test_optima_answer_as_predicted(n_synergies, loads):
    names = ["friction μ", "mass", "object size", "object rx"]
    if loads.active:
        names.append("joint compliance")
    check_against_solving_anew(settled(n_synergies, loads), names)


def test_the_posture_answers_as_predicted(plain):
    mass = next(parameter for parameter in parameters_of(plain) if parameter.name == "mass")
    sensitivity = post_optimality(plain, [mass]).sensitivities[0]
    step = 1e-3
    after = optimum_near(replace(plain, problem=mass.apply(step)))
    moved = (after.joint_angles - plain.joint_angles) / step
    np.testing.assert_allclose(sensitivity.d_joint_angles, moved, atol=0.05 * np.abs(moved).max())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n_synergies", "loads"),
    [(3, gp.LoadCases()), (3, gp.LoadCases.off()), (15, gp.LoadCases())],
    ids=["3, loads", "3, paper", "15, loads"],
)
def test_within_the_validity_radius_the_force_changes_as_predicted(n_synergies, loads):
    grasp = settled(n_synergies, loads)
    names = ("object size", "object rx", "object ry", "friction μ", "mass", "joint compliance", "contact stiffness")
    parameters = [parameter for parameter in parameters_of(grasp) if parameter.name in names]
    found = post_optimality(grasp, parameters)
    ends = set()
    for parameter, sensitivity in zip(parameters, found.sensitivities, strict=True):
        ends |= {sensitivity.ends_up, sensitivity.ends_down}
        for step in (0.95 * sensitivity.up, -0.95 * sensitivity.down):
            assert abs(step) > 1e-3 * parameter.scale, (parameter.name, step)
            again = optimum_near(replace(found.grasp, problem=parameter.apply(step)))
            told = step * sensitivity.d_force_norm
            off = abs(again.force_norm - found.grasp.force_norm - told)
            assert off <= 0.05 * abs(told) + 2e-6 * grasp.force_norm, (parameter.name, step, off, told)
    assert any("off by 5 %" in end for end in ends), "to first order the ranges were longer"


@pytest.mark.slow
def test_beyond_the_validity_radius_the_force_changes_otherwise(plain):
    size = next(parameter for parameter in parameters_of(plain) if parameter.name == "object size")
    found = post_optimality(plain, [size])
    sensitivity = found.sensitivities[0]
    assert "off by 5 %" in sensitivity.ends_up
    step = 2.0 * sensitivity.up
    told = step * sensitivity.d_force_norm
    again = optimum_near(replace(found.grasp, problem=size.apply(step)))
    assert abs(again.force_norm - found.grasp.force_norm - told) > 0.06 * abs(told)


@pytest.mark.slow
def test_beyond_the_validity_radius_the_active_set_has_changed():
    grasp = settled(3, gp.LoadCases())
    turn = next(parameter for parameter in parameters_of(grasp) if parameter.name == "object rz")
    first = post_optimality(grasp, [turn])
    sensitivity = first.sensitivities[0]
    assert sensitivity.ends_down.endswith("becomes active")
    names = {name for name, _ in first.active}

    def active_after(step):
        moved = optimum_near(replace(first.grasp, problem=turn.apply(step)))
        return {name for name, _ in post_optimality(moved, []).active}

    assert active_after(-0.8 * sensitivity.down) == names
    assert active_after(-2.0 * sensitivity.down) != names


@pytest.fixture
def evaluations(monkeypatch):
    """How many states were evaluated, as a list of one number."""
    count, evaluate = [0], StateEvaluator.evaluate

    def counting(self, x):
        count[0] += 1
        return evaluate(self, x)

    monkeypatch.setattr(StateEvaluator, "evaluate", counting)
    return count


def test_all_parameters_of_a_plan_are_answered_in_few_evaluations(evaluations):
    found = post_optimality(stored("clear"))
    assert found.stationarity < 1e-9
    assert len(found.sensitivities) == 15
    assert evaluations[0] < 600, "of 2 ms each"


def test_a_plan_far_from_an_optimum_is_said_to_be_so_and_costs_no_more(evaluations):
    found = post_optimality(stored("loads"))
    assert found.stationarity > 1e-6
    assert evaluations[0] < 600
    assert {(each.down, each.up) for each in found.sensitivities} == {(0.0, 0.0)}
    assert any("no optimum" in each.ends_up for each in found.sensitivities)


def test_neighbours_share_the_clearances_that_are_the_same():
    program = OptimalityProgram(stored("clear"))
    evaluator, problem = program.base.evaluator, program.base.problem
    softer = replace(problem, parameters=replace(problem.parameters, friction=0.7))
    larger = replace(problem, grasp_object=problem.grasp_object.resized(1.01))
    x = program.z * program.base.scale
    for other, shares in ((softer, True), (larger, False)):
        assert evaluator._posed.clearance.serves(other) is shares
        shared = StateEvaluator(other, program.reference, evaluator).evaluate(x)
        own = StateEvaluator(other, program.reference).evaluate(x)
        np.testing.assert_allclose(shared.clearance.link_object, own.clearance.link_object, atol=1e-12)


def test_forces_alone_move_no_contact_and_other_contacts_are_not_taken_for_the_same():
    program = OptimalityProgram(stored("clear"))
    evaluator, problem = program.base.evaluator, program.base.problem
    x = program.z * program.base.scale
    pressed, moved = x.copy(), x.copy()
    pressed[evaluator.layout.forces] *= 1.1
    moved[evaluator.layout.joints] += 0.01
    first = evaluator.evaluate(x)
    assert evaluator.evaluate(pressed).geometry is first.geometry
    assert evaluator.evaluate(moved).geometry is not first.geometry
    softer = replace(problem, parameters=replace(problem.parameters, friction=0.7))
    soft = replace(problem, parameters=replace(problem.parameters, contact_model=gp.model.SoftFinger()))
    for other, same in ((softer, True), (soft, False)):
        assert (StateEvaluator(other, program.reference, evaluator)._posed is evaluator._posed) is same
    elsewhere = StateEvaluator(softer, program.base.evaluator.palm_pose(x), evaluator)
    assert elsewhere._posed is not evaluator._posed, "another chart has other derivatives"


def test_with_the_palm_held_the_palm_stays_where_it_is_in_the_world():
    grasp = settled(15, gp.LoadCases.off())
    held = {parameter.name: parameter for parameter in parameters_of(grasp) if parameter.palm is not None}
    program = OptimalityProgram(grasp)
    found = kkt_point(program.evaluate, program.z)
    for name, step in (("object ry (palm held)", 0.3), ("object x (palm held)", 0.02)):
        blank = Prediction(program, found, [], held[name], found.z, found.multipliers, found.z, 0.0, None)
        carried = carried_palm(blank, step)
        moved = pin.SE3(pin.exp3(step * np.array([0.0, 1.0, 0.0])), np.zeros(3))  # of the object in the world
        if name.startswith("object x"):
            moved = pin.SE3(np.eye(3), np.array([step, 0.0, 0.0]))
        assert grasp.palm_pose.near(moved * carried, 1e-6)


def test_turning_the_object_about_its_axis_of_symmetry_changes_nothing(plain):
    turned = [parameter for parameter in parameters_of(plain) if parameter.name == "object rz"]
    sensitivity = post_optimality(plain, turned).sensitivities[0]
    assert abs(sensitivity.d_force_norm) < 1e-6
    np.testing.assert_allclose(sensitivity.d_joint_angles, 0.0, atol=1e-6)


def test_with_few_motors_the_hand_cannot_follow_with_its_palm_held(plain):
    moved = [parameter for parameter in parameters_of(plain) if parameter.name == "object y (palm held)"]
    sensitivity = post_optimality(plain, moved).sensitivities[0]
    assert not sensitivity.follows
    assert np.isnan(sensitivity.d_force_norm)
    assert sensitivity.up == 0.0


@pytest.fixture(scope="module")
def held():
    return stored("native_5_half")


def test_at_its_tolerance_a_contact_starts_to_slip(held):
    series = series_stiffness(held.hand_jacobian, 0.1, 1e5)
    for tolerance, axis in zip(gp.analysis.pose_tolerances(held), np.eye(6), strict=True):
        for motion, gives_way in (
            (tolerance.up * axis, tolerance.gives_way_up),
            (-tolerance.down * axis, tolerance.gives_way_down),
        ):
            assert np.abs(motion).max() > 0.0
            forces = case_forces(held.forces, series @ held.grasp_matrix.T, motion[None])[0]
            slack = gp.model.friction_margins(forces, held.contacts.normals, 0.8)
            assert slack.min() > -1e-9
            if gives_way.startswith("friction"):
                names = [frame.name for frame in held.problem.frames]
                assert names[int(np.argmin(slack))] == gives_way.removeprefix("friction at ")
                assert slack.min() == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("synergy_set", ["native", "santello"])
@pytest.mark.parametrize("goal", ["force", "position", "rotation"])
def test_improvement_withstands_more_within_its_budget(right, goal, synergy_set):
    problem = gp.GraspProblem.paper(right, gp.Cylinder(), n_synergies=5, synergy_set=synergy_set)
    plain = gp.plan_grasp(problem, options=gp.PlannerOptions(enough=1))
    improved = gp.analysis.improve_grasp(plain, goal=goal, budget=0.5, trials=4)
    assert improved.after.feasible
    assert improved.after.force_norm <= 1.5 * plain.force_norm + 1e-5
    assert withstood(improved.after, goal) > withstood(plain, goal)
    reached = max(step.disturbance for step in improved.steps if step.feasible)
    assert withstood(improved.after, goal) >= 0.8 * reached, "friction is held on the hull of 14 directions"


def test_a_plan_beyond_the_limits_of_the_hand_is_brought_within(right):
    hard = stored("beyond_limits")
    plain = replace(hard, problem=replace(hard.problem, loads=gp.LoadCases.off()))
    assert plain.normal_forces.max() > right.max_normal_force, "without load cases nothing limits it"
    assert withstood(plain, "force") == 0.0
    improved = gp.analysis.improve_grasp(plain, budget=0.2, trials=3).after
    assert improved.normal_forces.max() <= right.max_normal_force + 1e-6
    assert (np.abs(improved.joint_torques) <= right.torque_limits + 1e-6).all()
    assert withstood(improved, "force") > 0.2


def test_the_least_tolerance_is_that_of_the_worst_direction(held):
    single = min(min(t.up, t.down) for t in gp.analysis.pose_tolerances(held) if t.unit == "m")
    assert 0.0 < least_tolerance(held, "m") <= single


def test_only_feasible_grasps_are_improved(planned):
    broken = gp.Grasp(planned.problem, planned.joint_angles, planned.palm_pose, 0 * planned.delta_sigma)
    with pytest.raises(gp.InvalidValueError, match="feasible"):
        gp.analysis.improve_grasp(broken)
