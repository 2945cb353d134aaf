"""Soft synergies: identities of the force distribution, hand-checked cases, and the actual posture."""

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp


@pytest.fixture
def model(rng):
    """Five random contacts of a hand of 15 joints and 4 synergies."""
    points = rng.normal(0.0, 0.03, (5, 3))
    jacobian = rng.normal(0.0, 0.05, (15, 15))
    basis = np.linalg.qr(rng.normal(size=(15, 4)))[0]
    grasp = gp.model.grasp_matrix(points)
    return points, grasp, jacobian, basis, gp.model.hand_stiffness(jacobian, 0.1, 0.1)


def test_stiffness_is_symmetric_positive_definite(model):
    stiffness = model[-1]
    np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-12)
    assert np.linalg.eigvalsh(stiffness).min() > 0.0


def test_stiffness_without_joint_compliance_is_that_of_the_structure(model):
    np.testing.assert_allclose(gp.model.hand_stiffness(model[2], 0.1, 0.0), 10.0 * np.eye(15), atol=1e-12)


def test_weighted_inverse_is_a_right_inverse(model):
    _, grasp, _, _, stiffness = model
    np.testing.assert_allclose(grasp @ gp.model.weighted_right_inverse(grasp, stiffness), np.eye(6), atol=1e-12)


def test_internal_forces_make_no_wrench(model):
    _, grasp, jacobian, basis, stiffness = model
    internal = gp.model.internal_forces(grasp, jacobian, basis, stiffness, 1e5)
    assert np.abs(grasp @ internal).max() < 1e-9 * np.abs(internal).max()
    assert np.linalg.matrix_rank(internal, tol=1e-6 * np.abs(internal).max()) == 4


def test_contact_forces_balance_the_external_wrench(model, rng):
    _, grasp, jacobian, basis, stiffness = model
    wrench = rng.normal(size=6)
    forces = gp.model.contact_forces(grasp, jacobian, basis, rng.normal(0, 1e-4, 4), wrench, stiffness, 1e5)
    np.testing.assert_allclose(grasp @ forces, -wrench, atol=1e-10)


def test_forces_scale_with_weight_and_displacement(model, rng):
    _, grasp, jacobian, basis, stiffness = model
    wrench, delta = rng.normal(size=6), rng.normal(0, 1e-4, 4)
    once = gp.model.contact_forces(grasp, jacobian, basis, delta, wrench, stiffness, 1e5)
    thrice = gp.model.contact_forces(grasp, jacobian, basis, 3 * delta, 3 * wrench, stiffness, 1e5)
    np.testing.assert_allclose(thrice, 3 * once, rtol=1e-9, atol=1e-9)


def test_forces_do_not_depend_on_the_order_of_contacts(model, rng):
    points, grasp, jacobian, basis, stiffness = model
    wrench, delta = rng.normal(size=6), rng.normal(0, 1e-4, 4)
    order = rng.permutation(5)
    rows = (3 * order[:, None] + np.arange(3)).ravel()
    shuffled = gp.model.contact_forces(
        gp.model.grasp_matrix(points[order]),
        jacobian[rows],
        basis,
        delta,
        wrench,
        gp.model.hand_stiffness(jacobian[rows], 0.1, 0.1),
        1e5,
    )
    once = gp.model.contact_forces(grasp, jacobian, basis, delta, wrench, stiffness, 1e5)
    np.testing.assert_allclose(shuffled, once[rows], atol=1e-9)


def test_a_common_rigid_motion_changes_nothing(model, rng):
    """Moving contacts, Jacobian and wrench together rotates the forces and leaves their sizes."""
    points, grasp, jacobian, basis, stiffness = model
    wrench, delta = rng.normal(size=6), rng.normal(0, 1e-4, 4)
    motion = pin.SE3.Random()
    rotation = np.array(motion.rotation)
    moved_points = np.array([motion.act(point) for point in points])
    turned = (rotation @ jacobian.reshape(5, 3, 15)).reshape(15, 15)
    moved_wrench = motion.act(pin.Force(wrench)).vector
    moved = gp.model.contact_forces(
        gp.model.grasp_matrix(moved_points),
        turned,
        basis,
        delta,
        moved_wrench,
        gp.model.hand_stiffness(turned, 0.1, 0.1),
        1e5,
    )
    once = gp.model.contact_forces(grasp, jacobian, basis, delta, wrench, stiffness, 1e5)
    np.testing.assert_allclose(moved.reshape(5, 3), once.reshape(5, 3) @ rotation.T, atol=1e-8)


def test_antipodal_fingers_share_a_weight_equally_by_stiffness():
    """Three equal springs at the corners of a triangle under a weight through its centre carry a third each."""
    angles = 2 * np.pi * np.arange(3) / 3
    points = 0.03 * np.stack([np.cos(angles), np.sin(angles), np.zeros(3)], axis=1)
    grasp = gp.model.grasp_matrix(points)
    forces = gp.model.weighted_right_inverse(grasp, 10.0 * np.eye(9)) @ np.array([0, 0, 1.962, 0, 0, 0])
    np.testing.assert_allclose(forces.reshape(3, 3), np.tile([0, 0, 0.654], (3, 1)), atol=1e-12)


def test_an_antipodal_pair_squeezes_along_the_line_between_its_contacts():
    """Two fingers on a sphere, each one joint that presses inwards: the internal force is equal and opposite."""
    points = np.array([[0.03, 0, 0], [-0.03, 0, 0], [0, 0.03, 0], [0, -0.03, 0]])
    jacobian = np.zeros((12, 2))
    jacobian[0, 0], jacobian[3, 1] = -0.05, 0.05
    grasp = gp.model.grasp_matrix(points)
    stiffness = gp.model.hand_stiffness(jacobian, 0.1, 0.0)
    internal = gp.model.internal_forces(grasp, jacobian, np.ones((2, 1)) / np.sqrt(2), stiffness, 0.0)[:, 0]
    expected = np.zeros((4, 3))
    expected[0, 0], expected[1, 0] = -0.05 * 10 / np.sqrt(2), 0.05 * 10 / np.sqrt(2)
    np.testing.assert_allclose(internal.reshape(4, 3), expected, atol=1e-12)


def test_contacts_on_one_line_are_refused():
    points = np.outer([-1.0, 0.0, 1.0], [0.03, 0.0, 0.0])
    with pytest.raises(gp.InvalidValueError, match="rank 6"):
        gp.model.weighted_right_inverse(gp.model.grasp_matrix(points), np.eye(9))


def test_actual_posture_solves_its_equation(rng):
    """Q = q_r − C_q τ(q) with torques that depend on the posture."""
    reference = rng.normal(size=4)
    q = gp.model.actual_posture(reference, 0.1, lambda q: np.sin(q))
    np.testing.assert_allclose(q, reference - 0.1 * np.sin(q), atol=1e-11)


def test_a_buckling_hand_is_refused():
    with pytest.raises(gp.InvalidValueError, match="joint_compliance"):
        gp.model.actual_posture(np.ones(2), 0.1, lambda q: 1e3 * np.sinh(np.clip(q, -5, 5)) + 1e3, max_iterations=5)
