"""The exact surface: sides by winding number, normals under a footprint, and what judge and search make of them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import igl
import numpy as np
import pytest
import trimesh

import grasp_planner as gp
from grasp_planner.evaluation.edge_reserve import edge_reserve
from grasp_planner.grasp.verdict import on_edges
from grasp_planner.judge.surface_check import FOOTPRINT, SPREAD
from grasp_planner.model.contacts import Contacts
from grasp_planner.multistart.problem_rows import BatchedProblem
from grasp_planner.objects.distance_grid import build_distance_grid
from grasp_planner.objects.normal_spread import normal_spread
from grasp_planner.objects.triangles import Triangles
from grasp_planner.planning.program import GraspProgram
from grasp_planner.problem.cone_reserve import NORMAL_ERROR, cone_reserve
from grasp_planner.spatial import Pose
from grasp_planner.terms.edge import EdgeDistance
from grasp_planner.terms.friction import FrictionCone

from ..test_multistart import in_palm, random_states
from .helpers import central_differences


def folded_tube():
    """A tube bent more tightly than it is thick: it folds over itself at the bend, its shading normals mislead."""
    angle = np.linspace(0.0, 1.5 * np.pi, 40)
    bend = 0.005 * np.column_stack([np.cos(angle), np.zeros(40), np.sin(angle)])
    path = np.vstack([[[0.005, 0.0, -0.06]], bend])
    ring = np.linspace(0.0, 2 * np.pi, 16, endpoint=False)
    polygon = np.column_stack([np.cos(ring), np.sin(ring)])
    shapely = pytest.importorskip("shapely.geometry")
    return trimesh.creation.sweep_polygon(shapely.Polygon(0.008 * polygon), path)


def test_sides_follow_the_winding_number():
    """Inside is where the surface winds around: by the direct sum over all triangles, also where normals mislead."""
    mesh = folded_tube()
    points = np.random.default_rng(0).uniform(mesh.bounds[0] - 0.01, mesh.bounds[1] + 0.01, (2000, 3))
    vertices, faces = np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64)
    inside = igl.winding_number(vertices, faces, points) > 0.5
    kind = igl.SignedDistanceType.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
    misled = (igl.signed_distance(points, vertices, faces, sign_type=kind)[0] < 0.0) != inside
    assert misled.mean() > 0.001
    np.testing.assert_array_equal(Triangles.of(mesh).signed_distance(points) < 0.0, inside)


def test_sides_of_many_points_take_few_winding_numbers(monkeypatch):
    """Points that a ball without surface joins have one winding number; none of them is on another side for it."""
    mesh = folded_tube()
    points = np.random.default_rng(1).uniform(mesh.bounds[0] - 0.02, mesh.bounds[1] + 0.02, (20000, 3))
    inside, asked = Triangles.of(mesh).winding_number(points) > 0.5, []
    whole = Triangles.winding_number
    monkeypatch.setattr(Triangles, "winding_number", lambda own, p: asked.append(len(p)) or whole(own, p))
    np.testing.assert_array_equal(Triangles.of(mesh).signed_distance(points) < 0.0, inside)
    assert sum(asked) < 10000


def test_nearest_points_of_a_box():
    """Face, edge and inside: distance, nearest point and outward normal by hand."""
    mesh = trimesh.creation.box((0.04, 0.06, 0.08))
    found = Triangles.of(mesh).nearest(
        np.array([[0.03, 0.0, 0.01], [0.023, 0.034, 0.0], [0.018, 0.0, 0.0], [0.02, 0, 0.02]])
    )
    np.testing.assert_allclose(found.distance, [0.01, 0.005, -0.002, 0.0], atol=1e-12)
    np.testing.assert_allclose(
        found.points, [[0.02, 0, 0.01], [0.02, 0.03, 0], [0.02, 0, 0], [0.02, 0, 0.02]], atol=1e-12
    )
    np.testing.assert_allclose(found.normals, [[1, 0, 0], [0.6, 0.8, 0], [1, 0, 0], [1, 0, 0]], atol=1e-9)


def test_normals_under_a_footprint():
    """An edge of a box counts within the radius only; the far side of a thin plate does not count."""
    mesh = trimesh.creation.box((0.04, 0.06, 0.08))
    points = np.array([[0.02, 0.0, 0.0], [0.02, 0.0288, 0.0], [0.02, 0.0292, 0.0]])
    np.testing.assert_allclose(normal_spread(Triangles.of(mesh), points, 1e-3), [0.0, 0.0, np.pi / 2], atol=1e-6)
    plate = trimesh.creation.box((0.06, 0.06, 0.0005)).subdivide().subdivide().subdivide().subdivide()
    assert normal_spread(Triangles.of(plate), np.array([[0.001, 0.002, 0.00025]]), 1e-3)[0] < 1e-6
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.02)
    assert 0.0 < normal_spread(Triangles.of(ball), ball.triangles_center[:1], 1e-3)[0] < 2 * 3e-3 / 0.02


@pytest.mark.parametrize("turned", [False, True])
def test_triangles_inside_are_no_edges(turned):
    """A tetrahedron inside a box that hangs on a corner of its top is met by no finger; cut out of it, it is a hole."""
    box = trimesh.creation.box((0.04, 0.04, 0.04)).subdivide()
    middle = np.array([0.0, 0.0, 0.02])
    low = np.array([[-0.004, -0.004, 0.01], [0.004, -0.004, 0.01], [0.0, 0.005, 0.01]])
    inner = trimesh.convex.convex_hull(np.vstack([middle, low]))
    if turned:
        inner.invert()
    solid = trimesh.Trimesh(
        np.vstack([box.vertices, inner.vertices]), np.vstack([box.faces, inner.faces + len(box.vertices)])
    )
    assert len(solid.vertices) == len(box.vertices) + 3
    spread = normal_spread(Triangles.of(solid), np.array([middle, [0.02, 0.0, 0.02]]), FOOTPRINT)
    assert (spread[0] > 1.0) == turned
    assert spread[1] == pytest.approx(np.pi / 2)


def test_slivers_have_no_normal():
    """Three corners in a line, but for rounding, have none; triangles as small as dust have theirs."""
    turn = trimesh.transformations.euler_matrix(0.7, 0.6, 0.5)[:3, :3]
    ends = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.003, 0.0, 0.0], [0.0, 1e-7, 0.0], [1e-7, 0.0, 0.0]]) @ turn.T
    triangles = Triangles(ends, np.array([[0, 1, 2], [0, 4, 3]]))
    np.testing.assert_allclose(triangles.normals, [np.zeros(3), turn[:, 2]], atol=1e-6)
    np.testing.assert_allclose(triangles.areas, [0.0, 0.5e-14], atol=1e-18)


def test_what_is_far_under_a_slope_is_not_near():
    """Triangles of a box that stands on a corner reach far into each other's bounding boxes, and count no farther."""
    box = trimesh.creation.box((0.04, 0.04, 0.04))
    box.apply_transform(trimesh.transformations.euler_matrix(0.7, 0.6, 0.5))
    points = box.triangles.mean(axis=1)
    np.testing.assert_allclose(normal_spread(Triangles.of(box), points, FOOTPRINT), 0.0, atol=1e-6)


def test_points_do_not_join_each_other_s_patches():
    """At the rim of a thin plate both sides hang together, in its middle they do not, asked for at once or not."""
    plate = Triangles.of(trimesh.creation.box((0.04, 0.04, 0.0005)))
    points = np.array([[0.0, 0.001, 0.00025], [0.02, 0.001, 0.0], [0.0, 0.001, -0.00025]])
    np.testing.assert_allclose(normal_spread(plate, points, FOOTPRINT), [0.0, np.pi, 0.0], atol=1e-6)


def test_folds_in_the_plane_of_the_surface_are_no_edges():
    """A triangle there and back and there again is one."""
    box = trimesh.creation.box((0.04, 0.04, 0.04))
    top = np.flatnonzero(box.face_normals[:, 2] > 0.9)
    faces = np.vstack([box.faces, box.faces[top][:, ::-1], box.faces[top]])
    solid = trimesh.Trimesh(box.vertices, faces, process=False)
    assert normal_spread(Triangles.of(solid), np.array([[0.004, 0.001, 0.02]]), FOOTPRINT)[0] == pytest.approx(
        0.0, abs=1e-6
    )


def test_normals_under_a_footprint_of_closed_forms():
    """On the middle of a face none; on a rounded edge 45° to both sides; near it what reaches into the rounding."""
    box = gp.Box(x=0.04, y=0.06, z=0.08, edge=0.001)
    across = 0.001 / np.sqrt(2)
    points = np.array([[0.02, 0.0, 0.0], [0.019 + across, 0.029 + across, 0.0], [0.02, 0.0285, 0.0]])
    np.testing.assert_allclose(box.normal_spread(points, 1e-3), [0.0, np.pi / 2, np.arctan(0.5)], atol=0.05)
    assert np.isnan(box.normal_spread(np.full((1, 3), np.nan), 1e-3)).all()
    assert gp.Sphere(0.02).normal_spread(np.array([[0.02, 0.0, 0.0]]), 1e-3)[0] == 0.0


def sharp_meshes():
    """Ten plates from 0.5 to 5 mm, ten prisms and cones, and ten random polyhedra."""
    rng = np.random.default_rng(1)
    for k in range(10):
        yield trimesh.creation.box((0.08, 0.06, 0.0005 * (k + 1)))
        yield trimesh.convex.convex_hull(rng.uniform(-0.035, 0.035, (8, 3)))
        solid = trimesh.creation.cone if k % 2 else trimesh.creation.cylinder
        yield solid(radius=0.008 + 0.002 * k, height=0.06, sections=4 + k)


@pytest.mark.slow
def test_the_stated_error_is_no_less_than_the_measured_one():
    """On, beside and up to 12 mm around sharp edges, with three times as many samples as the grid's own, and others."""
    rng = np.random.default_rng(2)
    for mesh in sharp_meshes():
        grid = build_distance_grid(mesh, 1e-3)
        ends = mesh.vertices[mesh.face_adjacency_edges[mesh.face_adjacency_angles > 0.3]]
        edges = ends[rng.integers(len(ends), size=12000)]
        share = rng.uniform(size=(12000, 1))
        on = share * edges[:, 0] + (1 - share) * edges[:, 1]
        beside = Triangles.of(mesh).nearest(on + rng.uniform(-1.5e-3, 1.5e-3, on.shape)).points
        points = np.vstack([on, beside, on + rng.uniform(-0.007, 0.007, on.shape)])
        exact = Triangles.of(mesh).signed_distance(points)
        counts = exact > -1e-9
        assert np.abs(grid.sample(points[counts]).distance - exact[counts]).max() <= grid.error, mesh.extents


def test_the_stated_error_counts_corners():
    """Beside the corners of a large box the smooth distance is worst, and few random points come near."""
    mesh = trimesh.creation.box((0.11, 0.15, 0.028))
    grid = build_distance_grid(mesh, 1e-3)
    depth = np.random.default_rng(5).uniform(0.0, 1e-3, (2000, 2))
    beside = np.column_stack([np.full(2000, 0.055), 0.075 - depth[:, 0], 0.014 - depth[:, 1]])
    assert grid.error >= np.abs(grid.sample(beside).distance).max() > 1.6e-4


@pytest.fixture(scope="module")
def bracket_problem(mesh_texts):
    return gp.GraspProblem(gp.load_hand("allegro_right"), gp.parse_object(mesh_texts["bracket"]))


def test_edge_distance_is_asked_for_where_there_are_edges(bracket_problem):
    """Meshes of a default problem have it; closed forms and the paper's problem do not."""
    term = EdgeDistance()
    assert term.wanted(bracket_problem)
    assert not term.wanted(replace(bracket_problem, grasp_object=gp.Box(edge=0.003)))
    assert term.wanted(replace(bracket_problem, grasp_object=gp.Box()))
    assert term.wanted(replace(bracket_problem, grasp_object=gp.Cylinder(caps=1, edge=0.001)))
    assert not term.wanted(replace(bracket_problem, grasp_object=gp.Cylinder(edge=0.001)))
    assert not term.wanted(gp.GraspProblem.paper(bracket_problem.hand, bracket_problem.grasp_object))


@pytest.mark.parametrize("name", ["torus", "bracket", "box"])
def test_edge_distance_derivatives(mesh_texts, name):
    """The Jacobian belongs to the residual."""
    text = mesh_texts.get(name, "box:x=0.05,y=0.06,z=0.07,edge=0.001")
    problem = gp.GraspProblem(gp.load_hand("dlr_hit_ii_right"), gp.parse_object(text))
    rng, term = np.random.default_rng(4), EdgeDistance()
    start = gp.random_start(problem, rng)
    program = GraspProgram(problem, start.palm_pose)
    z = program.pack(start.joint_angles, start.palm_pose, start.delta_sigma)

    def residual(v):
        return term.residual(problem, program.evaluator.evaluate(v * program.scale))

    state = program.evaluator.evaluate(z * program.scale)
    analytic = term.jacobian(problem, state) * program.scale
    assert analytic.shape == (3 * len(problem.frames), z.size)
    numeric = central_differences(residual, z, 1e-7)
    np.testing.assert_allclose(analytic, numeric, atol=1e-5 * np.abs(numeric).max())


def test_the_search_sees_every_edge_that_the_judge_sees(tmp_path):
    """On and beside an edge of 45°, also in its very middle, where the normal leans half as far from both faces."""
    half = np.radians(22.5)
    x, y = 0.03 * np.cos(half), -0.03 * np.sin(half)
    outline = [(0.0, 0.0), (x, y), (-x, y), (x, -0.04), (-x, -0.04)]
    hull = trimesh.convex.convex_hull([[*point, z] for point in outline for z in (-0.03, 0.03)])
    hull.export(tmp_path / "wedge.stl")
    wedge = gp.MeshObject.load(tmp_path / "wedge.stl")
    rng = np.random.default_rng(0)
    points = wedge.file_origin + rng.uniform(-0.002, 0.002, (200, 3)) * [1.0, 1.0, 5.0]
    for _ in range(5):
        found = wedge.field(points)
        points = points - found.distance[:, None] * found.gradient
    normals = -found.gradient / np.linalg.norm(found.gradient, axis=1)[:, None]
    judged = wedge.normal_spread(wedge.nearest(points).points, FOOTPRINT) > SPREAD
    assert 20 < judged.sum() < 180
    assert (edge_reserve(wedge, points, normals).min(axis=-1) < 0.0)[judged].all()


def test_edge_distance_of_many_states(bracket_problem):
    """The rows of a batch are the term's, value and derivatives."""
    term = EdgeDistance()
    starts, states = random_states(bracket_problem, np.random.default_rng(5), 3)
    (rows,) = BatchedProblem(bracket_problem)._edge(BatchedProblem(bracket_problem).contacts(states))
    for row, start in enumerate(starts):
        state, turn = in_palm(bracket_problem, start)
        np.testing.assert_allclose(rows.value[row], term.residual(bracket_problem, state), atol=1e-10)
        slope = term.jacobian(bracket_problem, state) @ turn
        np.testing.assert_allclose(rows.derivative[row], slope, atol=1e-10 * np.abs(slope).max())


def test_the_judge_looks_at_the_triangles(bracket_problem):
    """A distance that is wrong by 1 mm deceives the search, not the judge."""
    solid = bracket_problem.grasp_object.loaded
    swollen = replace(solid, grid=type(solid.grid)(solid.grid.axes, solid.grid.coefficients - 1e-3, solid.grid.error))
    problem = replace(bracket_problem, grasp_object=replace(bracket_problem.grasp_object, loaded=swollen))
    start = gp.random_start(problem, np.random.default_rng(0))
    grasp = gp.Grasp(problem, start.joint_angles, Pose.of(start.palm_pose), start.delta_sigma)
    np.testing.assert_allclose(grasp.surface_contacts.gaps - grasp.contacts.gaps, 1e-3, atol=5e-4)
    assert grasp.contacts.gaps.max() > -grasp.contacts.gaps.min()
    assert grasp.violations["surface"].value > grasp.contacts.gaps.max() + 5e-4


def test_a_contact_on_an_edge_is_a_violation(bracket_problem):
    """On the middle of a face there is none; within a footprint of a square edge, 90° less the 40° allowed."""
    corner = bracket_problem.grasp_object.loaded.bounds[0]
    for inset, expected in ((0.01, 0.0), (0.0005, np.radians(50.0))):
        point = np.array([corner[0], corner[1] + inset, corner[2] + 0.01])
        contacts = Contacts(point[None], np.array([[1.0, 0.0, 0.0]]), np.zeros(1))
        grasp = SimpleNamespace(problem=bracket_problem, surface_contacts=contacts)
        assert EdgeDistance().violation(grasp) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("edge", "words"), [(0.001, "on an edge: thumb 90°"), (0.004, "on an edge rounded by 4 mm: thumb")]
)
def test_the_verdict_names_who_is_on_which_edge(bracket_problem, edge, words):
    """One fingertip on the middle of an edge, the others on the middle of a face."""
    box = gp.Box(0.04, 0.06, 0.08, edge=edge)
    slope = np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0])
    points = np.tile([0.02, 0.0, 0.0], (len(bracket_problem.frames), 1))
    normals = np.tile([-1.0, 0.0, 0.0], (len(points), 1))
    thumb = [frame.name for frame in bracket_problem.frames].index("thumb")
    points[thumb], normals[thumb] = [0.02 - edge, 0.03 - edge, 0.0] + edge * slope, -slope
    problem = replace(bracket_problem, grasp_object=box)
    grasp = SimpleNamespace(problem=problem, surface_contacts=Contacts(points, normals, np.zeros(len(points))))
    assert on_edges(grasp) == words
    grasp.problem = replace(bracket_problem, grasp_object=gp.Sphere())
    assert on_edges(grasp) == ""


def test_forces_have_to_stay_in_the_cones_of_the_triangles(bracket_problem):
    """A force that the smooth normal allows and the true one does not is a violation by what it leaves the cone."""
    forces, friction = np.array([[1.0, 0.0, 0.0]]), bracket_problem.parameters.friction
    tilted = np.array([[np.cos(1.0), np.sin(1.0), 0.0]])
    grasp = SimpleNamespace(
        problem=bracket_problem,
        forces=forces,
        friction_margins=np.array([friction]),
        surface_contacts=Contacts(np.zeros((1, 3)), tilted, np.zeros(1)),
    )
    assert FrictionCone().violation(grasp) == pytest.approx(np.sin(1.0) - friction * np.cos(1.0))
    grasp.problem = gp.GraspProblem.paper(bracket_problem.hand, bracket_problem.grasp_object)
    assert FrictionCone().violation(grasp) == 0.0


def test_the_search_keeps_off_the_cone_what_a_true_normal_may_take(bracket_problem, right):
    """A force at the edge of the narrowed cone stays in the cone about any normal within the stated error."""
    reserve = cone_reserve(bracket_problem)
    plain = replace(bracket_problem, clearance=gp.ClearanceOptions.off())
    assert (cone_reserve(plain) == 0.0).all()
    assert (cone_reserve(gp.GraspProblem(right, gp.Sphere(radius=0.035))) == 0.0).all()
    for mu, less in zip(bracket_problem.friction, reserve, strict=True):
        force = np.array([mu - less, 0.0, 1.0])
        turned = np.array([-np.sin(NORMAL_ERROR), 0.0, np.cos(NORMAL_ERROR)])
        along = force @ turned
        assert mu * along - np.linalg.norm(force - along * turned) >= -1e-4 * NORMAL_ERROR
        assert less < 2.0 * NORMAL_ERROR * (1.0 + mu**2)
