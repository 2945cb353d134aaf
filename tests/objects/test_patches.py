"""Where a hand closes on part of an object: opposed patches of a surface, and starts on them."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import grasp_planner as gp
from grasp_planner.planning import starts


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    """A plate of 12 mm in the plane of x and y."""
    path = tmp_path_factory.mktemp("patches") / "plate.stl"
    trimesh.creation.box((0.14, 0.12, 0.012)).export(path)
    return gp.MeshObject.load(path, resolution=0.002)


def test_patches_of_a_plate_are_its_faces(plate):
    """Its sides are too narrow and too far apart: all pairs are across z, halfway, and away from the edges."""
    points, across = plate.opposed_patches()
    assert len(points) > 100
    assert np.abs(across[:, 2]).min() > 0.9
    np.testing.assert_allclose(points[:, 2], 0.0, atol=1e-6)
    assert (np.abs(points[:, :2]) < [0.068, 0.058]).all()


def test_patches_follow_the_size(plate):
    """A plate twice as large has patches of its own, and closed forms have none."""
    points, _ = plate.resized(2.0).opposed_patches()
    assert np.abs(points[:, 0]).max() > 0.08
    assert len(gp.Box().opposed_patches()[0]) == 0


def test_narrow_objects_are_grasped_as_a_whole(plate, monkeypatch):
    """Their starts are the same whether they have patches or not."""
    problem = gp.GraspProblem(gp.load_hand("dlr_hit_ii_right"), plate.resized(0.5))
    first = gp.random_start(problem, np.random.default_rng(0))
    monkeypatch.setattr(starts, "ON_PATCHES", 0.0)
    assert gp.random_start(problem, np.random.default_rng(0)) == first


def test_starts_close_on_patches(plate, monkeypatch):
    """The middle of the hand is on the plate, the palm outside comes from the side, thumb and fingers across it."""
    monkeypatch.setattr(starts, "ON_PATCHES", 1.0)
    problem = gp.GraspProblem(gp.load_hand("dlr_hit_ii_right"), plate)
    hand, rng = problem.hand, np.random.default_rng(0)
    for _ in range(20):
        pose = gp.random_start(problem, rng).palm_pose
        rotation, translation = np.asarray(pose.rotation), np.asarray(pose.translation)
        middle = rotation @ problem.grasp_centre + translation
        assert plate.distances(middle[None])[0] < 0.03
        assert abs((rotation @ hand.palm_normal)[2]) < 0.75
        closing_across = np.cross(rotation @ hand.palm_normal, rotation @ hand.closing_axis)
        assert abs(closing_across[2]) > 0.6
        away = middle - starts.PALM_AWAY * (rotation @ hand.palm_normal)
        assert plate.distances(away[None])[0] > 0.0
