"""The ellipsoids of stiffness, motion and force of a compliant grasp."""

import numpy as np
import pytest

from grasp_planner.analysis import contact_set
from grasp_planner.drawing.ellipsoid_axes import _surface
from grasp_planner.exceptions import InvalidValueError
from grasp_planner.model import (
    compliant_grasp,
    force_ellipsoid,
    force_manipulability,
    grasp_matrix,
    grasp_stiffness,
    kinematic_ellipsoid,
    kinematic_manipulability,
    moved_stiffness,
    quasi_static_maps,
    stiffness_ellipsoid,
)

POINTS = np.array([[0.03, 0, 0], [-0.015, 0.026, 0], [-0.015, -0.026, 0.005]])
POINTS -= POINTS.mean(axis=0)
UNIT = np.random.default_rng(5).normal(size=(20, 3))
UNIT /= np.linalg.norm(UNIT, axis=1)[:, None]


def free_hand(basis):
    """Three points, each moved along x, y, z by joints of its own."""
    return compliant_grasp(grasp_matrix(POINTS), np.eye(9), basis, contact_stiffness=1000.0, joint_stiffness=500.0)


def test_the_stiffness_ellipsoid_is_that_of_a_shift_at_the_centre_of_compliance(planned):
    springs = contact_set(planned).springs
    centre, ellipsoid = stiffness_ellipsoid(springs)
    shifts = np.linalg.inv(moved_stiffness(grasp_stiffness(springs), centre))[:3, :3]
    again = ellipsoid.axes @ np.diag(1.0 / ellipsoid.lengths) @ ellipsoid.axes.T
    np.testing.assert_allclose(again, shifts, atol=1e-9 * np.abs(shifts).max())
    assert (np.diff(ellipsoid.lengths) <= 0.0).all(), "longest first"


def test_springs_that_do_not_hold_have_no_stiffness_ellipsoid():
    line = np.array([[0.03, 0, 0], [-0.03, 0, 0]])
    springs = compliant_grasp(grasp_matrix(line), np.eye(6), np.eye(6), contact_stiffness=1000.0, joint_stiffness=None)
    assert stiffness_ellipsoid(springs) is None
    with pytest.raises(InvalidValueError):
        force_ellipsoid(springs)


def test_motors_of_length_one_move_the_object_within_the_kinematic_ellipsoid():
    springs = free_hand(np.eye(9))
    ellipsoid, rigid = kinematic_ellipsoid(springs)
    assert rigid
    # All three points shifted alike: √3 of motor motion per unit; with a turn, which costs motion too, no farther.
    assert ellipsoid.lengths[0] == pytest.approx(1.0 / np.sqrt(3.0))
    found = kinematic_manipulability(springs)
    reached = (found.object_side * np.sqrt(found.ratios))[:3]
    for direction in UNIT:
        told = np.linalg.norm(ellipsoid.lengths * (ellipsoid.axes.T @ direction))
        assert np.linalg.norm(reached.T @ direction) == pytest.approx(told)


def test_where_every_motion_bends_springs_the_kinematic_ellipsoid_is_their_share():
    springs = free_hand(np.eye(9)[:, :1])
    ellipsoid, rigid = kinematic_ellipsoid(springs)
    assert not rigid
    moved = quasi_static_maps(springs).commands.object_motion[:3, 0]
    assert ellipsoid.lengths[0] == pytest.approx(np.linalg.norm(moved))
    np.testing.assert_allclose(ellipsoid.lengths[1:], 0.0, atol=1e-12)
    vertices, _ = _surface(ellipsoid)
    assert np.linalg.norm(vertices, axis=1).max() == pytest.approx(ellipsoid.lengths[0], rel=1e-2)


@pytest.mark.parametrize("motors", [9, 2])
def test_forces_on_the_force_ellipsoid_are_felt_as_motor_forces_of_length_one(motors):
    springs = free_hand(np.linalg.qr(np.random.default_rng(3).normal(size=(9, 9)))[0][:, :motors])
    ellipsoid = force_ellipsoid(springs)
    finite = np.isfinite(ellipsoid.lengths)
    assert finite.sum() == min(motors, 3)
    felt = quasi_static_maps(springs).wrench.motor_forces[:, :3] @ ellipsoid.axes
    np.testing.assert_allclose(np.linalg.norm(felt[:, finite] * ellipsoid.lengths[finite], axis=0), 1.0)
    np.testing.assert_allclose(felt[:, ~finite], 0.0, atol=1e-9)
    if finite.all():  # a section: nowhere longer than the ellipsoid of wrenches
        assert ellipsoid.lengths[finite].max() ** 2 <= force_manipulability(springs).ratios[-1] * (1 + 1e-9)
    vertices, faces = _surface(ellipsoid)
    assert len(faces)
    inside = vertices @ ellipsoid.axes / np.where(finite, ellipsoid.lengths, np.inf)
    np.testing.assert_allclose(np.linalg.norm(inside, axis=1), 1.0, atol=1e-9)
