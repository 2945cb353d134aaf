"""Contact kinematics against Pinocchio's own Jacobians and Hessians, and against finite differences."""

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.hand.kinematics import HandKinematics
from tests.finite_differences import central_differences


def random_posture(hand, rng):
    return hand.lower + (hand.upper - hand.lower) * rng.random(hand.n_joints)


@pytest.mark.parametrize("contact_set", ["point", "sphere"])
def test_positions_and_jacobians_are_pinocchios(hand, contact_set, rng):
    frames = hand.contact_frames(contact_set)
    kinematics = HandKinematics(hand, frames)
    for _ in range(10):
        q = random_posture(hand, rng)
        result = kinematics.compute(q)
        np.testing.assert_allclose(
            result.position, gp.model.fingertip_positions(hand, frames, q, pin.SE3.Identity()), atol=1e-14
        )
        data = hand.model.createData()
        pin.computeJointJacobians(hand.model, data, hand.full_configuration(q))
        pin.updateFramePlacements(hand.model, data)
        for i, frame in enumerate(frames):
            expected = pin.getFrameJacobian(hand.model, data, frame.frame_id, pin.LOCAL_WORLD_ALIGNED)
            np.testing.assert_allclose(result.linear[i], expected[:3] @ hand.coupling, atol=1e-14)
            np.testing.assert_allclose(result.angular[i], expected[3:] @ hand.coupling, atol=1e-14)


@pytest.mark.parametrize("contact_set", ["point", "sphere"])
def test_jacobian_derivatives_are_central_differences(hand, contact_set, rng):
    kinematics = HandKinematics(hand, hand.contact_frames(contact_set))
    q = random_posture(hand, rng)
    result = kinematics.compute(q, derivatives=True)
    for name in ("linear", "angular"):
        numeric = central_differences(lambda q, name=name: getattr(kinematics.compute(q), name), q, 1e-3)
        analytic = np.moveaxis(getattr(result, f"{name}_derivative"), 0, -1)
        np.testing.assert_allclose(analytic, numeric, atol=1e-10)


def test_second_derivatives_are_pinocchios_kinematic_hessians(right, rng):
    """Moved from the joint's origin, where Pinocchio gives them, to the contact frame."""
    frames = right.contact_frames("point")
    q = random_posture(right, rng)
    model, data = right.model, right.model.createData()
    pin.computeJointJacobians(model, data, right.full_configuration(q))
    pin.computeJointKinematicHessians(model, data, right.full_configuration(q))
    result = HandKinematics(right, frames).compute(q, derivatives=True)
    for i, frame in enumerate(frames):
        raw = pin.getJointKinematicHessian(model, data, frame.joint_id, pin.LOCAL_WORLD_ALIGNED)
        # The binding of Pinocchio 4.1 labels a column-major tensor as row-major; this undoes it: [row, j, k].
        hessian = np.array(raw).ravel().reshape((6, model.nv, model.nv), order="F")
        arm = result.position[i] - data.oMi[frame.joint_id].translation
        omega = pin.getJointJacobian(model, data, frame.joint_id, pin.LOCAL_WORLD_ALIGNED)[3:].T
        # p = o + arm, hence ∂(v_j)/∂q_k = ∂(v_o,j)/∂q_k + ∂ω_j/∂q_k × arm + ω_j × (ω_k × arm).
        second = hessian[:3].transpose(1, 2, 0) + np.cross(hessian[3:].transpose(1, 2, 0), arm)
        second += np.cross(omega[:, None, :], np.cross(omega, arm)[None, :, :])
        expected = np.einsum("jkx,ka,jb->axb", second, right.coupling, right.coupling)
        np.testing.assert_allclose(result.linear_derivative[:, i], expected, atol=1e-12)


def test_the_linear_hessian_is_symmetric(hand, rng):
    result = HandKinematics(hand, hand.contact_frames()).compute(random_posture(hand, rng), derivatives=True)
    hessian = result.linear_derivative
    np.testing.assert_allclose(hessian, hessian.transpose(3, 1, 2, 0), atol=1e-15)


def test_a_finger_does_not_move_the_contacts_of_the_others(right, rng):
    result = HandKinematics(right, right.contact_frames()).compute(random_posture(right, rng))
    for i, frame in enumerate(right.contact_frames()):
        for k, joint in enumerate(right.joint_names):
            moves = np.abs(result.linear[i][:, k]).max() > 0.0
            assert moves == joint.startswith(frame.name)
