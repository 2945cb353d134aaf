"""Task directions, transmission ratios and ellipsoids on cases that can be checked by hand."""

import math

import numpy as np
import pytest

import grasp_planner as gp

DIAGONAL = np.diag([0.5, 0.25, 0.2, 2.0, 1.0, 4.0])


@pytest.mark.parametrize("axis", range(6))
def test_ratios_of_a_diagonal_map_are_its_entries(axis):
    """With H_s = diag(h): synergy force h per unit wrench, so α = 1/h; twist h per unit velocity, so β = h."""
    direction = np.eye(6)[axis]
    assert gp.model.force_transmission_ratio(DIAGONAL, direction) == pytest.approx(1.0 / DIAGONAL[axis, axis])
    assert gp.model.velocity_transmission_ratio(DIAGONAL, direction) == pytest.approx(DIAGONAL[axis, axis])


def test_force_and_velocity_ratios_are_dual():
    """What the hand transmits well as force it transmits badly as motion: α β = 1 along an axis."""
    direction = np.eye(6)[2]
    product = gp.model.force_transmission_ratio(DIAGONAL, direction) * gp.model.velocity_transmission_ratio(
        DIAGONAL, direction
    )
    assert product == pytest.approx(1.0)


def test_force_ratio_is_infinite_where_the_structure_resists():
    assert gp.model.force_transmission_ratio(np.zeros((6, 2)), np.eye(6)[0]) == math.inf


def test_velocity_ratio_needs_six_synergies(rng):
    with pytest.raises(gp.InvalidValueError, match="at least 6") as caught:
        gp.model.velocity_transmission_ratio(rng.normal(size=(6, 3)), np.eye(6)[0])
    assert caught.value.field == "n_synergies"


def test_restricted_velocity_ratio_exists_in_the_range_only():
    h_s = np.zeros((6, 1))
    h_s[1, 0] = 0.3
    assert gp.model.restricted_velocity_ratio(h_s, np.eye(6)[1]) == pytest.approx(0.3)
    assert gp.model.restricted_velocity_ratio(h_s, np.eye(6)[0]) == 0.0


def test_restricted_and_full_velocity_ratio_agree_at_full_rank(rng):
    h_s, direction = rng.normal(size=(6, 8)), np.eye(6)[1]
    full = gp.model.velocity_transmission_ratio(h_s, direction)
    assert gp.model.restricted_velocity_ratio(h_s, direction) == pytest.approx(full)


def test_object_synergy_map_moves_the_object_with_rigid_contacts(rng):
    """If the contacts move as one body, H_s returns that body's twist."""
    points, twist = rng.normal(0, 0.03, (4, 3)), rng.normal(size=6)
    grasp = gp.model.grasp_matrix(points)
    np.testing.assert_allclose(gp.model.object_synergy_map(grasp, (grasp.T @ twist)[:, None])[:, 0], twist, atol=1e-10)


def test_task_index_sums_weighted_inverse_squares():
    tasks = [gp.force_task([0, 1, 0], 2.0), gp.twist_task([1, 0, 0, 0, 0, 0], 3.0), gp.torque_task([0, 0, 1])]
    expected = 2.0 * 0.25**2 + 3.0 / 0.5**2 + 4.0**2
    assert gp.model.task_index(DIAGONAL, tasks) == pytest.approx(expected)


def test_force_ellipsoid_is_longest_where_little_synergy_force_is_needed():
    ellipsoid = gp.model.transmission_ellipsoid(DIAGONAL, "force")
    np.testing.assert_allclose(ellipsoid.lengths, [1 / 0.2, 1 / 0.25, 1 / 0.5])
    np.testing.assert_allclose(np.abs(ellipsoid.axes[:, 0]), [0, 0, 1])
    assert not ellipsoid.degenerate
    assert gp.model.alignment_deg(DIAGONAL, gp.force_task([0, 0, -1])) == (pytest.approx(0.0), False)
    assert gp.model.alignment_deg(DIAGONAL, gp.force_task([0, 1, 1]))[0] == pytest.approx(45.0)


def test_velocity_ellipsoid_is_longest_where_motion_is_easy():
    ellipsoid = gp.model.transmission_ellipsoid(DIAGONAL, "twist")
    np.testing.assert_allclose(ellipsoid.lengths, [0.5, 0.25, 0.2])


@pytest.mark.parametrize(("n_s", "dimension"), [(1, 2), (2, 1)])
def test_few_synergies_make_the_ellipsoid_degenerate(n_s, dimension, rng):
    """Rank n_s < 3: unbounded along 3 − n_s directions, and the angle is to that whole space."""
    h_s = rng.normal(size=(6, n_s))
    ellipsoid = gp.model.transmission_ellipsoid(h_s, "force")
    assert ellipsoid.degenerate
    assert ellipsoid.major_dimension == dimension
    free = np.linalg.svd(h_s[:3].T)[2][-1]
    assert ellipsoid.angle_deg(free) == pytest.approx(0.0, abs=1e-6)
    assert gp.model.force_transmission_ratio(h_s, np.concatenate([free, np.zeros(3)])) > 1e12


@pytest.mark.parametrize(
    ("text", "kind", "direction", "weight"),
    [
        ("force:+y", "force", [0, 1, 0, 0, 0, 0], 1.0),
        ("force:-x*0.5", "force", [-1, 0, 0, 0, 0, 0], 0.5),
        ("torque:0,0,2", "torque", [0, 0, 0, 0, 0, 1], 1.0),
        ("twist:z", "twist", [0, 0, 1, 0, 0, 0], 1.0),
        ("twist:-ry*2", "twist", [0, 0, 0, 0, -1, 0], 2.0),
        ("twist:0,3,0,4,0,0", "twist", [0, 0.6, 0, 0.8, 0, 0], 1.0),
    ],
)
def test_task_texts(text, kind, direction, weight):
    task = gp.parse_task(text)
    assert (task.kind, task.weight) == (kind, weight)
    np.testing.assert_allclose(task.direction, direction, atol=1e-15)
    again = gp.parse_task(task.text)
    np.testing.assert_allclose(again.direction, task.direction, atol=1e-11)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "push:+y",
        "force",
        "force:",
        "force:w",
        "force:0,0,0",
        "force:1,2",
        "force:nan,0,0",
        "force:+y*0",
        "force:+y*-1",
        "force:+-y",
        "twist:1,2,3,4",
        "force:+rx",
        "force:1,2,3,4,5,6",
        "force:+y*x",
    ],
)
def test_malformed_tasks_are_refused(text):
    with pytest.raises((gp.InvalidValueError, gp.NameNotFoundError)):
        gp.parse_task(text)


def test_alpha_and_beta_of_many_directions_are_those_of_each(rng):
    directions = rng.normal(size=(40, 6))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for n_s in (1, 3, 6, 9):
        h_s = rng.normal(size=(6, n_s))
        inside = h_s @ rng.normal(size=(n_s, 5))
        many = np.vstack([directions, (inside / np.linalg.norm(inside, axis=0)).T])
        alphas, betas = gp.model.transmission_ratios(h_s, many)
        np.testing.assert_allclose(alphas, [gp.model.force_transmission_ratio(h_s, d) for d in many], rtol=1e-9)
        np.testing.assert_allclose(betas, [gp.model.restricted_velocity_ratio(h_s, d) for d in many], rtol=1e-9)
    blind = np.zeros((6, 2))
    blind[0, 0] = 2.0
    alphas, betas = gp.model.transmission_ratios(blind, np.eye(6)[:2])
    assert alphas.tolist() == [0.5, np.inf]
    assert betas.tolist() == [2.0, 0.0]
