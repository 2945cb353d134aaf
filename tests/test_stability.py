"""The stiffness of a grasp against differences of the equilibrium itself, solved anew for a moved object."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import fsolve

import grasp_planner as gp
from grasp_planner.analysis import contact_set
from grasp_planner.hand.configuration import HandConfiguration
from grasp_planner.model import Preload, quasi_static_maps
from grasp_planner.model.compliance import bent, series_stiffness
from grasp_planner.spatial import rotation_between
from tests.finite_differences import central_differences
from tests.stored import TOTAL, stored

LINK_KINDS = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)


def tip_rotations(problem, q, palm):
    """Return the rotations of the contact frames in O."""
    hand, data = problem.hand, problem.hand.model.createData()
    pin.framesForwardKinematics(hand.model, data, hand.full_configuration(q))
    root = palm * hand.palm_in_root.inverse()
    return [np.array((root * data.oMf[frame.frame_id]).rotation) for frame in problem.frames]


def equilibrium(grasp, twist):
    """Return the wrench of the hand on the object, in space about its centre, after a motion of the object.

    Point tips: springs between points fixed on finger and object. Round tips roll: the point of contact and the
    normal follow the relative rotation on the object's real surface.
    """
    problem, forces, moments = grasp.problem, grasp.forces, grasp.moments
    soft = getattr(problem.contact_model, "patch_radius", 0.0) ** 2 * problem.parameters.contact_stiffness
    moved = pin.SE3(pin.exp3(twist[3:]), np.array(twist[:3]))
    palm = moved.inverse() * grasp.palm_pose
    radii, points, normals = problem.radii, grasp.contacts.points, grasp.contacts.normals
    centres = points - radii[:, None] * normals
    before = tip_rotations(problem, grasp.joint_angles, grasp.palm_pose)
    stiffness = problem.parameters.contact_stiffness
    reference = grasp.joint_angles + bent(problem.joint_compliance, grasp.joint_torques)

    def contact(q):
        tips = gp.model.fingertip_positions(problem.hand, problem.frames, q, palm)
        turns = [after @ first.T for after, first in zip(tip_rotations(problem, q, palm), before, strict=True)]
        touching = np.array([p + r @ a for p, r, a in zip(tips, turns, points - centres, strict=True)])
        rolled = np.array([p + (r - np.eye(3)) @ (p - c) for p, r, c in zip(centres, turns, points, strict=True)])
        found = gp.model.find_contacts(rolled, radii, problem.grasp_object)
        force = np.array([rotation_between(n, m) @ f for n, m, f in zip(normals, found.normals, forces, strict=True)])
        if not radii.any():
            force = forces
        spins = [n @ pin.log3(turn) for n, turn in zip(normals, turns, strict=True)]
        moment = moments + soft * normals * np.array(spins)[:, None]
        if radii.any():
            turning = zip(normals, found.normals, moment, strict=True)
            moment = np.array([rotation_between(n, m) @ twisted for n, m, twisted in turning])
        slip = np.where(radii[:, None] > 0.0, found.points - points, 0.0)
        return force + stiffness * (touching - points), touching + slip, moment

    def imbalance(q):
        force, where, moment = contact(q)
        twists = HandConfiguration(problem.hand, q, palm).contact_twists(problem.frames, where)
        torques = np.einsum("ijk,ij->k", twists, np.hstack([force, moment]))
        return q - reference + bent(problem.joint_compliance, torques)

    q = fsolve(imbalance, grasp.joint_angles, full_output=True, xtol=1e-14)[0]
    assert np.abs(imbalance(q)).max() < 1e-10
    force, where, moment = contact(q)
    rotation = np.array(moved.rotation)
    return np.concatenate([rotation @ force.sum(axis=0), rotation @ (np.cross(where, force) + moment).sum(axis=0)])


CASES = {
    "point_cylinder": ("point", gp.Cylinder()),
    "point_sphere": ("point", gp.Sphere(radius=0.035)),
    "round_sphere": ("sphere", gp.Sphere(radius=0.035)),
    "round_cylinder": ("sphere", gp.Cylinder()),
}
"""Contact set and object of the stored grasps, each planned for a push with eight synergies."""


@pytest.mark.parametrize("case", CASES)
def test_stiffness_is_the_derivative_of_the_equilibrium(right, case):
    contact_set, grasp_object = CASES[case]
    grasp = stored(case)
    fields = {"n_synergies": 8, "parameters": TOTAL, "contact_set": contact_set, "loads": gp.LoadCases()}
    assert grasp.feasible and grasp.problem == gp.GraspProblem.paper(right, grasp_object, **fields)
    numeric = -central_differences(lambda nu: equilibrium(grasp, nu), np.zeros(6), np.repeat([2e-6, 1e-4], 3))
    found = grasp.stability.stiffness
    scale = np.repeat([1.0, 1.0 / grasp.stability.length], 3)
    size = np.abs(scale[:, None] * numeric * scale).max()
    assert np.abs(scale[:, None] * (found - numeric) * scale).max() < 1e-5 * size
    passive = series_stiffness(grasp.hand_jacobian, 0.1, 1e5)
    preload = found - grasp.grasp_matrix @ passive @ grasp.grasp_matrix.T
    assert np.abs(scale[:, None] * preload * scale).max() > 5e-4 * size, "the preload matters"
    symmetric = scale[:, None] * (0.5 * (numeric + numeric.T)) * scale
    assert grasp.stability.smallest == pytest.approx(np.linalg.eigvalsh(symmetric)[0], rel=1e-2)


@pytest.mark.parametrize("contact_set", ["point", "sphere"])
def test_soft_fingers_add_their_torsion(right, contact_set, rng):
    """Two soft fingertips, squeezed so that they twist: torsional springs, and moments that turn with the normals."""
    parameters = gp.GraspParameters(contact_model=gp.model.SoftFinger(torsion=0.01))
    shape, tips = gp.Sphere(radius=0.035), ("thumb", "index")
    problem = gp.GraspProblem.paper(right, shape, n_synergies=8, parameters=parameters, contact_set=contact_set)
    problem = replace(problem, contacts=tips)
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(enough=1))
    grasp = gp.Grasp(problem, grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma + rng.normal(0.0, 3e-5, 8))
    assert np.linalg.norm(grasp.moments, axis=1).max() > 1e-4
    numeric = -central_differences(lambda nu: equilibrium(grasp, nu), np.zeros(6), np.repeat([2e-6, 1e-4], 3))
    scale = np.repeat([1.0, 1.0 / grasp.stability.length], 3)
    size = np.abs(scale[:, None] * numeric * scale).max()
    assert np.abs(scale[:, None] * (grasp.stability.stiffness - numeric) * scale).max() < 1e-5 * size


def test_with_point_tips_the_springs_have_a_potential():
    """The wrench with the weight is zero, so that the stiffness is a Hessian: symmetric."""
    stiffness = stored("point_cylinder").stability.stiffness
    np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-6 * np.abs(stiffness).max())


def test_without_preload_it_is_the_passive_stiffness(planned):
    problem = replace(planned.problem, grasp_object=replace(planned.problem.grasp_object, mass=1e-9))
    loose = gp.Grasp(problem, planned.joint_angles, planned.palm_pose, np.zeros(problem.n_synergies))
    assert np.abs(loose.forces).max() < 1e-6
    passive = series_stiffness(loose.hand_jacobian, problem.joint_compliance, 1e5)
    expected = loose.grasp_matrix @ passive @ loose.grasp_matrix.T
    np.testing.assert_allclose(loose.stability.stiffness, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())
    assert loose.stability.smallest == pytest.approx(loose.stability.without_preload, rel=1e-6)


def test_squeezing_soft_fingers_hard_makes_a_grasp_unstable():
    """The preload grows with δσ while the springs stay as they are: there is a squeeze that is too much."""
    grasp = stored("point_cylinder")
    assert grasp.stability.stable
    found = [
        gp.Grasp(grasp.problem, grasp.joint_angles, grasp.palm_pose, factor * grasp.delta_sigma).stability
        for factor in (1.0, 3.0, 10.0, 100.0, 1000.0)
    ]
    assert not found[-1].stable
    assert found[-1].text.startswith("UNSTABLE")


def test_frictionless_contacts_slide(right):
    """Only normal springs: the force follows gap and normal wherever the centre of the tip goes."""
    parameters = gp.GraspParameters(contact_model=gp.model.Frictionless())
    shape, rng = gp.EllipsoidObject(), np.random.default_rng(3)
    problem = gp.GraspProblem.paper(right, shape, n_synergies=8, parameters=parameters, contact_set="power")
    palm = gp.random_start(problem, rng).palm_pose
    q0 = right.lower + (right.upper - right.lower) * rng.uniform(0.3, 0.7, 15)
    grasp = gp.Grasp(problem, q0, palm, rng.normal(0.0, 1e-5, 8))
    reference = q0 + problem.joint_compliance * grasp.joint_torques

    def wrench(twist):
        moved = pin.SE3(pin.exp3(twist[3:]), np.array(twist[:3]))

        def contact(q):
            configuration = HandConfiguration(right, q, moved.inverse() * palm)
            centres = configuration.contact_centres(problem.frames)
            found = gp.model.find_contacts(centres, problem.radii, shape)
            pressed = grasp.normal_forces - problem.parameters.contact_stiffness * (found.gaps - grasp.contacts.gaps)
            jacobian = configuration.contact_jacobian(problem.frames, centres)
            return pressed[:, None] * found.normals, centres, jacobian

        def imbalance(q):
            force, _, jacobian = contact(q)
            return q - reference + problem.joint_compliance * (jacobian.T @ force.ravel())

        force, centres, _ = contact(fsolve(imbalance, q0, full_output=True, xtol=1e-14)[0])
        rotation = np.array(moved.rotation)
        return np.concatenate([rotation @ force.sum(axis=0), rotation @ np.cross(centres, force).sum(axis=0)])

    numeric = -central_differences(wrench, np.zeros(6), np.repeat([2e-6, 1e-4], 3))
    scale = np.repeat([1.0, 1.0 / grasp.stability.length], 3)
    size = np.abs(scale[:, None] * numeric * scale).max()
    assert np.abs(scale[:, None] * (grasp.stability.stiffness - numeric) * scale).max() < 1e-7 * size


def test_the_preload_of_the_joints_is_the_change_of_their_torques():
    grasp = stored("point_sphere")
    problem, forces = grasp.problem, grasp.forces.ravel()

    def torques(q):
        posed = HandConfiguration(problem.hand, q, grasp.palm_pose)
        points = posed.contact_centres(problem.frames)  # points of the links: the tips have no radius
        return posed.contact_jacobian(problem.frames, points).T @ forces

    found = contact_set(grasp, preloaded=True).springs.preload.joints
    numeric = central_differences(torques, grasp.joint_angles, 1e-5)
    np.testing.assert_allclose(found, numeric, atol=1e-7 * np.abs(numeric).max())
    assert contact_set(grasp).springs.preload == Preload()
    with_it, without = (quasi_static_maps(contact_set(grasp, preloaded=on).springs).commands for on in (True, False))
    assert np.abs(with_it.contact_forces - without.contact_forces).max() > 0.0
