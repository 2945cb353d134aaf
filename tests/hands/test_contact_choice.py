"""Which contacts touch: subsets of fingers, power grasps, and contacts beside their frames."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.collision.link_shapes import inner_axes, link_shapes
from grasp_planner.evaluation.contact_geometry import ContactGeometryEvaluator
from grasp_planner.evaluation.variables import PoseChart
from grasp_planner.records.grasp_record import grasp_record
from grasp_planner.terms.registry import problem_constraints

QUICK = gp.PlannerOptions(starts=16, enough=1)
# These tests are about contacts and forces alone: where links have to keep clear too, that is left out.


@pytest.fixture(scope="module")
def hand():
    return gp.load_hand("dlr_hit_ii_right")


def problem(hand, grasp_object=None, **changes):
    """A problem with all synergies."""
    return gp.GraspProblem.paper(hand=hand, grasp_object=grasp_object or gp.Cylinder(), n_synergies=15, **changes)


@pytest.mark.parametrize("fingers", [("thumb", "index", "middle"), ("thumb", "index", "middle", "ring"), None])
def test_three_four_or_five_fingers(hand, fingers):
    """A subset of the fingers holds the object alone, and the record knows which."""
    grasp = gp.plan_grasp(problem(hand, contact_set="sphere", contacts=fingers), options=QUICK)
    assert grasp.feasible, grasp.verdict
    assert len(grasp.forces) == len(fingers or hand.contact_frames("sphere"))
    again = gp.grasp_from_record(grasp_record(grasp), hand)
    assert again.problem.contacts == fingers
    np.testing.assert_allclose(again.forces, grasp.forces, rtol=1e-9)


def test_contacts_are_checked(hand):
    with pytest.raises(gp.NameNotFoundError, match="did you mean 'thumb'"):
        problem(hand, contacts=("thum", "index", "ring"))
    with pytest.raises(gp.InvalidValueError, match="at least 3"):
        problem(hand, contacts=("thumb", "index"))
    with pytest.raises(gp.InvalidValueError, match="once"):
        problem(hand, contacts=("thumb", "index", "ring", "ring"))
    assert problem(hand, contacts=("little", "ring", "middle", "index", "thumb")).contacts is None


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("text", ["cylinder:radius=0.045,height=0.18", "sphere:radius=0.045"])
def test_power_grasp(side, text):
    """Proximal and medial phalanges and tips hold a cylinder and a ball of 9 cm."""
    hand = gp.load_hand(f"dlr_hit_ii_{side}")
    grasp = gp.plan_grasp(problem(hand, gp.parse_object(text), contact_set="power"), options=QUICK)
    assert grasp.feasible, grasp.verdict
    links = {frame.link.split("_")[1] for frame in grasp.problem.frames}
    assert {"proximal", "medial"} < links
    assert len(grasp.forces) == 9
    # Each sphere around a contact point touches, as recomputed from the link's own collision capsule.
    data = hand.model.createData()
    pin.framesForwardKinematics(hand.model, data, hand.full_configuration(grasp.joint_angles))
    to_object = grasp.palm_pose * hand.palm_in_root.inverse()
    for frame in grasp.problem.frames:
        centre = to_object.act(data.oMf[frame.frame_id].act(np.array(frame.offset)))
        distance = grasp.problem.grasp_object.sample(centre[None]).distance[0]
        assert distance == pytest.approx(frame.radius, abs=1e-6)


def test_contact_spheres_lie_inside_their_capsules(hand):
    """The sphere of a phalanx contact is centred on the axis of its capsule and has its radius."""
    for frame in hand.contact_frames("links"):
        if frame.name.endswith("_pad"):
            continue
        (geometry,) = [g for g in hand.collision_model.geometryObjects if g.parentFrame == frame.frame_id]
        in_frame = hand.model.frames[frame.frame_id].placement.inverse() * geometry.placement
        local = in_frame.inverse().act(np.array(frame.offset))
        assert np.hypot(local[0], local[1]) < 1e-6
        assert abs(local[2]) <= geometry.geometry.halfLength
        assert frame.radius == pytest.approx(geometry.geometry.radius)


def test_fast_and_clear_kinematics_agree_beside_the_frames(hand):
    """Points, normals and Jacobian of offset contacts: the fused evaluation against Pinocchio's frame Jacobians."""
    power = problem(hand, contact_set="power")
    rng = np.random.default_rng(0)
    q, pose = rng.uniform(hand.lower, hand.upper), pin.SE3.Random()
    x = np.concatenate([q, np.zeros(6), np.zeros(15)])
    fast = ContactGeometryEvaluator(power, PoseChart.around(pose)).evaluate(x)
    contacts = gp.model.find_contacts(
        gp.model.fingertip_positions(hand, power.frames, q, pose), power.radii, power.grasp_object
    )
    np.testing.assert_allclose(fast.points, contacts.points, atol=1e-12)
    jacobian = gp.model.hand_jacobian(hand, power.frames, q, pose, contacts.points)
    np.testing.assert_allclose(fast.jacobian, jacobian, atol=1e-12)


def test_grasp_centre_follows_the_contact_set(hand):
    assert not np.allclose(problem(hand, contact_set="power").grasp_centre, hand.grasp_centre)
    np.testing.assert_array_equal(problem(hand, contact_set="sphere").grasp_centre, hand.grasp_centre)


POWER = ("thumb_pad", "index_pad", "middle_medial", "ring_medial", "little_pad")


@pytest.mark.slow
@pytest.mark.parametrize("text", ["cylinder:radius=0.045,height=0.18", "sphere:radius=0.045"])
def test_power_grasp_with_clear_links(hand, text):
    """Medial phalanges and tips hold 9 cm with every link clear, as coal measures it on the exact geometry."""
    given = gp.GraspProblem.paper(
        hand,
        gp.parse_object(text),
        n_synergies=15,
        synergy_set="santello_clear",
        contact_set="links",
        contacts=POWER,
        clearance=gp.ClearanceOptions(),
    )
    grasp = gp.plan_grasp(given, options=QUICK)
    assert grasp.feasible, grasp.verdict
    assert grasp.overlap("link_object") < 1e-6
    # An inner link touches with its side: the axis of its capsule is tangent to the object there.
    axes = inner_axes(hand, link_shapes(hand), given.frames)
    assert [given.frames[index].name for index, _, _ in axes] == ["middle_medial", "ring_medial"]
    data = hand.model.createData()
    pin.forwardKinematics(hand.model, data, hand.full_configuration(grasp.joint_angles))
    root = grasp.palm_pose * hand.palm_in_root.inverse()
    for index, joint, axis in axes:
        assert grasp.contacts.normals[index] @ (root * data.oMi[joint]).rotation @ axis == pytest.approx(0.0, abs=1e-5)


def test_tangency_is_asked_of_inner_links_only(hand):
    clear = {"clearance": gp.ClearanceOptions()}
    for contact_set, contacts, wanted in (("links", POWER, True), ("sphere", None, False), ("point", None, False)):
        given = gp.GraspProblem.paper(
            hand, gp.Sphere(radius=0.045), contact_set=contact_set, contacts=contacts, **clear
        )
        assert ("tangency" in {term.name for term in problem_constraints(given)}) is wanted
