"""A hand at a posture: its places against Pinocchio, its Jacobians against differences, one run for all of it."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.hand import configuration
from grasp_planner.hand.configuration import HandConfiguration
from grasp_planner.hand.kinematics import HandKinematics

HANDS = sorted(gp.hand_library())


@pytest.fixture(scope="module", params=HANDS)
def any_hand(request):
    return gp.load_hand(request.param)


def posed(hand, seed=0):
    """Return a random configuration."""
    rng = np.random.default_rng(seed)
    return HandConfiguration(hand, rng.uniform(hand.lower, hand.upper), pin.exp6(rng.normal(0.0, 0.5, 6)))


def test_places_are_pinocchios(any_hand):
    """Joints, frames and geometries stand where forward kinematics puts them, seen from the object, bit for bit."""
    found, model, geometry = posed(any_hand), any_hand.model, any_hand.collision_model
    data, placements = model.createData(), geometry.createData()
    q = any_hand.full_configuration(found.q)
    pin.framesForwardKinematics(model, data, q)
    pin.updateGeometryPlacements(model, data, geometry, placements, q)
    root = found.palm_pose.se3() * any_hand.palm_in_root.se3().inverse()
    np.testing.assert_array_equal(found.root_pose.homogeneous, root.homogeneous)
    for pose, place in zip(found.joint_poses, data.oMi, strict=True):
        np.testing.assert_array_equal(pose.homogeneous, (root * place).homogeneous)
    for pose, place in zip(found.geometry_poses, placements.oMg, strict=True):
        np.testing.assert_array_equal(pose.homogeneous, (root * place).homogeneous)
    for index, place in enumerate(data.oMf):
        np.testing.assert_array_equal(found.frame_pose(index).homogeneous, (root * place).homogeneous)
    for pose, place in zip(found.joint_poses_in_parents, data.liMi, strict=True):
        np.testing.assert_array_equal(pose.homogeneous, place.homogeneous)
    centres = [(root * place).translation for place in list(data.oMi)[1:]]
    np.testing.assert_array_equal(found.joint_centres, centres)


def test_the_palm_is_where_it_was_put(any_hand):
    found = posed(any_hand)
    palm = any_hand.model.getFrameId(any_hand.description.palm.link)
    assert found.frame_pose(palm).near(found.palm_pose, 1e-12)
    assert HandConfiguration(any_hand, found.q).frame_pose(palm).near(pin.SE3.Identity(), 1e-12)


def test_the_jacobian_is_the_derivative_of_points_of_the_links(any_hand):
    """Points fixed to the links, off the contact frames, move by J dq."""
    found, frames, step = posed(any_hand), any_hand.contact_frames(), 1e-6
    rng = np.random.default_rng(1)
    points = found.contact_centres(frames) + rng.normal(0.0, 0.01, (len(frames), 3))
    fixed = [found.frame_pose(f.frame_id).inverse().act(p) for f, p in zip(frames, points, strict=True)]
    differences = np.empty((3 * len(frames), any_hand.n_joints))
    for joint in range(any_hand.n_joints):
        ends = []
        for sign in (1.0, -1.0):
            q = np.array(found.q)
            q[joint] += sign * step
            moved = HandConfiguration(any_hand, q, found.palm_pose)
            ends.append([moved.frame_pose(f.frame_id).act(p) for f, p in zip(frames, fixed, strict=True)])
        differences[:, joint] = ((np.array(ends[0]) - np.array(ends[1])) / (2 * step)).ravel()
    np.testing.assert_allclose(found.contact_jacobian(frames, points), differences, atol=1e-8)


def test_it_agrees_with_the_kinematics_of_the_search(any_hand):
    found, frames = posed(any_hand), any_hand.contact_frames()
    fused = HandKinematics(any_hand, frames).compute(found.q)
    seen = np.array([found.palm_pose.act(point) for point in fused.position])
    centres = found.contact_centres(frames)
    np.testing.assert_allclose(centres, seen, atol=1e-14)
    linear = found.palm_pose.rotation @ fused.linear
    np.testing.assert_allclose(found.contact_jacobian(frames, centres), linear.reshape(3 * len(frames), -1), atol=1e-14)


def test_joint_axes_turn_what_hangs_on_them(any_hand):
    """Turning one joint of the model alone moves the frames behind it about its axis."""
    found, model = posed(any_hand), any_hand.model
    q = any_hand.full_configuration(found.q)
    root = found.root_pose.se3()
    before = model.createData()
    pin.forwardKinematics(model, before, q)
    for joint in range(1, model.njoints):
        turned, after = np.array(q), model.createData()
        turned[model.joints[joint].idx_q] += 0.1
        pin.forwardKinematics(model, after, turned)
        rotation = (root * after.oMi[joint]).rotation @ (root * before.oMi[joint]).rotation.T
        axis = found.joint_axes[model.joints[joint].idx_v]
        np.testing.assert_allclose(pin.log3(rotation), 0.1 * axis, atol=1e-9)


def test_last_links_end_at_the_contacts(any_hand):
    found, frames = posed(any_hand), any_hand.contact_frames()
    starts = np.array([found.joint_poses[frame.joint_id].translation for frame in frames])
    np.testing.assert_allclose(starts + found.last_link_vectors(frames), found.contact_centres(frames), atol=1e-14)


def test_pinocchio_runs_once_and_only_when_asked(any_hand, monkeypatch):
    calls = []

    def counted(*arguments):
        calls.append(arguments)
        return pin.computeJointJacobians(*arguments)

    found, frames = posed(any_hand), any_hand.contact_frames()
    stand_in = type("Counted", (), {"__getattr__": lambda _, name: getattr(pin, name)})()
    stand_in.computeJointJacobians = counted
    monkeypatch.setattr(configuration, "pin", stand_in)
    assert calls == []
    _ = found.joint_poses, found.geometry_poses, found.joint_axes, found.joint_centres, found.frame_pose(1)
    found.contact_jacobian(frames, found.contact_centres(frames))
    assert len(calls) == 1


def test_a_posture_of_another_hand_is_refused(any_hand):
    with pytest.raises(gp.InvalidValueError, match="q: got"):
        HandConfiguration(any_hand, np.zeros(any_hand.n_joints + 1))
