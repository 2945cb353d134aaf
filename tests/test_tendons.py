"""Hands driven by force: tendons as soft synergies, limits of tensions, motors that hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.closing.path import reference_path
from grasp_planner.judge.load_check import response_matrix
from grasp_planner.model.quasi_static import CompliantGrasp, quasi_static_maps
from grasp_planner.model.tendons import held_compliance, tension_change
from grasp_planner.problem.tendon_drive import driving_tendons, passive_compliance, tension_map
from grasp_planner.terms.registry import judged_requirements
from grasp_planner.terms.tension import Tension
from tests.finite_differences import central_differences, relative_error
from tests.test_full_compliance import rows, spd
from tests.test_loads import LOADS
from tests.test_loads import check_derivatives as check_load_derivatives
from tests.test_multistart import compare_rows
from tests.test_state import check_all, grasp_at, random_point, steps_of


@pytest.fixture(scope="module")
def hand():
    return gp.load_hand("tendon_hand")


def make_problem(hand, n_synergies=4, law="springs", **changes):
    parameters = gp.GraspParameters(force_law=law, **changes.pop("parameters", {}))
    fields = {"n_synergies": n_synergies, "parameters": parameters, **changes}
    return gp.GraspProblem.paper(hand, gp.Sphere(radius=0.035, mass=0.1), **fields)


def test_tensions_bend_the_free_hand_as_the_springs_say(hand):
    """E (q − q₀) = Rᵀ t: the synergies of tendons are the rest of springs and tensions."""
    problem, tendons = make_problem(hand), hand.tendons
    tension = np.array([10.0, 20.0, 5.0, -0.3])
    sigma = tension * tendons.scales(problem.joint_compliance)
    q = problem.synergies.joint_angles(sigma)
    np.testing.assert_allclose((q - tendons.rest) / problem.joint_compliance, tendons.arms.T @ tension, atol=1e-12)
    np.testing.assert_allclose(tension_map(problem, tendons) @ (q - tendons.rest), tension)
    assert q[hand.joint_index("thumb_proximal")] == pytest.approx(-0.25 + 10.0 * 0.010 / 0.8)


def test_the_synergies_follow_the_springs_of_the_problem(hand, rng):
    c_q = spd(7, rng)
    problem = make_problem(hand, parameters={"joint_compliance": rows(c_q)})
    expected = c_q @ hand.tendons.arms.T
    np.testing.assert_allclose(problem.synergies.basis, expected / np.linalg.norm(expected, axis=0), atol=1e-12)
    assert hand.synergy_set_names == ("tendons",) and hand.synergies().name == "tendons"


@pytest.mark.parametrize("full", [False, True])
def test_held_lengths_are_a_series_of_springs(full, rng):
    """Lagrange multipliers of R δq = 0 at the springs give compliance and tensions; tendons add no softness."""
    c_q = spd(7, rng) if full else rng.uniform(0.1, 1.0, 7)
    arms, torques = rng.normal(size=(3, 7)), rng.normal(size=7)
    stiffness = np.linalg.inv(c_q if full else np.diag(c_q))
    system = np.block([[stiffness, -arms.T], [arms, np.zeros((3, 3))]])
    moved, tension = np.split(np.linalg.solve(system, np.concatenate([-torques, np.zeros(3)])), [7])
    held = held_compliance(c_q, arms)
    np.testing.assert_allclose(-held @ torques, moved, atol=1e-12)
    np.testing.assert_allclose(tension_change(c_q, arms) @ torques, tension, atol=1e-12)
    assert np.linalg.eigvalsh(held).min() > -1e-12
    np.testing.assert_allclose(held @ arms.T, 0.0, atol=1e-12)


def test_the_planned_posture_obeys_the_same_law_whatever_the_motors_hold(hand):
    problem = make_problem(hand)
    complement = problem.synergies.complement()
    held, free = passive_compliance(problem), np.diag(problem.joint_compliance)
    np.testing.assert_allclose(complement.T @ held, complement.T @ free, atol=1e-12)
    assert np.abs(held - free).max() > 0.1


def test_load_cases_are_those_of_motors_without_softness(hand, rng):
    """A motor's compliance of C_z = −(R C_q Rᵀ)⁻¹ takes back what a constant tension would yield."""
    problem = make_problem(hand)
    evaluator, x = random_point(problem, rng)
    grasp = grasp_at(evaluator, x)
    arms, c_q = hand.tendons.arms, problem.joint_compliance
    springs = CompliantGrasp(
        grasp.grasp_matrix,
        grasp.hand_jacobian,
        c_q[:, None] * arms.T,
        np.eye(9) / problem.parameters.contact_stiffness,
        np.diag(c_q),
        -np.linalg.inv((arms * c_q) @ arms.T),
    )
    response = response_matrix(problem, grasp.grasp_matrix, grasp.hand_jacobian)
    expected = -quasi_static_maps(springs).wrench.contact_forces
    np.testing.assert_allclose(response, expected, atol=1e-6 * np.abs(expected).max())


def test_held_motors_stiffen_and_constant_tensions_do_not(hand, rng):
    description = hand.description.model_copy(
        update={"tendons": hand.description.tendons.model_copy(update={"hold": "tension"})}
    )
    loose = replace(hand, description=description)
    assert loose.tendons.held is False and hand.tendons.held is True
    evaluator, x = random_point(make_problem(hand), rng)
    grasp = grasp_at(evaluator, x)
    soft = replace(grasp, problem=make_problem(loose))
    assert grasp.stability.without_preload > 1.2 * soft.stability.without_preload
    np.testing.assert_array_equal(passive_compliance(soft.problem), hand.joint_compliance)


@pytest.mark.parametrize("law", ["springs", "controllable"])
@pytest.mark.parametrize("n_synergies", [2, 4])
def test_derivatives(hand, n_synergies, law, rng):
    check_all(make_problem(hand, n_synergies, law), rng)


def test_derivatives_of_load_cases_with_held_motors(hand, rng):
    check_load_derivatives(make_problem(hand, loads=LOADS["everything"]), rng)


def test_batched_rows(hand, rng):
    compare_rows(make_problem(hand, 3, loads=gp.LoadCases(hand_limits=False)), rng)


def test_tensions_balance_springs_and_contacts(hand, rng):
    """Where a posture obeys the springs, K_q (q − q₀) + Jᵀ f = Rᵀ t with the tensions of the search."""
    problem = make_problem(hand)
    evaluator, x = random_point(problem, rng)
    state, tendons = evaluator.evaluate(x), driving_tendons(problem)
    wanted = np.array([5.0, 30.0, 12.0, 1.0])
    bent = problem.joint_compliance * (tendons.arms.T @ wanted)
    posture = tendons.rest + bent - problem.joint_compliance * state.torques
    moved = replace(state, reference=posture + problem.joint_compliance * state.torques)
    low = Tension().residual(problem, moved)[:4]
    np.testing.assert_allclose(low, wanted - tendons.least, atol=1e-9)
    np.testing.assert_allclose(
        (posture - tendons.rest) / problem.joint_compliance + state.torques, tendons.arms.T @ wanted, atol=1e-9
    )


def test_a_tension_beyond_its_limits_is_a_violation(hand, rng):
    problem = make_problem(hand)
    tendons, scales = hand.tendons, hand.tendons.scales(problem.joint_compliance)
    evaluator, x = random_point(problem, rng)
    grasp = replace(grasp_at(evaluator, x), contact_forces=np.zeros((3, 3)))

    def at(tension):
        return replace(grasp, joint_angles=problem.synergies.joint_angles(np.array(tension) * scales))

    term = Tension()
    assert term.violation(at([1.0, 0.0, 199.0, -14.0])) == pytest.approx(0.0, abs=1e-9)
    assert term.violation(at([-2.0, 1.0, 1.0, 0.0])) == pytest.approx(2.0)
    assert term.violation(at([1.0, 205.0, 1.0, 0.0])) == pytest.approx(5.0)
    assert term.violation(at([1.0, 1.0, 1.0, -16.0])) == pytest.approx(1.0)
    assert any(isinstance(each, Tension) for each in judged_requirements(problem))
    state = evaluator.evaluate(x)
    numeric = central_differences(
        lambda y: term.residual(problem, evaluator.evaluate(y)), x, steps_of(evaluator.layout)
    )
    assert relative_error(term.jacobian(problem, state), numeric) < 1e-6
    assert len(term.residual(problem, state)) == 8 and tendons.names == ("thumb", "left", "right", "turn")


def test_other_synergies_know_no_tensions(hand):
    assert driving_tendons(make_problem(hand, synergy_set="motors")) is None
    space = hand.synergies("tendons")
    assert driving_tendons(make_problem(hand, synergy_space=space)) is None
    assert driving_tendons(make_problem(hand, 2)).names == ("thumb", "left")
    assert driving_tendons(make_problem(gp.load_hand("dlr_hit_ii_right"))) is None


def test_a_hand_opens_by_slack_tendons_not_by_pushing_them(hand):
    grasp = gp.plan_grasp(make_problem(hand), options=gp.PlannerOptions(starts=25, enough=1))
    assert grasp.feasible and grasp.violations["tension"].value < 1e-6
    path = reference_path(grasp)
    assert (path.open[:3] >= 0.0).all()


def described(tmp_path, old, new):
    source = gp.hand_library()["tendon_hand"]
    text = source.read_text(encoding="utf-8").replace('"tendon_hand.urdf"', f'"{source.parent}/tendon_hand.urdf"')
    assert old in text
    path = tmp_path / "hand.toml"
    path.write_text(text.replace(old, new))
    return path


BAD = {
    "a limit below zero": ("limit = 15.0", "limit = -15.0", ["tendons.motors.turn.limit", "greater than 0", "-15"]),
    "a joint that does not exist": ("left_turn = 1.0", "no_such = 1.0", ["joint", "no_such", "left_turn"]),
    "no joint": ("{ left_turn = 1.0 }", "{}", ["tendons.motors.turn.arms", "at least 1"]),
    "an arm of zero": ("left_turn = 1.0", "left_turn = 0.0", ["tendons of hand", "linearly independent"]),
    "an endless arm": ("left_turn = 1.0", "left_turn = inf", ["tendons.motors.turn.arms.left_turn", "finite"]),
    "no posture within": (
        "thumb_proximal = -0.25\n",
        "thumb_proximal = -4.0\n",
        ["rest of tendons of hand", "-4.0", "a posture within joint limits"],
    ),
    "an unknown way to hold": ("[tendons.motors]", '[tendons]\nhold = "x"\n\n[tendons.motors]', ["tendons.hold"]),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_tendon_is_one_line(case, tmp_path):
    old, new, parts = BAD[case]
    with pytest.raises(gp.GraspPlannerError) as caught:
        gp.load_hand(described(tmp_path, old, new))
    assert "\n" not in str(caught.value)
    for part in parts:
        assert part in str(caught.value)


def test_a_set_with_fewer_columns_is_one_line(hand):
    with pytest.raises(gp.InvalidValueError, match="n_synergies: got 5, allowed: a whole number from 1 to 4"):
        make_problem(hand, 5)


def test_rigid_joints_can_not_be_pulled(hand):
    with pytest.raises(gp.InvalidValueError, match=r"joint_compliance: .*> 0 for some joint of every tendon"):
        make_problem(hand, parameters={"joint_compliance": 0.0})
