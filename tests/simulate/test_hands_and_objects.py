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
from grasp_planner.simulate import simulate_grasp
from grasp_planner.simulate.mjcf_object import object_solids

ROOT = Path(__file__).parents[2]


def rest_of(hand, grasp_object, n_synergies, protocol, contact_set=None, seed=0):
    """Plan, and simulate with a little more friction than planned, so that nothing slips."""
    problem = gp.GraspProblem.paper(hand, grasp_object, n_synergies=n_synergies, contact_set=contact_set)
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


def test_without_coacd_a_mesh_is_its_hull_and_says_so(mesh_object, monkeypatch):
    monkeypatch.setitem(sys.modules, "coacd", None)
    grasp_object = mesh_object(trimesh.creation.torus(0.03, 0.012))
    solids, note = object_solids(grasp_object)
    assert len(solids) == 1
    assert "convex hull" in note
    assert trimesh.convex.convex_hull(solids[0].vertices).volume > 1.2 * grasp_object.mesh.volume


@pytest.mark.slow
def test_the_documentation_runs_as_printed(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs/simulation.md").read_text(encoding="utf-8"), re.S)
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "force directions held" in done.stdout
