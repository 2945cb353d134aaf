"""Objects on a table: how they stand, and that hands come from above."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli.main import main
from grasp_planner.cli.options import problem_from_options
from grasp_planner.objects.resting import resting_pose, resting_poses
from grasp_planner.planning.starts import random_start, standard_start
from grasp_planner.problem.clearance_options import ClearanceOptions
from grasp_planner.problem.from_settings import PROBLEM_SETTINGS


def loaded(folder, mesh, **named):
    """The object of a mesh, with a coarse grid."""
    mesh.export(folder / "thing.ply")
    return gp.MeshObject.load(folder / "thing.ply", resolution=0.004, **named)


def test_a_box_stands_on_six_sides():
    """The lowest first; upright as drawn."""
    brick = gp.Box(x=0.04, y=0.06, z=0.1, edge=0.001)
    poses = resting_poses(brick)
    flat = [pose for pose in poses if np.abs(pose.up).max() > 1.0 - 1e-9]
    np.testing.assert_allclose(sorted(pose.height for pose in flat), np.repeat([0.02, 0.03, 0.05], 2), atol=1e-6)
    assert poses[0].height == pytest.approx(0.02)
    np.testing.assert_allclose(resting_pose(brick).up, [0.0, 0.0, 1.0], atol=1e-9)
    assert resting_pose(brick).height == pytest.approx(0.05)


def test_what_would_tip_lies_down(tmp_path):
    """A slanted prism whose centre is not above its foot; a given centre of mass lets it stand."""
    foot = np.array([[0, 0, 0], [0.03, 0, 0], [0, 0.03, 0], [0.03, 0.03, 0]])
    leaning = trimesh.convex.convex_hull(np.vstack([foot, foot + np.array([0.07, 0.0, 0.08])]))
    lying = resting_pose(loaded(tmp_path, leaning))
    assert lying.up[2] < 0.9
    standing = resting_pose(loaded(tmp_path, leaning, com=(0.015, 0.015, 0.01)))
    np.testing.assert_allclose(standing.up, [0.0, 0.0, 1.0], atol=1e-6)
    assert standing.height == pytest.approx(0.01)


def test_the_poses_are_stable_by_energy(tmp_path):
    """Leaning a little over any edge of its side lifts the centre of mass."""
    rng = np.random.default_rng(3)
    thing = loaded(tmp_path, trimesh.convex.convex_hull(rng.uniform(-0.03, 0.03, (12, 3))))
    corners, poses = np.asarray(thing.mesh.vertices), resting_poses(thing)
    assert poses
    for pose in poses:
        assert -(corners @ pose.up).min() == pytest.approx(pose.height)
        for tilt in rng.normal(size=(20, 3)):
            up = pose.up + 1e-3 * tilt
            assert -(corners @ (up / np.linalg.norm(up))).min() > pose.height
    others = -rng.normal(size=(50, 3))
    lowest = min(-(corners @ (up / np.linalg.norm(up))).min() for up in others)
    assert poses[0].height <= lowest


def test_what_stands_nowhere_is_one_line(tmp_path):
    """Its centre of mass, as given, is over no side."""
    corner = trimesh.convex.convex_hull(0.04 * np.vstack([np.zeros(3), np.eye(3)]))
    thing = loaded(tmp_path, corner, com=(0.039, 0.039, 0.039))
    with pytest.raises(gp.InvalidValueError, match="stands on a side"):
        resting_pose(thing)


def options(**named):
    """The problem of some options of the command line."""
    plain = {"hand": "dlr_hit_ii_right", "tasks": ("force:+z",), "paper": False, "clearance": None, "loads": None}
    plain |= {each.column: () if each.many else None for each in PROBLEM_SETTINGS.values()}
    return problem_from_options(**(plain | {"object_text": "cylinder:radius=0.03,height=0.1", "table": True} | named))


def test_the_option_gives_gravity_and_ground(capsys):
    """Of gravity the size is kept; a height beside it is a contradiction."""
    problem = options()
    np.testing.assert_allclose(problem.parameters.gravity, [0.0, 0.0, -9.81], atol=1e-9)
    assert problem.clearance.ground == pytest.approx(-0.05)
    assert "above the table" in capsys.readouterr().err
    lying = options(object_text="box:x=0.15,y=0.15,z=0.02", gravity="0,1.62,0")
    np.testing.assert_allclose(lying.parameters.gravity, [0.0, 0.0, -1.62], atol=1e-9)
    found = CliRunner().invoke(main, ["plan", "--table", "--ground", "0"])
    assert found.exit_code == 2 and "--table" in found.output


def test_hands_come_from_above():
    """No start has its palm normal pointing up from a table; without one, half of them do."""
    hand, plate = gp.load_hand("dlr_hit_ii_right"), gp.Box(x=0.1, y=0.1, z=0.02)
    for ground, most in ((-0.01, 0.3), (None, 1.0)):
        problem = gp.GraspProblem(hand, plate, clearance=ClearanceOptions(ground=ground))
        rng = np.random.default_rng(0)
        starts = [standard_start(problem), *(random_start(problem, rng) for _ in range(40))]
        highest = max(float((start.palm_pose.rotation @ hand.palm_normal)[2]) for start in starts)
        assert (highest <= most) if ground is not None else (highest > 0.5)
