"""Links of a hand that MuJoCo does not know by their name: convex hulls of meshes, and joints that slide."""

from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.collision.link_shapes import LinkShape
from grasp_planner.hand.hull_fit import fit_hull
from grasp_planner.simulate.mjcf_hand import add_shape, joint_axis, mesh_vertices, slides

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
