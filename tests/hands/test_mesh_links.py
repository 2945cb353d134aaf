"""Links that are meshes: capsules hold them in the search, the judge measures the meshes against every object."""

from __future__ import annotations

import coal
import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.collision.coal_distances import ExactDistance
from grasp_planner.collision.link_shapes import guarded_shapes, link_shapes
from grasp_planner.hand.configuration import HandConfiguration
from grasp_planner.hand.geometry_mesh import link_points, surface_points
from grasp_planner.judge.clearance_check import hand_clearances
from grasp_planner.spatial import Pose

from .small_hands import write_hand

OBJECTS = (
    "sphere:radius=0.03",
    "cylinder:radius=0.03,height=0.1",
    "box:x=0.05,y=0.06,z=0.08",
    "capsule:radius=0.025",
    "ellipsoid:x=0.03,y=0.035,z=0.05",
)


@pytest.fixture(scope="module")
def hand(tmp_path_factory):
    return gp.load_hand(write_hand(tmp_path_factory.mktemp("meshes"), "mesh_links"))


def test_capsules_hold_the_meshes(hand):
    """No surface point stands out, and of a mesh that is a capsule hardly anything is added."""
    for entry in hand.collision_model.geometryObjects:
        if not isinstance(entry.geometry, coal.BVHModelBase):
            continue
        fitted = hand.fitted_meshes[entry.name]
        points = surface_points(entry.geometry)
        along = fitted.ends - fitted.starts
        share = np.einsum("nki,ki->nk", points[:, None] - fitted.starts, along) / np.einsum("ki,ki->k", along, along)
        nearest = fitted.starts + np.clip(share, 0.0, 1.0)[..., None] * along
        outside = np.linalg.norm(points[:, None] - nearest, axis=2) - fitted.radii
        assert outside.min(axis=1).max() < 1e-9
        assert len(fitted.radii) == 1 and fitted.error < 1.5e-3


def test_contacts_lie_on_the_surface(hand):
    """Each ball touches the mesh from within, to 0.2 mm, and the link lies behind its plane."""
    for frame in hand.contact_frames():
        solids = [e for e in hand.collision_model.geometryObjects if e.parentJoint == frame.joint_id]
        points, normal = link_points(solids), np.array(frame.normal)
        touch = np.array(frame.centre) + frame.radius * normal
        assert np.linalg.norm(points - touch, axis=1).min() < 2e-4
        assert (points @ normal).max() < touch @ normal + 2e-4


def test_capsules_of_a_touching_link_stay_behind_its_plane(hand):
    margin = 5e-4
    frames = hand.contact_frames()
    kept = guarded_shapes(hand, link_shapes(hand), frames, margin)
    for frame in frames:
        mine = [shape for shape in kept if shape.joint == frame.joint_id]
        assert mine and all(shape.fitted for shape in mine)
        normal = np.array(frame.normal)
        level = normal @ np.array(frame.centre) + frame.radius
        for shape in mine:
            assert max(normal @ shape.start, normal @ shape.end) + shape.radius < level - margin


@pytest.mark.parametrize("text", OBJECTS)
def test_the_judge_measures_meshes_against_every_object(hand, text):
    """The distance of a mesh is the least that the points of its surface have from the object."""
    problem = gp.GraspProblem(hand, gp.parse_object(text))
    q, palm = problem.synergies.mean, Pose(np.eye(3), np.array([0.0, 0.0, -0.16]))
    poses = HandConfiguration(hand, q, palm).geometry_poses
    found = [pair for pair in hand_clearances(problem, q, palm) if pair.kind == "link_object"]
    for entry, pose, pair in zip(hand.collision_model.geometryObjects, poses, found, strict=True):
        points = surface_points(entry.geometry) @ np.array(pose.rotation).T + pose.translation
        least = float(problem.grasp_object.solid.sample(points).distance.min())
        assert pair.distance == pytest.approx(least, abs=4e-4)


def test_meshes_that_overlap_have_a_depth(hand):
    mesh = next(e.geometry for e in hand.collision_model.geometryObjects if isinstance(e.geometry, coal.BVHModelBase))
    apart, inside = (coal.Transform3s(np.eye(3), np.array([x, 0.0, 0.0])) for x in (0.02, 0.012))
    assert ExactDistance()(mesh, apart, mesh, coal.Transform3s()) == pytest.approx(0.004, abs=4e-4)
    assert ExactDistance()(mesh, inside, mesh, coal.Transform3s()) < 0.0
