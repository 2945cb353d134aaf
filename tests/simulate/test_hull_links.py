"""Links of a hand that MuJoCo does not know by their name: convex hulls of meshes, and joints that slide."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial import ConvexHull

import grasp_planner as gp
from grasp_planner.collision.link_shapes import LinkShape, shape_pairs
from grasp_planner.hand.description import CollisionDescription
from grasp_planner.hand.hull_fit import fit_hull
from grasp_planner.hand.loading import loaded_hand
from grasp_planner.planning.starts import standard_start
from grasp_planner.simulate.mjcf_hand import add_shape, joint_axis, mesh_vertices, slides
from grasp_planner.simulate.protocol import PLAN
from grasp_planner.simulate.scene import build_scene
from grasp_planner.simulate.tips import PATCH_INSET, _thinner, colliding_solids, fingertips

from ..hands.small_hands import write_hand


@pytest.fixture(scope="module")
def hull(tmp_path_factory):
    """The hull of the palm of a hand with mesh links, as a solid of its first joint."""
    hand = gp.load_hand(write_hand(tmp_path_factory.mktemp("mesh"), "mesh_links"))
    mesh = next(e.geometry for e in hand.collision_model.geometryObjects if hasattr(e.geometry, "num_vertices"))
    fitted = fit_hull(mesh)
    middle = fitted.corners.mean(axis=0)
    solid = LinkShape(
        "rod",
        "rod",
        1,
        1,
        middle,
        middle,
        0.05,
        fitted.corners,
        fitted.rim,
        fitted.geometry(),
        pin.SE3.Identity(),
        True,
    )
    return fitted, solid


def test_a_hull_is_simulated_as_the_mesh_of_its_corners(hull):
    """The corners are the vertices of the mesh that the geom names."""
    fitted, solid = hull
    np.testing.assert_array_equal(mesh_vertices(solid), fitted.corners)
    body = ElementTree.Element("body")
    add_shape(body, "solid", solid)
    assert [(geom.get("type"), geom.get("mesh")) for geom in body] == [("mesh", "mesh_solid")]


def test_a_hull_that_carries_a_patch_is_thinner_on_every_side(hull):
    """Every face is moved inwards by the inset, so that the ball of the contact touches first."""
    _, solid = hull
    before, after = mesh_vertices(solid), mesh_vertices(_thinner(solid))
    outside = ConvexHull(before).equations
    depths = -(after @ outside[:, :3].T + outside[:, 3])
    assert depths.min() == pytest.approx(PATCH_INSET, abs=1e-9)


def test_hulls_that_overlap_at_rest_do_not_push_each_other(tmp_path):
    """The simulated pairs of solids are those that the search keeps apart."""
    loaded = loaded_hand(write_hand(tmp_path, "flat_pads"))
    problem = gp.GraspProblem(loaded.hand, gp.parse_object(loaded.first_object))
    start = standard_start(problem)
    grasp = gp.Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma)
    solids = colliding_solids(grasp, fingertips(grasp))
    wanted = {frozenset(f"solid_{k}_{solids[k].name}" for k in pair) for pair in shape_pairs(problem.hand, solids)}
    xml = ElementTree.fromstring(build_scene(grasp, PLAN).xml)
    pairs = (frozenset((pair.get("geom1"), pair.get("geom2"))) for pair in xml.iter("pair"))
    assert {pair for pair in pairs if all(name.startswith("solid_") for name in pair)} == wanted


def standing(problem):
    """The grasp that a hand stands in before any search."""
    start = standard_start(problem)
    return gp.Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma)


def simulated_pairs(grasp):
    """Pairs of geometries that may touch in the simulation, by name."""
    xml = ElementTree.fromstring(build_scene(grasp, PLAN).xml)
    return {frozenset((pair.get("geom1"), pair.get("geom2"))) for pair in xml.iter("pair")}


def test_neighbours_that_overlap_at_rest_do_not_collide_though_nothing_ignores_them(tmp_path):
    """The hulls of two phalanges share the joint between them; those of two fingers are apart and collide."""
    loaded = loaded_hand(write_hand(tmp_path, "mesh_links"))
    every = loaded.hand.description.model_copy(update={"collision": CollisionDescription()})
    hand = replace(loaded.hand, description=every)
    problem = gp.GraspProblem(hand, gp.parse_object(loaded.first_object))
    pairs = simulated_pairs(standing(problem))

    def collide(first, second):
        return any(all(any(f"_{link}_" in name for name in pair) for link in (first, second)) for pair in pairs)

    for finger in ("thumb", "left", "right"):
        assert not collide(f"{finger}_1", f"{finger}_2")
    assert collide("left_2", "thumb_2")


def test_the_ball_of_a_patch_touches_the_object_only(tmp_path):
    """It is the link's surface there only; a whole ball of a fingertip also meets the other links."""
    loaded = loaded_hand(write_hand(tmp_path, "flat_pads"))
    patches = gp.GraspProblem(loaded.hand, gp.parse_object(loaded.first_object))
    balls = gp.GraspProblem(gp.load_hand("tendon_hand"), gp.Sphere(radius=0.03))
    for problem, whole in ((patches, False), (balls, True)):
        assert all((frame.patch is None) == whole for frame in problem.frames)
        pairs = simulated_pairs(standing(problem))
        for frame in problem.frames:
            others = {name for pair in pairs if f"tip_{frame.name}" in pair for name in pair} - {f"tip_{frame.name}"}
            assert "object_0" in others
            assert (others != {"object_0"}) == whole


def test_a_joint_that_slides_has_the_axis_it_slides_along(tmp_path):
    """A jaw along x slides along x; a joint that turns does not slide."""
    jaws = gp.load_hand(write_hand(tmp_path, "prismatic"))
    joint = jaws.model.getJointId("left_slide")
    assert slides(jaws, joint)
    np.testing.assert_allclose(joint_axis(jaws, joint), (1.0, 0.0, 0.0), atol=1e-12)
    turning = gp.load_hand(write_hand(tmp_path, "mimic_chain"))
    joint = turning.model.getJointId("left_inner")
    assert not slides(turning, joint)
    np.testing.assert_allclose(joint_axis(turning, joint), (0.0, 1.0, 0.0), atol=1e-12)
