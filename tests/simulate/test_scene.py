"""The scene is the plan: kinematics, springs, fingertips, objects, and nothing else that touches or pulls."""

from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.hand.description import hand_library
from grasp_planner.simulate import World, build_scene, find_protocol
from grasp_planner.simulate.mjcf_object import add_object, object_solids
from grasp_planner.simulate.tips import COMPRESSION
from grasp_planner.simulate.xml_text import ElementTree, add

PLAN = find_protocol("plan")


def any_grasp(hand, rng, **fields):
    """A posture anywhere, no grasp at all."""
    problem = gp.GraspProblem.paper(hand, gp.Sphere(0.03), n_synergies=min(3, hand.synergies().n_synergies), **fields)
    pose = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(scale=0.2, size=3))
    return gp.Grasp(problem, rng.uniform(hand.lower, hand.upper), pose, np.zeros(problem.n_synergies))


@pytest.mark.parametrize("name", sorted(hand_library()))
def test_bodies_and_fingertips_are_where_pinocchio_has_them(name, rng):
    hand = gp.load_hand(name)
    for contact_set in hand.contact_set_names:
        grasp = any_grasp(hand, rng, contact_set=contact_set)
        world = World(grasp, PLAN)
        world.reset(grasp.joint_angles, np.zeros(grasp.problem.n_synergies))
        data = hand.model.createData()
        pin.forwardKinematics(hand.model, data, hand.full_configuration(grasp.joint_angles))
        root = grasp.palm_pose * hand.palm_in_root.inverse()
        for joint in range(1, hand.model.njoints):
            body = world.data.body(f"link_{hand.model.names[joint]}")
            pose = root * data.oMi[joint]
            np.testing.assert_allclose(body.xpos, pose.translation, atol=1e-9)
            np.testing.assert_allclose(body.xmat.reshape(3, 3), pose.rotation, atol=1e-9)
        for tip, frame, point in zip(world.scene.tip_names, grasp.problem.frames, grasp.contacts.points, strict=True):
            geom = world.data.geom(tip)
            radius = float(world.model.geom(tip).size[0])
            # The planned contact lies on the fingertip, but for the compression at the start.
            assert np.linalg.norm(point - geom.xpos) == pytest.approx(radius - COMPRESSION, abs=1e-9), frame.name


@pytest.mark.parametrize("name", sorted(hand_library()))
def test_springs_and_motors_give_the_torques_of_the_references(name, rng):
    hand = gp.load_hand(name)
    grasp = any_grasp(hand, rng)
    problem, world = grasp.problem, World(grasp, PLAN)
    sigma = rng.normal(size=problem.n_synergies)
    world.reset(grasp.joint_angles, sigma)
    wanted = (problem.synergies.joint_angles(sigma) - grasp.joint_angles) / problem.joint_compliance
    torques = world.data.qfrc_spring + world.data.qfrc_actuator
    by_name = {joint: torques[world.model.joint(joint).dofadr[0]] for joint in list(hand.model.names)[1:]}
    np.testing.assert_allclose([by_name[joint] for joint in hand.joint_names], wanted, atol=1e-9)
    assert not [value for joint, value in by_name.items() if joint not in hand.joint_names and value != 0.0]
    assert world.model.nu == problem.n_synergies


def test_at_the_plan_the_springs_balance_the_contact_forces(held):
    world = World(held, PLAN)
    world.reset(held.joint_angles, held.sigma)
    torques = world.data.qfrc_spring + world.data.qfrc_actuator
    index = [world.model.joint(name).dofadr[0] for name in held.problem.hand.joint_names]
    np.testing.assert_allclose(torques[index], held.joint_torques, atol=1e-6)


def test_the_hand_carries_its_own_weight(held):
    world = World(held, PLAN)
    world.reset(held.joint_angles, held.sigma)
    index = [world.model.joint(name).dofadr[0] for name in held.problem.hand.joint_names]
    np.testing.assert_allclose((world.data.qfrc_bias - world.data.qfrc_gravcomp)[index], 0.0, atol=1e-12)


def test_coupled_joints_follow(held, tips_only):
    world = World(held, tips_only)
    world.reset(held.joint_angles, held.sigma)
    world.run(0.5)
    hand = held.problem.hand
    full = hand.full_configuration(world.independent_angles)
    assert np.abs(world.joint_angles - full).max() < 2e-4


def test_only_listed_pairs_can_touch(held):
    model = World(held, PLAN).model
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    ignored = {frozenset(pair) for pair in held.problem.hand.description.collision.ignore}
    assert frozenset(("index_medial", "index_distal")) in ignored
    for first, second in zip(model.pair_geom1, model.pair_geom2, strict=True):
        names = model.geom(int(first)).name, model.geom(int(second)).name
        assert not ("medial" in names[0] and "distal" in names[1] and names[0][8:12] == names[1][8:12]), names


def test_links_around_point_fingertips_do_not_touch_the_object(planned):
    model = World(planned, PLAN).model
    pairs = [
        {model.geom(int(first)).name, model.geom(int(second)).name}
        for first, second in zip(model.pair_geom1, model.pair_geom2, strict=True)
    ]
    with_object = set.union(*(pair for pair in pairs if pair & {"object_0", "object_1"}))
    assert not [name for name in with_object if "distal" in name]
    assert [name for name in with_object if "medial" in name]
    assert "tip_thumb" in with_object


def test_links_meet_a_cylinder_with_the_rounded_rims_they_keep_clear_of(planned):
    model = World(planned, PLAN).model
    pairs = [
        {model.geom(int(first)).name, model.geom(int(second)).name}
        for first, second in zip(model.pair_geom1, model.pair_geom2, strict=True)
    ]
    tips = {"object_0", *World(planned, PLAN).scene.tip_names}
    assert set.union(*(pair for pair in pairs if "object_0" in pair)) == tips
    assert not set.union(*(pair for pair in pairs if "object_1" in pair)) & tips
    cylinder = planned.problem.grasp_object
    (side, hull), _ = object_solids(cylinder)
    assert side.kind == "cylinder" and side.touched_by == "tips" and hull.touched_by == "links"
    distances = cylinder.solid.sample(hull.vertices).distance
    np.testing.assert_allclose(distances, 0.0, atol=1e-12)  # every corner lies on the solid that is kept clear of
    assert np.abs(hull.vertices[:, 2]).max() == pytest.approx(cylinder.height / 2)
    assert np.linalg.norm(hull.vertices[:, :2], axis=1).max() == pytest.approx(cylinder.radius)


OBJECTS = [
    gp.Sphere(0.03),
    gp.Cylinder(0.03, 0.15),
    gp.Capsule(0.02, 0.06),
    gp.Box(0.04, 0.06, 0.1),
    gp.EllipsoidObject(0.03, 0.04, 0.05),
]


@pytest.mark.parametrize("grasp_object", OBJECTS, ids=lambda entry: entry.kind)
def test_the_simulated_object_has_the_planned_surface(grasp_object, rng):
    probe, radius = 1e-3, 1e-3
    root = ElementTree.Element("mujoco")
    world = add(root, "worldbody")
    solids, note = object_solids(grasp_object)
    solids = tuple(solid for solid in solids if solid.touched_by != "links")
    names = add_object(world, grasp_object, 0.2, solids)
    body = add(world, "body", name="probe")
    add(body, "freejoint", name="free")
    add(body, "geom", name="probe", type="sphere", size=[radius])
    model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
    data = mujoco.MjData(model)
    assert note.startswith("exact")
    points = rng.uniform(-1.3, 1.3, size=(400, 3)) * grasp_object.half_extents
    points[:, 2] *= 0.6
    distances = grasp_object.sample(points).distance
    outside = distances > 2 * probe
    assert outside.sum() > 50
    for point, distance in zip(points[outside], distances[outside], strict=True):
        data.joint("free").qpos[:3] = point
        mujoco.mj_kinematics(model, data)
        ids = [model.geom(name).id for name in names]
        found = min(mujoco.mj_geomDistance(model, data, model.geom("probe").id, k, 1.0, None) for k in ids)
        assert found == pytest.approx(distance - radius, abs=2e-6)


def test_mass_inertia_and_friction_are_those_of_the_test(held):
    world = World(held, replace(PLAN, mass=0.1, friction=0.6))
    body = world.model.body("object")
    assert float(body.mass[0]) == pytest.approx(0.1)
    np.testing.assert_allclose(
        np.sort(body.inertia), np.sort(np.linalg.eigvalsh(held.problem.grasp_object.inertia)) / 2, rtol=1e-6
    )
    assert set(world.model.pair_friction[:, :2].ravel()) == {0.6}


def test_a_rigid_joint_has_no_spring(right, rng):
    grasp = any_grasp(right, rng, parameters=gp.GraspParameters(joint_compliance=0.0))
    with pytest.raises(gp.InvalidValueError, match="joint_compliance"):
        build_scene(grasp, PLAN)
