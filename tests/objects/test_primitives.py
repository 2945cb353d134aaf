"""Objects: signed distances against finite differences and geometry, text forms, and masses."""

from __future__ import annotations

import coal
import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.objects import SHAPES

from .helpers import central_differences, surface_points

PRIMITIVES = {
    "sphere": gp.Sphere(radius=0.03),
    "cylinder": gp.Cylinder(radius=0.03, height=0.12),
    "capped": gp.Cylinder(radius=0.03, height=0.12, caps=1, edge=0.004),
    "box": gp.Box(x=0.05, y=0.06, z=0.08, edge=0.006),
    "capsule": gp.Capsule(radius=0.025, height=0.07),
    "ellipsoid": gp.EllipsoidObject(x=0.025, y=0.035, z=0.05),
    "disc": gp.EllipsoidObject(x=0.04, y=0.04, z=0.012),
}


@pytest.fixture(params=PRIMITIVES)
def primitive(request):
    return PRIMITIVES[request.param]


def points_around(grasp_object, count=40, seed=1):
    """Points up to 8 mm inside and 30 mm outside of the surface, off its creases."""
    rng = np.random.default_rng(seed)
    points = surface_points(grasp_object, count, seed)
    normals = grasp_object.sample(points).gradient
    return points + rng.uniform(-0.008, 0.03, (count, 1)) * normals + rng.normal(0.0, 1e-4, (count, 3))


def test_derivatives_agree_with_finite_differences(primitive):
    """∇φ is the derivative of φ, and ∇²φ that of ∇φ."""
    for point in points_around(primitive):
        sample = primitive.sample(point[None])
        gradient = central_differences(lambda p: primitive.sample(p[None]).distance[0], point, 1e-6)
        hessian = central_differences(lambda p: primitive.sample(p[None]).gradient[0], point, 1e-6)
        np.testing.assert_allclose(sample.gradient[0], gradient, atol=1e-8)
        np.testing.assert_allclose(sample.hessian[0], hessian, atol=1e-6 * (1.0 + abs(hessian).max()))


def test_distance_is_the_distance(primitive):
    """|∇φ| = 1, and a step of −φ∇φ ends on the surface: φ is a true signed distance, not just a level set."""
    points = points_around(primitive)
    sample = primitive.sample(points)
    np.testing.assert_allclose(np.linalg.norm(sample.gradient, axis=1), 1.0, atol=1e-12)
    foot = points - sample.distance[:, None] * sample.gradient
    np.testing.assert_allclose(primitive.sample(foot).distance, 0.0, atol=1e-9)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", sample.hessian, sample.gradient), 0.0, atol=1e-6)


def test_field_takes_points_of_any_arrangement(primitive):
    """Distances, gradients and Hessians of a block of points are those of its points, one by one."""
    points = points_around(primitive, 24).reshape(2, 3, 4, 3)
    found = primitive.field(points)
    for index in np.ndindex(2, 3, 4):
        alone = primitive.sample(points[index][None])
        np.testing.assert_allclose(found.distance[index], alone.distance[0], atol=1e-15)
        np.testing.assert_allclose(found.gradient[index], alone.gradient[0], atol=1e-15)
        np.testing.assert_allclose(found.hessian[index], alone.hessian[0], atol=1e-12)
    np.testing.assert_array_equal(primitive.distances(points), found.distance)
    np.testing.assert_array_equal(primitive.gradients(points), found.gradient)
    np.testing.assert_array_equal(primitive.hessians(points), found.hessian)
    assert primitive.field(np.zeros((0, 5, 3))).hessian.shape == (0, 5, 3, 3)


def test_ellipsoid_against_its_surface():
    """φ is the distance to the closest of many surface points, from the centre of curvature to far away."""
    ellipsoid = gp.EllipsoidObject(x=0.02, y=0.03, z=0.05)
    cloud = surface_points(ellipsoid, 20000)
    cloud /= np.linalg.norm(cloud / ellipsoid.half_extents, axis=1, keepdims=True)
    points = np.random.default_rng(0).uniform(-0.07, 0.07, (50, 3))
    closest = np.linalg.norm(points[:, None] - cloud, axis=2).min(axis=1)
    distance = ellipsoid.sample(points).distance
    assert (np.abs(distance) <= closest + 1e-9).all()
    np.testing.assert_allclose(np.abs(distance), closest, atol=5e-4)
    assert ((distance < 0) == (((points / ellipsoid.half_extents) ** 2).sum(axis=1) < 1)).all()


def test_a_round_ellipsoid_is_a_sphere():
    """With equal axes all of it is the sphere's, the centre aside."""
    points = np.random.default_rng(0).uniform(-0.06, 0.06, (30, 3))
    round_one, sphere = gp.EllipsoidObject(x=0.03, y=0.03, z=0.03).sample(points), gp.Sphere(radius=0.03).sample(points)
    np.testing.assert_allclose(round_one.distance, sphere.distance, atol=1e-12)
    np.testing.assert_allclose(round_one.hessian, sphere.hessian, rtol=1e-9, atol=1e-9)
    assert np.isfinite(gp.EllipsoidObject().sample(np.zeros((1, 3))).distance).all()


def test_meshes_for_pictures_lie_on_the_surface(primitive):
    """The drawn mesh has its vertices at φ = 0 (rounded edges are drawn sharp) and the stated extents."""
    distance = primitive.sample(np.asarray(primitive.mesh.vertices)).distance
    if getattr(primitive, "caps", 1):
        assert np.abs(distance).max() < 1e-9 + getattr(primitive, "edge", 0.0)
    np.testing.assert_allclose(np.abs(primitive.mesh.bounds).max(axis=0), primitive.half_extents, rtol=0.02)


def test_coal_geometry_is_the_solid(primitive):
    """Coal's distance from a small ball to the solid is the signed distance, from outside."""
    solid = primitive.solid
    points = points_around(solid, 15)
    points = points[solid.sample(points).distance > 0.004]
    request, ball = coal.DistanceRequest(), coal.Sphere(0.001)
    request.gjk_tolerance = request.epa_tolerance = 1e-12
    for point in points:
        placement = coal.Transform3s(np.eye(3), point)
        distance = coal.distance(
            ball, placement, solid.coal_geometry(), coal.Transform3s(), request, coal.DistanceResult()
        )
        assert distance + 0.001 == pytest.approx(solid.sample(point[None]).distance[0], abs=2e-6)


def test_inertia_of_a_sphere():
    """2/5 m r², within the facets of its mesh."""
    np.testing.assert_allclose(
        gp.Sphere(radius=0.05, mass=0.3).inertia, 0.4 * 0.3 * 0.05**2 * np.eye(3), rtol=0.02, atol=1e-9
    )


def test_text_forms_are_read_back(primitive):
    assert gp.parse_object(primitive.text) == primitive


@pytest.mark.parametrize("kind", sorted(set(SHAPES) - {"mesh"}))
def test_defaults_parse(kind):
    assert gp.parse_object(kind).text.startswith(f"{kind}:")


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("capsul:radius=0.1", "did you mean 'capsule'"),
        ("capsule:radius=-1", "radius"),
        ("ellipsoid:x=nan", "x"),
        ("ellipsoid:a=0.1", "existing: x, y, z, mass"),
        ("sphere:radius=0.1,radius=0.2", "given once"),
        ("sphere:0.1", "key=value"),
        ("mesh", "mesh:FILE"),
        ("mesh:scale=2", "mesh:FILE"),
        ("mesh:no_such.stl", "No such file"),
        ("mesh:passwd", "suffix"),
        ("mesh:a.stl,repair=2", "0 or 1"),
        ("mesh:a.stl,mass=1,density=2", "one of the two"),
        ("mesh:a.stl,scale=0", "scale"),
        ("mesh:a\0.stl", "file name"),
        ("mesh:a=b.stl", "file name without equals sign"),
    ],
)
def test_bad_texts_are_refused(text, part):
    with pytest.raises(gp.GraspPlannerError, match=part):
        gp.parse_object(text)
