"""Contacts, the grasp matrix and the hand Jacobian, by their definitions."""

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from tests.finite_differences import central_differences


def test_grasp_matrix_sums_forces_and_moments(rng):
    points, forces = rng.normal(size=(2, 5, 3))
    wrench = gp.model.grasp_matrix(points) @ forces.ravel()
    np.testing.assert_allclose(wrench[:3], forces.sum(axis=0), atol=1e-14)
    np.testing.assert_allclose(wrench[3:], np.cross(points, forces).sum(axis=0), atol=1e-14)


def test_its_transpose_gives_contact_velocities_of_the_object(rng):
    points = rng.normal(size=(4, 3))
    velocity, spin = rng.normal(size=(2, 3))
    contact = gp.model.grasp_matrix(points).T @ np.concatenate([velocity, spin])
    np.testing.assert_allclose(contact.reshape(-1, 3), velocity + np.cross(spin, points), atol=1e-14)


def test_spherical_fingertips_touch_at_their_surface():
    ball = gp.Sphere(radius=0.03)
    contacts = gp.model.find_contacts(np.array([[0.05, 0.0, 0.0]]), np.array([0.01]), ball)
    np.testing.assert_allclose(contacts.gaps, [0.01])
    np.testing.assert_allclose(contacts.normals, [[-1.0, 0.0, 0.0]])
    np.testing.assert_allclose(contacts.points, [[0.04, 0.0, 0.0]])


@pytest.mark.parametrize("contact_set", ["point", "sphere"])
def test_hand_jacobian_is_the_velocity_of_the_touching_point_of_the_link(hand, contact_set, rng):
    """A point fixed to the fingertip link moves with J when the joints do."""
    frames = hand.contact_frames(contact_set)
    q = hand.lower + (hand.upper - hand.lower) * rng.random(hand.n_joints)
    pose = pin.SE3.Random()
    centres = gp.model.fingertip_positions(hand, frames, q, pose)
    radii = np.array([frame.radius for frame in frames])
    points = gp.model.find_contacts(centres, radii, gp.Sphere()).points
    analytic = gp.model.hand_jacobian(hand, frames, q, pose, points)

    data = hand.model.createData()
    pin.framesForwardKinematics(hand.model, data, hand.full_configuration(q))
    to_root = (pose * hand.palm_in_root.inverse()).inverse()
    local = [data.oMf[f.frame_id].actInv(to_root.act(p)) for f, p in zip(frames, points, strict=True)]

    def touching(angles):
        pin.framesForwardKinematics(hand.model, data, hand.full_configuration(angles))
        return np.concatenate(
            [to_root.inverse().act(data.oMf[f.frame_id].act(p)) for f, p in zip(frames, local, strict=True)]
        )

    np.testing.assert_allclose(analytic, central_differences(touching, q, 1e-3), atol=1e-10)


def test_synergy_jacobian_asks_for_a_row_per_joint():
    with pytest.raises(gp.InvalidValueError, match="one row per joint"):
        gp.model.synergy_jacobian(np.zeros((15, 15)), np.zeros((14, 3)))
