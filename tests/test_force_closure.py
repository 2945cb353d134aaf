"""The force floor and force closure, on cases with known answers."""

import math

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.model.contact_model import HardFinger, SoftFinger
from grasp_planner.model.force_closure import force_closure_margin, shows_force_closure

WEIGHT = np.array([0.0, 0.0, -1.962, 0.0, 0.0, 0.0])


def ring(n, radius=0.03, height=0.0):
    """Return n contacts around a cylinder, at equal angles."""
    angles = 2 * np.pi * np.arange(n) / n
    outward = np.stack([np.cos(angles), np.sin(angles), np.zeros(n)], axis=1)
    return radius * outward + [0, 0, height], -outward


@pytest.mark.parametrize("n", [3, 4, 5])
@pytest.mark.parametrize("friction", [0.4, 0.8])
def test_a_ring_of_fingers_needs_weight_over_friction_root_n(n, friction):
    """Each of n fingers presses with w/(n μ), so F = √n w/(n μ)."""
    points, normals = ring(n)
    floor = gp.model.force_norm_floor(points, normals, friction, WEIGHT)
    assert floor == pytest.approx(1.962 / (friction * math.sqrt(n)), rel=1e-6)


def test_thumb_against_four_fingers():
    """The thumb presses as much as the four together: F = (w/2μ) √(1 + 1/4), the 1.37 N of the paper's cylinder."""
    offsets = np.array([-0.03, -0.01, 0.01, 0.03])
    points = np.vstack([[0.03, 0, 0], np.column_stack([np.full(4, -0.03), np.zeros(4), offsets])])
    normals = np.array([[-1.0, 0, 0]] + [[1.0, 0, 0]] * 4)
    expected = 1.962 / (2 * 0.8) * math.sqrt(1.25)
    assert gp.model.force_norm_floor(points, normals, 0.8, WEIGHT) == pytest.approx(expected, rel=1e-5)


def test_no_forces_from_one_side_hold_the_object():
    points = np.array([[-0.03, 0, 0], [-0.03, 0.01, 0], [-0.03, 0, 0.01]])
    normals = np.tile([1.0, 0, 0], (3, 1))
    assert gp.model.force_norm_floor(points, normals, 0.8, WEIGHT) == math.inf
    assert not gp.model.force_closure_margin(points, normals, 0.8) > 0.0


def test_a_ring_is_force_closed_and_can_press_straight_inwards():
    points, normals = ring(3)
    assert gp.model.force_closure_margin(points, normals, 0.8) == pytest.approx(0.8, abs=1e-6)


def test_two_contacts_are_not_force_closed():
    points, normals = ring(2)
    assert gp.model.force_closure_margin(points, normals, 0.8) == -math.inf


def test_without_enough_friction_a_wedge_is_not_closed():
    """Two opposing faces leaning 40° out of parallel hold only if the cones see each other: μ > tan 40°."""
    lean = math.radians(40.0)
    inward = np.array([[-math.cos(lean), 0, math.sin(lean)], [math.cos(lean), 0, math.sin(lean)]])
    points = np.array([[0.03, 0.01, 0], [0.03, -0.01, 0], [-0.03, 0.01, 0], [-0.03, -0.01, 0]])
    normals = np.repeat(inward, 2, axis=0)
    assert gp.model.force_closure_margin(points, normals, math.tan(lean) * 1.05) > 0.0
    assert not gp.model.force_closure_margin(points, normals, math.tan(lean) * 0.95) > 0.0


def test_closure_does_not_depend_on_units_or_place(rng):
    points, normals = ring(4)
    near = gp.model.force_closure_margin(points, normals, 0.5)
    scaled = gp.model.force_closure_margin(1000 * points, normals, 0.5)
    assert scaled == pytest.approx(near, abs=1e-6)


def test_friction_margins_and_force_norm():
    normals = np.array([[1.0, 0, 0], [0, 0, -1.0]])
    forces = np.array([[2.0, 0.6, 0.8], [0.0, 0.3, -1.0]])
    np.testing.assert_allclose(gp.model.normal_forces(forces, normals), [2.0, 1.0])
    np.testing.assert_allclose(gp.model.friction_margins(forces, normals, 0.5), [0.0, 0.2], atol=1e-15)
    assert gp.model.force_norm(forces, normals) == pytest.approx(math.sqrt(5.0))
    assert gp.model.friction_margins(-forces, normals, 0.5).max() < 0.0


@pytest.mark.parametrize("model", [HardFinger(), SoftFinger(0.005)])
def test_forces_show_force_closure_only_where_there_is_one(model, rng):
    """Of random contacts on a ball: what forces show the cone program finds too, and any forces show most of it."""
    shown = closed = 0
    for _ in range(150):
        normals = rng.normal(size=(4, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        friction, points = rng.uniform(0.2, 1.0), -0.03 * normals + rng.normal(0.0, 0.005, (4, 3))
        forces = rng.uniform(0.0, 2.0, (4, 1)) * model.covectors(normals) + rng.normal(0.0, 0.1, (4, model.dimension))
        margin = force_closure_margin(points, normals, friction, model)
        if shows_force_closure(points, normals, friction, forces, model):
            assert margin > 0.0
            shown += 1
        closed += margin > 0.0
    assert 0.5 * closed < shown < closed
    points, normals = ring(5)
    assert shows_force_closure(points, normals, 0.5, normals + rng.normal(0.0, 0.02, normals.shape))
    assert not shows_force_closure(points, normals, 0.5, np.full_like(normals, np.nan))
    assert not shows_force_closure(points[:, [0, 0, 0]], normals, 0.5, 0.0 * normals)


def test_forces_at_contacts_in_one_line_show_nothing():
    """They may balance inside their cones, yet nothing resists a turn about the line."""
    points = np.array([[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0], [0.01, 0.0, 0.0]])
    normals = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    forces = normals * np.array([[1.0], [2.0], [1.0]])
    assert not shows_force_closure(points, normals, 0.5, forces)
    assert force_closure_margin(points, normals, 0.5) == -math.inf
    assert not shows_force_closure(points, normals, 0.5, np.full_like(normals, np.inf))
