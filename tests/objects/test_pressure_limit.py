"""The pressure that an object bears: Hertz's numbers, and a plan that keeps the limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import grasp_planner as gp
from grasp_planner.objects.pressure_limit import PressureLimit


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    found = tmp_path_factory.mktemp("soft") / "bar.stl"
    trimesh.creation.cylinder(0.028, 0.12, sections=48).export(found)
    return found


def test_pressure_of_a_ball_on_a_plane():
    """Force and depth of the same contact are a sum of pressures: ∫ p dA = f_n with p = p₀ √(1 − (r/a)²)."""
    limit, force, radius = PressureLimit(2e4, 1e5), 0.7, 0.01
    patch = np.cbrt(3 * force * radius / (4 * limit.modulus))
    r = np.linspace(0.0, patch, 20001)
    p = limit.pressure(force, radius) * np.sqrt(1 - np.minimum(r / patch, 1.0) ** 2)
    assert np.trapezoid(2 * np.pi * r * p, r) == pytest.approx(force, rel=1e-5)


@pytest.mark.parametrize("curvature_radius", [np.inf, 0.03, 0.004])
def test_the_force_that_reaches_the_limit(curvature_radius):
    """It is the one whose pressure is the limit; the rounder the surface, the less."""
    limit = PressureLimit(2e4, 1e5, curvature_radius)
    for radius in (0.005, 0.012):
        force = limit.largest_force(radius)
        assert limit.pressure(force, radius) == pytest.approx(2e4)
        assert force <= PressureLimit(2e4, 1e5).largest_force(radius)
    assert limit.largest_force(0.0) == 0.0


def test_balls_and_fingertips_may_change_roles():
    """Only the relative radius counts."""
    assert PressureLimit(1.0, 1.0, 0.02).pressure(1.0, 0.01) == pytest.approx(
        PressureLimit(1.0, 1.0, 0.01).pressure(1.0, 0.02)
    )


def test_the_object_limits_the_force_of_its_contacts(path):
    """The smallest fingertip counts; a size enlarges the radius of curvature too."""
    hand = gp.load_hand("dlr_hit_ii_right")
    soft = gp.MeshObject.load(path, resolution=0.004, max_pressure=1e5, modulus=3e5, curvature_radius=0.028)
    problem = gp.GraspProblem(hand, soft, contact_set="sphere")
    limit = PressureLimit(1e5, 3e5, 0.028)
    assert problem.max_normal_force == pytest.approx(limit.largest_force(problem.radii.min()))
    assert soft.resized(2.0).pressure_limit == PressureLimit(1e5, 3e5, 0.056)
    assert gp.parse_object(soft.resized(2.0).text) == soft.resized(2.0)
    assert soft != gp.MeshObject.load(path, resolution=0.004)


def test_points_press_with_no_bearable_force(path):
    """Under a point every pressure is infinite."""
    soft = gp.MeshObject.load(path, resolution=0.004, max_pressure=1e5, modulus=3e5)
    with pytest.raises(gp.InvalidValueError, match="the object") as raised:
        gp.GraspProblem(gp.load_hand("dlr_hit_ii_right"), soft, contact_set="point")
    assert len(str(raised.value)) < 200


@pytest.mark.slow
def test_a_plan_keeps_the_pressure(path):
    """In its worst load case too, and the judge sees by the formula itself where one does not."""
    hand, options = gp.load_hand("dlr_hit_ii_right"), gp.PlannerOptions(enough=1)

    def problem(**soft):
        return gp.GraspProblem(hand, gp.MeshObject.load(path, mass=0.1, **soft), contact_set="sphere")

    free = gp.plan_grasp(problem(), options=options)
    radius = float(free.problem.radii.min())
    most = PressureLimit(1.0, 1e6).pressure(0.9 * free.load_check.largest_normal, radius)
    soft = problem(max_pressure=most, modulus=1e6)
    assert free.feasible
    assert replace(free, problem=soft).violations["load_max_normal"].value > 0.0
    grasp = gp.plan_grasp(soft, options=options)
    assert grasp.feasible
    assert PressureLimit(1.0, 1e6).pressure(grasp.load_check.largest_normal, radius) <= most * (1 + 1e-5)
    for each in (grasp, free):  # of one grasp, the limit can only take away
        bound, unbound = (replace(each, problem=with_it).margins.passive.size for with_it in (soft, free.problem))
        assert bound <= unbound * (1 + 1e-9)
