"""Other hands and objects at rest as planned; meshes; the Python of the documentation."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

import grasp_planner as gp
from grasp_planner.simulate import scene, simulate_grasp
from grasp_planner.simulate.convex_pieces import convex_pieces
from grasp_planner.simulate.mjcf_object import ObjectSolid, object_solids
from grasp_planner.simulate.protocol import PLAN
from grasp_planner.simulate.simulation_record import simulation_record
from tests.stored import TOTAL

ROOT = Path(__file__).parents[2]


def rest_of(hand, grasp_object, n_synergies, protocol, contact_set=None, seed=0):
    """Plan, and simulate with a little more friction than planned, so that nothing slips."""
    fields = {"n_synergies": n_synergies, "parameters": TOTAL, "contact_set": contact_set}
    problem = gp.GraspProblem.paper(hand, grasp_object, **fields)
    grasp = gp.plan_grasp(problem, seed=seed, options=gp.PlannerOptions(enough=1))
    assert grasp.feasible
    test = replace(protocol, friction=1.1 * problem.parameters.friction, torques=False, hold_s=0.2)
    return simulate_grasp(grasp, test, ladder=False)


@pytest.mark.parametrize(("name", "n_synergies"), [("allegro_right", 16), ("tendon_hand", 4), ("dlr_hit_ii_left", 3)])
def test_other_hands_rest_as_planned(name, n_synergies, tips_only):
    found = rest_of(gp.load_hand(name), gp.Cylinder(0.03), n_synergies, tips_only)
    assert found.rest.held
    assert found.rest.displacement < 1e-4
    assert found.rest.normal_force_error < 0.1


@pytest.mark.parametrize(
    "grasp_object", [gp.Sphere(0.035), gp.Box(0.05, 0.05, 0.12), gp.Capsule(0.03, 0.08)], ids=lambda entry: entry.kind
)
def test_other_objects_rest_as_planned(grasp_object, right, tips_only):
    found = rest_of(right, grasp_object, 15, tips_only, contact_set="sphere")
    assert found.rest.held
    assert found.rest.displacement < 1e-4
    assert found.rest.normal_force_error < 0.1
    assert found.surface_error < 1e-6


@pytest.fixture
def mesh_object(tmp_path):
    """Make an object of a mesh."""

    def make(mesh):
        mesh.export(tmp_path / "object.stl")
        return gp.parse_object(f"mesh:{tmp_path / 'object.stl'},mass=0.2,resolution=0.002")

    return make


def test_a_convex_mesh_is_one_exact_solid(mesh_object):
    grasp_object = mesh_object(trimesh.creation.box((0.04, 0.05, 0.1)))
    solids, note = object_solids(grasp_object)
    assert len(solids) == 1
    assert "exact" in note
    np.testing.assert_allclose(np.ptp(solids[0].vertices, axis=0), [0.04, 0.05, 0.1], atol=1e-6)


def test_a_hollow_mesh_is_pieces_that_hold_it_and_stand_out_by_what_is_said(mesh_object, rng):
    outside = trimesh.creation.cylinder(radius=0.03, height=0.05)
    inside = trimesh.creation.cylinder(radius=0.026, height=0.05).apply_translation([0.0, 0.0, 0.005])
    grasp_object = mesh_object(trimesh.boolean.difference([outside, inside]))
    solids, note = object_solids(grasp_object)
    hulls = [trimesh.convex.convex_hull(solid.vertices) for solid in solids]
    said = 1e-3 * float(re.search(r"by up to ([\d.]+) mm", note)[1])
    assert len(solids) > 4 and said <= 1.1e-3
    points = rng.uniform(*grasp_object.mesh.bounds, size=(400, 3))
    covered = np.max([trimesh.proximity.signed_distance(hull, points) for hull in hulls], axis=0) > -1e-7
    distance = grasp_object.nearest(points).distance
    assert covered[distance < -1e-6].all() and (distance < 0.0).any()
    assert distance[covered].max() <= said + 1e-4
    assert not covered[distance > 2e-3].any() and (distance > 2e-3).any()


def test_triangles_that_cannot_be_cut_are_their_hull(rng):
    mesh = trimesh.creation.torus(0.03, 0.012)
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)  # an open surface is no manifold
    found = convex_pieces(mesh)
    assert len(found.corners) == 1 and found.standing_out > 0.01


def test_what_is_another_object_is_not_simulated_and_no_failure(right, monkeypatch):
    problem = gp.GraspProblem.paper(right, gp.Cylinder(0.03), n_synergies=3)
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(enough=1))
    larger = (ObjectSolid("cylinder", (0.035, 0.075)),)
    monkeypatch.setattr(scene, "object_solids", lambda _: (larger, "a larger cylinder"))
    found = simulate_grasp(grasp, replace(PLAN, geometry="contacts"), ladder=False)
    assert found.rest is None and found.directions == () and not found.passed
    assert (
        found.verdict == "not simulated: what stands for the object is 5.0 mm off the planned contacts (at most 2 mm)"
    )
    assert not simulation_record(found)["simulated"]


@pytest.mark.slow
def test_the_documentation_runs_as_printed(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs/simulation.md").read_text(encoding="utf-8"), re.S)
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "force directions held" in done.stdout
