"""What stands for a mesh in the search, and the patches of a link's surface that may touch."""

from __future__ import annotations

from dataclasses import replace

import coal
import numpy as np
import pytest
import trimesh

import grasp_planner as gp
from grasp_planner.evaluation.state import StateEvaluator
from grasp_planner.hand.configuration import HandConfiguration
from grasp_planner.hand.contact_frame import SKIN
from grasp_planner.hand.hull_fit import directions, fit_hull, point_distance, surface_distance
from grasp_planner.judge.clearance_check import contact_off_link, tip_overhang
from grasp_planner.planning.starts import random_start
from grasp_planner.terms.registry import judged_requirements

from .small_hands import write_hand


@pytest.fixture(scope="module")
def hand(tmp_path_factory):
    return gp.load_hand(write_hand(tmp_path_factory.mktemp("skin"), "mesh_links"))


def coal_mesh(mesh):
    """Return a mesh as coal knows it."""
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in mesh.vertices:
        points.append(vertex)
    for face in mesh.faces:
        triangles.append(coal.Triangle(*(int(k) for k in face)))
    model.addSubModel(points, triangles)
    model.endModel()
    return model


def wedge():
    """Return a finger with a box for a body and a round end, of thousands of triangles."""
    body = trimesh.creation.box(extents=(0.014, 0.02, 0.03))
    end = trimesh.creation.icosphere(subdivisions=4, radius=0.01)
    end.apply_translation((0.0, 0.0, 0.018))
    return trimesh.util.concatenate([body, end])


def test_the_hull_holds_the_mesh_and_says_how_far_it_stands_out():
    mesh = wedge()
    fitted = fit_hull(coal_mesh(mesh))
    solid = fitted.geometry()
    assert max(point_distance(solid, vertex) for vertex in mesh.vertices) < 1e-9
    turned = directions(300)
    beyond = (fitted.corners @ turned.T).max(axis=0) + fitted.rim - (mesh.vertices @ turned.T).max(axis=0)
    assert beyond.max() < fitted.error + 1e-9
    assert fitted.rim < 4e-4 and len(fitted.corners) < 400


def test_patches_are_the_surface_of_their_links(hand):
    """Wherever a patch's normal points, the ball is within 0.2 mm of the mesh, and no point lies farther out."""
    rng = np.random.default_rng(1)
    for frame in hand.contact_frames():
        solids = [e for e in hand.collision_model.geometryObjects if e.parentJoint == frame.joint_id]
        walls, room = frame.patch.walls()
        normals = rng.normal(size=(4000, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        inside = normals[(normals @ walls.T + room >= 0.0).all(axis=1)]
        assert len(inside) > 20
        points = np.vstack([e.geometry.vertices() @ e.placement.rotation.T + e.placement.translation for e in solids])
        for normal in inside[:40]:
            touch = np.array(frame.centre) + frame.radius * normal
            assert surface_distance(solids, touch) < SKIN
            assert (points @ normal).max() < touch @ normal + SKIN


def test_walls_of_a_patch_are_its_angles(hand):
    patch = hand.contact_frames()[0].patch
    walls, room = patch.walls()
    normal, across = np.array(patch.normal), np.array(patch.across)
    along = np.cross(across, normal)
    for angle, within in ((patch.bend - 1e-6, True), (patch.bend + 1e-6, False)):
        for sign in (1.0, -1.0):
            bent = np.cos(angle) * normal + sign * np.sin(angle) * along
            assert bool((walls @ bent + room >= 0.0).all()) is within
    for angle, within in ((patch.side - 1e-6, True), (patch.side + 1e-6, False)):
        for sign in (1.0, -1.0):
            aside = np.cos(angle) * normal + sign * np.sin(angle) * across
            assert bool((walls @ aside + room >= 0.0).all()) is within


def test_search_and_judge_agree_when_a_normal_leaves_its_patch(hand):
    """The four walls of a contact are met in the search exactly where the judge finds no overhang of it."""
    problem = gp.GraspProblem(hand, gp.parse_object("sphere:radius=0.03"))
    rng, seen = np.random.default_rng(3), []
    for _ in range(60):
        q, palm = rng.uniform(hand.lower, hand.upper), random_start(problem, rng).palm_pose
        evaluator = StateEvaluator(problem, palm.se3())
        state = evaluator.evaluate(evaluator.pack(q, palm.se3(), np.zeros(problem.n_synergies)))
        configuration = HandConfiguration(hand, q, palm)
        poses = configuration.joint_poses
        for number, walls in enumerate(state.clearance.tip_patch.reshape(-1, 4)):
            normals = np.array([poses[frame.joint_id].rotation @ frame.patch.normal for frame in problem.frames])
            assert tip_overhang(problem, configuration, normals) < 1e-12
            normals[number] = state.geometry.normals[number]
            seen.append(bool((walls >= 0.0).all()))
            assert seen[-1] == (tip_overhang(problem, configuration, normals) < 1e-12)
    assert 5 < sum(seen) < 175


@pytest.mark.parametrize("off", (0.0, 1e-4, 3.2e-3, 0.01))
def test_a_contact_in_the_air_is_a_violation(hand, off):
    """A ball that is larger than the finger touches in front of it: by so much, less the skin."""
    sets = hand.description.contact_sets
    thumb = sets["sphere"]["thumb"]
    grown = {**sets["sphere"], "thumb": thumb.model_copy(update={"radius": thumb.radius + off})}
    description = hand.description.model_copy(update={"contact_sets": {"sphere": grown}})
    problem = gp.GraspProblem(replace(hand, description=description), gp.parse_object("sphere:radius=0.03"))
    q = problem.synergies.mean
    configuration = HandConfiguration(hand, q)
    root = configuration.joint_poses
    normals = np.array([root[frame.joint_id].rotation @ frame.patch.normal for frame in problem.frames])
    found = contact_off_link(problem, configuration, normals)
    assert found == pytest.approx(max(0.0, off - SKIN), abs=SKIN)
    assert (found > 0.0) == (off > 1e-3)


def test_contacts_on_links_are_asked_for_where_links_keep_clear(hand):
    problem = gp.GraspProblem(hand, gp.parse_object("sphere:radius=0.03"))
    assert "contact_off_link" in {term.name for term in judged_requirements(problem)}
    paper = gp.GraspProblem.paper(hand, gp.parse_object("sphere:radius=0.03"))
    assert "contact_off_link" not in {term.name for term in judged_requirements(paper)}
