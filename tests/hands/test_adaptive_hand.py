"""A hand of nineteen joints and one motor: what it is, what it plans, and that it closes."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.problem.tendon_drive import driving_tendons, passive_compliance
from grasp_planner.spatial import Pose

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def hand():
    return gp.load_hand("adaptive_hand")


def test_nineteen_joints_one_tendon(hand):
    tendons = hand.tendons
    assert (hand.n_joints, hand.model.nv, tendons.names) == (19, 33, ("tendon",))
    arms = dict(zip(hand.joint_names, tendons.arms[0], strict=True))
    assert arms["thumb_abd"] == pytest.approx(0.013) and arms["index_abd"] == pytest.approx(-0.002)
    assert {arms[name] for name in hand.joint_names if not name.endswith("abd")} == {0.01}


def test_two_hinges_of_a_joint_turn_alike(hand):
    q = hand.posture({"index_inner": 0.3})
    turned = dict(zip(list(hand.model.names)[1:], hand.full_configuration(q), strict=True))
    assert turned["index_inner"] == turned["index_inner_follows"] == 0.3
    assert sum(abs(angle) for angle in turned.values()) == pytest.approx(0.6)


def test_the_tendon_closes_the_hand_from_its_stops(hand):
    """Slack it is open, straight but for the thumb; with 20 N thumb and index meet in front of the palm."""
    problem = gp.GraspProblem(hand, gp.Cylinder(radius=0.025))
    assert problem.n_synergies == 1 and driving_tendons(problem) == hand.tendons
    scale = hand.tendons.scales(hand.joint_compliance)

    def tips(tension):
        q = np.clip(problem.synergies.joint_angles(tension * scale), hand.lower, hand.upper)
        return gp.model.fingertip_positions(hand, problem.frames, q, Pose(np.eye(3), np.zeros(3)))

    apart = [np.linalg.norm(at[0] - at[1]) for at in (tips(0.0), tips(10.0), tips(20.0))]
    assert apart[0] > apart[1] > apart[2] and apart[0] > 0.1 and apart[2] < 0.02
    assert (tips(20.0)[:, 0] > 0.04).all()


def test_a_held_motor_stiffens_one_direction_of_nineteen(hand):
    problem = gp.GraspProblem(hand, gp.Cylinder(radius=0.025))
    values = np.linalg.eigvalsh(passive_compliance(problem))
    assert values[0] == pytest.approx(0.0, abs=1e-9) and values[1] > 1.0


def test_committed_files_are_what_the_script_writes():
    run = [sys.executable, str(ROOT / "scripts" / "make_adaptive_hand.py"), "--check"]
    assert subprocess.run(run, check=False, env={"PYTHONPATH": str(ROOT)}).returncode == 0


@pytest.mark.slow
def test_it_plans_with_defaults_and_holds(hand):
    """One synergy, clear links, load cases: feasible, by a tension within limits; pushed in simulation."""
    problem = gp.GraspProblem(hand, gp.Cylinder(radius=0.025, mass=0.1))
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(enough=1))
    assert grasp.feasible, grasp.verdict
    tension = float(grasp.sigma[0] / hand.tendons.scales(problem.joint_compliance)[0])
    assert 0.0 < tension < 200.0
    # The tendon and the contacts hold the springs in balance.
    pulled = hand.tendons.arms[0] * tension - grasp.joint_torques
    np.testing.assert_allclose(grasp.joint_angles, problem.joint_compliance * pulled, atol=1e-6)
    pytest.importorskip("mujoco")
    from grasp_planner.simulate import find_protocol, simulate_grasp

    found = simulate_grasp(grasp, find_protocol("plan"), ladder=False)
    assert found.rest.held
    np.testing.assert_allclose(found.rest.normal_forces, grasp.normal_forces, rtol=0.01)
