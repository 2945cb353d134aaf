"""Motors that hold lengths: the hand answers a push as load cases say, and a tendon never pushes."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.problem.tendon_drive import driving_tendons, passive_compliance
from grasp_planner.simulate import World, find_protocol

TOML = Path(gp.hand_library()["tendon_hand"])


def tendon_hand(hold, folder):
    """The project's tendon hand, its motors holding lengths or tensions."""
    text = TOML.read_text().replace("[tendons.motors]", f'[tendons]\nhold = "{hold}"\n\n[tendons.motors]')
    path = folder / "hand.toml"
    path.write_text(text.replace('urdf = "', f'urdf = "{TOML.parent}/'))
    return gp.load_hand(path)


def at_rest(hand):
    """The free hand at rest under tension, its lengths held if its motors do, the object a metre away."""
    problem = gp.GraspProblem(hand, gp.Sphere(0.03), n_synergies=4)
    sigma = np.full(4, 0.3)
    q = problem.synergies.joint_angles(sigma)
    world = World(
        gp.Grasp(problem, q, pin.SE3(np.eye(3), np.array([1.0, 0.0, 0.0])), np.zeros(4)), find_protocol("plan")
    )
    world.reset(q, sigma)
    world.hold_object(True)
    world.hold_lengths()
    return world


def turned(world, torques):
    """How far torques on the independent joints turn them [rad]."""
    began = world.independent_angles
    for name, torque in zip(world.grasp.problem.hand.joint_names, torques, strict=True):
        world.data.qfrc_applied[world.model.joint(name).dofadr[0]] = torque
    for _ in range(10):
        world.run(0.1)
    return world.independent_angles - began


@pytest.mark.parametrize("hold", ["length", "tension"])
def test_a_push_turns_joints_by_the_compliance_of_the_load_cases(hold, tmp_path, rng):
    """By C_q − C_q Rᵀ (R C_q Rᵀ)⁻¹ R C_q where lengths are held, by C_q where tensions are."""
    world = at_rest(tendon_hand(hold, tmp_path))
    problem = world.grasp.problem
    torques = 0.01 * rng.uniform(-1.0, 1.0, size=problem.hand.n_joints)
    found, compliance = turned(world, torques), passive_compliance(problem)
    expected = compliance @ torques if hold == "length" else compliance * torques
    np.testing.assert_allclose(found, expected, atol=2e-5)
    assert (np.abs(driving_tendons(problem).arms @ found) < 1e-6).all() == (hold == "length")


def test_a_tendon_that_would_push_goes_slack_and_a_two_way_motor_holds(tmp_path):
    """Bent by more than its tendon pulls, a finger moves on against its springs alone."""
    world = at_rest(tendon_hand("length", tmp_path))
    problem, tendons = world.grasp.problem, driving_tendons(world.grasp.problem)
    pulled = tendons.arms.T @ (world.data.ctrl / tendons.scales(problem.joint_compliance))
    began = world.save()
    found = turned(world, 1.2 * pulled)
    one_way = tendons.least == 0.0
    np.testing.assert_array_equal(world.data.ctrl, np.where(one_way, 0.0, 0.3))
    free = tendons.arms[one_way].any(axis=0)
    np.testing.assert_allclose(found, np.where(free, 0.2 * problem.joint_compliance * pulled, 0.0), atol=1e-4)
    world.restore(began)  # an instant knows what is held
    assert (world.data.ctrl == 0.3).all()
    assert np.abs(turned(world, 0.1 * pulled)[free]).max() < 0.2 * np.abs(found).max()
