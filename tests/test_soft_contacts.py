"""Soft fingers, frictionless contacts and one friction a contact, through search, judge, files and settings."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.analysis.knobs import problem_knobs
from grasp_planner.analysis.problem_parameters import parameters_of
from grasp_planner.model import Frictionless, HardFinger, SoftFinger
from grasp_planner.problem.from_settings import problem_from_settings
from grasp_planner.records.grasp_files import parse_grasp_record
from tests.test_state import check_all, random_point

LOADS = gp.LoadCases(force=1.0, torque=0.02, position_error=1e-4)
CASES = {
    "soft points": (SoftFinger(torsion=0.01), "point", gp.Box(edge=0.01), gp.LoadCases.off()),
    "soft balls": (SoftFinger(torsion=0.01), "sphere", gp.EllipsoidObject(), LOADS),
    "frictionless": (Frictionless(), "power", gp.EllipsoidObject(), LOADS),
    "hard": (HardFinger(), "sphere", gp.EllipsoidObject(), LOADS),
}


def problem_of(hand, case):
    model, contact_set, shape, loads = CASES[case]
    friction = tuple(np.linspace(0.4, 0.9, len(hand.contact_frames(contact_set))).tolist())
    parameters = gp.GraspParameters(contact_model=model, friction=friction)
    tasks = (gp.force_task([1.0, 1.0, 0.0]), gp.torque_task([0.0, 0.2, 1.0], 0.3))
    return gp.GraspProblem.paper(hand, shape, tasks, 8, parameters, contact_set=contact_set, loads=loads)


@pytest.mark.parametrize("case", CASES)
def test_derivatives_of_all_terms(right, case, rng):
    check_all(problem_of(right, case), rng)


@pytest.mark.parametrize("case", CASES)
def test_search_and_judge_agree(right, case, rng):
    """The fused evaluation against the clear formulas, and forces and moments against the wrench they make."""
    problem = problem_of(right, case)
    evaluator, x = random_point(problem, rng)
    state, layout = evaluator.evaluate(x), evaluator.layout
    grasp = gp.Grasp(problem, x[layout.joints], evaluator.palm_pose(x), x[layout.displacement])
    np.testing.assert_allclose(state.geometry.grasp, grasp.grasp_matrix, atol=1e-13)
    np.testing.assert_allclose(state.geometry.jacobian, grasp.hand_jacobian, atol=1e-13)
    size = np.abs(grasp.intensities).max()
    np.testing.assert_allclose(state.intensities, grasp.intensities, atol=1e-8 * size)
    np.testing.assert_allclose(state.forces, grasp.forces, atol=1e-8 * size)
    np.testing.assert_allclose(state.friction_margins, grasp.friction_margins, atol=2e-3 + 1e-8 * size)
    assert state.task_index == pytest.approx(grasp.task_index, rel=1e-6)
    points, forces = grasp.contacts.points, grasp.forces
    wrench = np.concatenate([forces.sum(axis=0), (np.cross(points, forces) + grasp.moments).sum(axis=0)])
    np.testing.assert_allclose(wrench, -problem.external_wrench, atol=1e-8 * size)
    if state.loads is not None:
        assert state.loads.friction.min() == pytest.approx(grasp.load_check.friction, abs=2e-3 + 1e-8 * size)


@pytest.fixture(scope="module")
def pinched(right):
    """A grasp by thumb and index alone, with soft fingertips of different friction."""
    parameters = gp.GraspParameters(contact_model=SoftFinger(torsion=0.005), friction=(0.7, 0.8))
    problem = gp.GraspProblem(right, gp.Cylinder(), parameters=parameters, contacts=("thumb", "index"))
    return gp.plan_grasp(problem, options=gp.PlannerOptions(enough=1))


def test_two_soft_fingers_are_planned(pinched):
    """Feasible by the judge; each moment within the cone of its own contact, and needed."""
    assert pinched.feasible, pinched.verdict
    turned = np.linalg.norm(pinched.moments, axis=1) / 0.005
    along = pinched.normal_forces
    across = np.linalg.norm(pinched.forces - along[:, None] * pinched.contacts.normals, axis=1)
    assert (np.hypot(across, turned) <= np.array([0.7, 0.8]) * along + 1e-6).all()
    assert turned.max() > 1e-3
    assert pinched.force_norm_floor <= pinched.force_norm * (1.0 + 1e-6)
    assert 0.0 < pinched.margins.passive.size <= pinched.margins.active.size / 0.86 * (1.0 + 1e-3)
    assert pinched.passive_margin.size >= 1.0 - 1e-6  # the push that it was planned for


def test_a_soft_grasp_survives_its_file(right, pinched):
    text = gp.grasp_json(pinched)
    record = parse_grasp_record(text.encode(), "text")
    assert record.parameters.contact_model == "soft:torsion=0.005" and record.parameters.friction == [0.7, 0.8]
    np.testing.assert_allclose([each.moment for each in record.contacts], pinched.moments)
    again = gp.grasp_from_record(record, right)
    assert again.problem == pinched.problem and again.feasible
    with pytest.raises(gp.NameNotFoundError, match="contact_model 'foam'"):
        gp.grasp_from_record(parse_grasp_record(text.replace("soft:torsion", "foam:torsion").encode(), "text"))


def test_settings_by_text(right):
    settings = {"friction": "0.7,0.8", "contact_model": "soft:torsion=0.004", "contacts": "thumb,index"}
    problem = problem_from_settings(right, gp.Cylinder(), (gp.force_task([0.0, 1.0, 0.0]),), settings)
    assert problem.contact_model == SoftFinger(torsion=0.004)
    np.testing.assert_array_equal(problem.friction, [0.7, 0.8])


def test_one_friction_for_all_is_that_friction_for_each(right):
    one = gp.GraspProblem(right, gp.Cylinder(), parameters=gp.GraspParameters(friction=0.6))
    each = gp.GraspProblem(right, gp.Cylinder(), parameters=gp.GraspParameters(friction=(0.6,) * 5))
    assert one == each and hash(one) == hash(each)


def test_what_does_not_fit_is_refused_in_one_line(right):
    ball = gp.Sphere()
    for named, message in (
        ({"friction": (0.5, 0.6)}, "friction: got .*one number, or 5"),
        ({"friction": (0.5, -0.6, 0.1, 0.1, 0.1)}, "friction: got"),
        ({"friction": ((0.5,), (0.6,))}, "friction: got"),
        ({"contact_model": Frictionless()}, "at least 7 contact frames where contacts are frictionless"),
        ({"contact_model": "hard"}, "contact_model: got 'hard', allowed: one of hard"),
    ):
        with pytest.raises(gp.InvalidValueError, match=message) as caught:
            gp.GraspProblem(right, ball, parameters=gp.GraspParameters(**named))
        assert "\n" not in str(caught.value)
    two = {"contacts": ("thumb", "index")}
    assert gp.GraspProblem(right, ball, parameters=gp.GraspParameters(contact_model=SoftFinger()), **two)
    with pytest.raises(gp.InvalidValueError, match="at least 3 contact frames where contacts are hard"):
        gp.GraspProblem(right, ball, **two)


def test_uneven_friction_is_varied_by_a_factor(right, pinched):
    knob = next(each for each in problem_knobs(pinched.problem) if each.name.startswith("friction"))
    assert knob.current == 1.0
    np.testing.assert_allclose(knob.apply(1.5).friction, [1.05, 1.2])
    parameter = next(each for each in parameters_of(pinched) if each.name.startswith("friction"))
    np.testing.assert_allclose(parameter.apply(0.1).friction, [0.77, 0.88])
    slick = replace(pinched.problem, parameters=replace(pinched.problem.parameters, friction=0.5))
    assert next(each for each in problem_knobs(slick) if each.name.startswith("friction")).apply(0.7).friction[1] == 0.7
    smooth = problem_of(right, "frictionless")
    assert not [each for each in problem_knobs(smooth) if each.name.startswith("friction")]
