"""The reason when no grasp is found, and the smallest change that would do."""

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.analysis.knobs import problem_knobs
from grasp_planner.planning.program import GraspProgram

FEW = gp.PlannerOptions(starts=3, max_iterations=120)


@pytest.fixture(scope="module")
def slippery(right):
    """Three synergies and next to no friction."""
    parameters = gp.GraspParameters(friction=0.05)
    return gp.plan_grasp(gp.GraspProblem.paper(right, gp.Cylinder(), n_synergies=3, parameters=parameters), options=FEW)


def test_the_least_violated_point_is_no_worse(slippery):
    least = gp.analysis.least_violated_point(slippery)

    def size(grasp):
        program = GraspProgram(grasp.problem, grasp.palm_pose)
        state = program.state(program.pack(grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma))
        residuals = [(term, term.scale * term.residual(grasp.problem, state)) for term in program.constraints]
        violated = [value if term.equality else np.minimum(value, 0.0) for term, value in residuals]
        return float(np.linalg.norm(np.concatenate(violated)))

    assert size(least) <= max(size(slippery), 1e-3)


@pytest.mark.slow
def test_more_friction_is_among_the_cures_of_slipping(slippery):
    assert not slippery.feasible
    diagnosis = gp.analysis.explain_infeasibility(slippery, time_limit_s=120.0, only=("friction", "number"))
    cures = {change.parameter: change for change in diagnosis.changes}
    assert "friction μ" in cures
    cure = cures["friction μ"]
    assert cure.needed > cure.current
    assert cure.grasp.feasible, "the cure is proved by a grasp"
    assert cure.grasp.problem.parameters.friction == cure.needed
    assert cure.text in diagnosis.text
    assert list(diagnosis.changes) == sorted(diagnosis.changes, key=lambda change: change.relative)


@pytest.mark.slow
def test_a_cylinder_too_large_for_the_hand_has_to_shrink(right):
    problem = gp.GraspProblem.paper(right, gp.Cylinder(radius=0.12), n_synergies=3)
    attempt = gp.plan_grasp(problem, options=FEW)
    assert not attempt.feasible
    diagnosis = gp.analysis.explain_infeasibility(attempt, time_limit_s=120.0, only=("size",))
    assert diagnosis.least_violated.failures()[diagnosis.binding.name] == diagnosis.binding
    assert diagnosis.binding.text in diagnosis.text.replace("stays violated by ", "")
    smaller = {change.parameter: change for change in diagnosis.changes}["size of the object (smaller)"]
    assert smaller.needed < 1.0
    assert smaller.grasp.problem.grasp_object.radius == pytest.approx(0.12 * smaller.needed)


def test_without_time_nothing_is_claimed(slippery):
    diagnosis = gp.analysis.explain_infeasibility(slippery, time_limit_s=1e-9)
    assert not diagnosis.changes
    assert not diagnosis.not_enough
    assert "lack of time" in diagnosis.text


@pytest.mark.parametrize("synergy_set", ["motors_2", "thumb_and_fingers", "native_clear"])
def test_no_more_synergies_are_tried_than_the_set_has(right, synergy_set):
    problem = gp.GraspProblem(right, gp.Sphere(0.03), n_synergies=2, synergy_set=synergy_set)
    knob = next(each for each in problem_knobs(problem) if each.name == "number of synergies")
    assert knob.steps == tuple(range(3, problem.all_synergies.n_synergies + 1))
    for step in knob.steps:
        assert knob.apply(step).n_synergies == step
