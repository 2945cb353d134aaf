"""Small costs: gradients, the judge's own formula, values known by hand, and what a weight does to a plan."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.evaluation.state import StateEvaluator
from grasp_planner.terms.objective import SMALL_COSTS, problem_objective
from grasp_planner.terms.sharing import ForceSharing
from grasp_planner.terms.stops import JointStops
from tests.finite_differences import central_differences, relative_error
from tests.stored import stored

WEIGHTS = {cost.setting: 0.3 for cost in SMALL_COSTS}


@pytest.fixture(scope="module", params=["clear", "native_5_half"])
def grasp(request):
    """A grasp by springs and one by eq. (17)."""
    return stored(request.param)


@pytest.mark.parametrize("cost", SMALL_COSTS, ids=lambda cost: cost.name)
def test_gradients_equal_central_differences_and_the_judge_agrees(grasp, cost, rng):
    evaluator = StateEvaluator(grasp.problem, grasp.palm_pose)
    x = evaluator.pack(grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma, grasp.contact_forces)
    state = evaluator.evaluate(x)
    assert cost.value(grasp.problem, state) == pytest.approx(cost.clear_value(grasp), rel=1e-5)
    x = x + 1e-2 * np.abs(x).max() * 1e-2 * rng.normal(size=x.size)
    analytic = cost.gradient(grasp.problem, evaluator.evaluate(x))
    steps = np.full(x.size, 1e-5)
    numeric = central_differences(lambda y: [cost.value(grasp.problem, evaluator.evaluate(y))], x, steps)
    assert relative_error(analytic, numeric) < 1e-4


def test_values_known_by_hand(grasp):
    hand = grasp.problem.hand
    on_stops = replace(grasp, joint_angles=np.array(hand.upper))
    middle = replace(grasp, joint_angles=0.5 * (hand.lower + hand.upper))
    assert JointStops().clear_measure(on_stops) == pytest.approx(1.0)
    assert JointStops().clear_measure(middle) == pytest.approx(0.0, abs=1e-12)

    class Even:
        normal_forces = np.full(4, 2.0)

    class Alone:
        normal_forces = np.array([3.0, 0.0, 0.0, 0.0])

    assert ForceSharing().clear_measure(Even()) == pytest.approx(0.0, abs=1e-6)
    assert ForceSharing().clear_measure(Alone()) == pytest.approx(3.0, rel=1e-6)


def test_each_is_off_unless_its_weight_is_given(grasp):
    plain = problem_objective(grasp.problem).terms
    by_itself = [] if grasp.problem.parameters.weighted else ["closing_normals"]
    assert [each.cost.name for each in plain] == ["force_norm", "task_index", *by_itself]
    asked = replace(grasp.problem, parameters=replace(grasp.problem.parameters, **WEIGHTS))
    terms = problem_objective(asked).terms
    assert {each.cost.name for each in terms} == {"force_norm", "task_index", *(cost.name for cost in SMALL_COSTS)}
    task = terms[1].weight
    assert [each.weight for each in terms[2:]] == pytest.approx([0.3 * task] * 4)


@pytest.mark.slow
def test_with_its_weight_fingers_share_more():
    grasp = stored("clear")
    asked = replace(grasp.problem, parameters=replace(grasp.problem.parameters, sharing_weight=10.0))
    start = gp.GraspStart(grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma, grasp.contact_forces)
    once = gp.PlannerOptions(starts=1, enough=1)
    plain, shared = (gp.plan_grasp(problem, start=start, options=once) for problem in (grasp.problem, asked))
    assert plain.feasible and shared.feasible
    assert ForceSharing().clear_measure(shared) < ForceSharing().clear_measure(plain)
