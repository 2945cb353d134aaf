"""Contact models: bases by their definitions, cones, stiffness, closure in cases with known answers, text."""

import math

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.model import Frictionless, HardFinger, SoftFinger, parse_contact_model
from tests.finite_differences import central_differences

MODELS = (HardFinger(), SoftFinger(torsion=0.004), Frictionless())
WEIGHT = 1.962


def unit_normals(rng, n=5):
    normals = rng.normal(size=(n, 3))
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.kind)
def test_grasp_matrix_and_jacobian_are_those_of_forces_and_moments(model, rng):
    """Gλ sums f, c × f + m; Jᵀλ does the work of f along the point and of m about its link."""
    normals, points = unit_normals(rng), rng.normal(size=(5, 3))
    intensities, twists = rng.normal(size=(5, model.dimension)), rng.normal(size=(5, 6, 7))
    forces, moments = model.forces(intensities, normals), model.moments(intensities, normals)
    wrench = model.grasp_matrix(points, normals) @ intensities.ravel()
    expected = np.concatenate([forces.sum(axis=0), (np.cross(points, forces) + moments).sum(axis=0)])
    np.testing.assert_allclose(wrench, expected, atol=1e-12)
    torques = model.hand_jacobian(twists, normals).T @ intensities.ravel()
    work = np.einsum("cij,ci->j", twists, np.hstack([forces, moments]))
    np.testing.assert_allclose(torques, work, atol=1e-12)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.kind)
def test_cones_are_those_of_forces_and_moments(model, rng):
    """The length of what friction has to hold is √(|f_t|² + (m/γ)²), by intensities and by the rows of a program."""
    normals, intensities = unit_normals(rng), rng.normal(size=(5, model.dimension))
    friction = np.array([0.3, 0.5, 0.7, 0.9, 1.1])
    forces, moments = model.forces(intensities, normals), model.moments(intensities, normals)
    along = np.einsum("ij,ij->i", forces, normals)
    across = np.linalg.norm(forces - along[:, None] * normals, axis=1)
    if model.kind == "soft":
        assert np.abs(np.cross(moments, normals)).max() < 1e-12
        across = np.hypot(across, np.linalg.norm(moments, axis=1) / model.torsion)
    covectors = model.covectors(normals)
    np.testing.assert_allclose(gp.model.normal_forces(intensities, covectors), along, atol=1e-12)
    margins = gp.model.friction_margins(intensities, covectors, friction)
    np.testing.assert_allclose(margins, friction * along - across, atol=1e-12)
    rows = model.cone_rows(normals, friction, 5 * model.dimension + 2)
    found = np.array(rows) @ np.append(intensities, [9.0, 9.0])
    np.testing.assert_allclose(found[:, 0] - np.linalg.norm(found[:, 1:], axis=1), margins, atol=1e-12)


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.kind)
def test_slopes_by_the_normal(model, rng):
    """Basis and covector by central differences, for normals of any length."""
    normals = rng.normal(size=(1, 3))
    for value, slope in ((model.basis, model.basis_slope), (model.covectors, model.covector_slope)):
        numeric = central_differences(lambda n, f=value: f(n[None])[0], normals[0], 1e-3)
        np.testing.assert_allclose(slope(normals)[0], numeric, atol=1e-10)


def test_the_hard_finger_is_the_papers_to_the_last_bit(rng):
    normals, points, twists = unit_normals(rng), rng.normal(size=(5, 3)), rng.normal(size=(5, 6, 7))
    model = HardFinger()
    assert np.array_equal(model.grasp_matrix(points, normals), gp.model.grasp_matrix(points))
    assert np.array_equal(model.hand_jacobian(twists, normals), twists[:, :3].reshape(15, 7))
    assert np.array_equal(model.covectors(normals), normals)
    assert np.array_equal(model.stiffness_factors, np.ones(3))


def test_a_patch_transmits_the_torque_of_friction_at_its_torsion_length():
    """∫ μ p r dA over Hertz's pressure p ∝ √(1 − r²/a²), per unit of μ f_n, by the midpoint rule."""
    model = SoftFinger(torsion=0.003)
    radius = (np.arange(200_000) + 0.5) / 200_000 * model.patch_radius
    pressure = np.sqrt(1.0 - (radius / model.patch_radius) ** 2)
    mean = np.sum(pressure * radius**2) / np.sum(pressure * radius)
    assert mean == pytest.approx(model.torsion, rel=1e-6)


def test_a_soft_finger_turns_as_stiffly_as_its_patch():
    """Turned by an angle about its normal, it answers with a² K_c times the angle."""
    model, contact, angle = SoftFinger(torsion=0.002), 5e3, 0.01
    twist = np.zeros((1, 6, 1))
    twist[0, 5, 0] = angle  # about the normal
    normals = np.array([[0.0, 0.0, 1.0]])
    motion = model.hand_jacobian(twist, normals)[:, 0]
    moment = model.moments((contact * model.stiffness_factors * motion)[None], normals)[0]
    np.testing.assert_allclose(moment, [0.0, 0.0, model.patch_radius**2 * contact * angle], atol=1e-12)


def pinch(arm=0.03):
    """Return two contacts that face each other along x."""
    return np.array([[arm, 0.0, 0.0], [-arm, 0.0, 0.0]]), np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])


def test_two_soft_fingers_are_force_closed_and_two_hard_ones_are_not():
    points, normals = pinch()
    assert gp.model.force_closure_margin(points, normals, 0.8, SoftFinger()) == pytest.approx(0.8, abs=1e-6)
    assert gp.model.force_closure_margin(points, normals, 0.8, HardFinger()) == -math.inf


def test_two_soft_fingers_hold_a_weight_beside_their_axis():
    """Each takes half of weight and torque: μ f_n = √((w/2)² + (w h/2γ)²); each finger with its own μ."""
    points, normals = pinch()
    aside, gamma, friction = 0.002, 0.004, 0.6
    wrench = np.array([0.0, 0.0, -WEIGHT, -aside * WEIGHT, 0.0, 0.0])
    pressed = math.hypot(WEIGHT / 2, aside * WEIGHT / 2 / gamma) / friction
    floor = gp.model.force_norm_floor(points, normals, friction, wrench, SoftFinger(torsion=gamma))
    assert floor == pytest.approx(math.sqrt(2.0) * pressed, rel=1e-5)
    uneven = gp.model.force_norm_floor(points, normals, [0.4, 0.8], wrench, SoftFinger(torsion=gamma))
    # Each has to carry half of the weight, but the rougher one can take the torque: the slicker one's μ counts.
    assert uneven == pytest.approx(math.sqrt(2.0) * WEIGHT / 2 / 0.4, rel=1e-5)


def test_without_friction_a_box_takes_seven_contacts_and_a_ball_is_never_held():
    """Two contacts on each face of a box, resist any wrench; on a ball all forces pass through its centre."""
    points, normals = [], []
    for axis in range(3):
        for side in (1.0, -1.0):
            for corner in (1.0, -1.0):
                point = np.full(3, 0.02 * corner)
                point[axis], point[(axis + 1) % 3] = 0.03 * side, 0.02 * corner * side
                points.append(point)
                normals.append(-side * np.eye(3)[axis])
    points, normals = np.array(points), np.array(normals)
    assert gp.model.force_closure_margin(points, normals, 1.0, Frictionless()) > 0.1
    assert gp.model.force_closure_margin(points[:6], normals[:6], 1.0, Frictionless()) == -math.inf
    assert gp.model.force_closure_margin(-0.03 * normals, normals, 1.0, Frictionless()) == -math.inf


@pytest.mark.parametrize("text", ["hard", "soft:torsion=0.005", "frictionless"])
def test_text_round_trip(text):
    assert parse_contact_model(text).text == text


def test_models_are_values_and_say_what_is_wrong():
    assert parse_contact_model("soft") == SoftFinger() != SoftFinger(torsion=0.004)
    assert len({SoftFinger(), parse_contact_model(" soft "), HardFinger()}) == 2
    for text, message in (
        ("soggy", "contact_model 'soggy'"),
        ("soft:length=1", "key of contact_model soft"),
        ("soft:torsion=x", "soft.torsion: got 'x'"),
        ("soft:torsion=-1", "soft.torsion: got -1.0"),
        ("soft:torsion=nan", "soft.torsion"),
        ("soft:torsion=1,torsion=2", "given once"),
    ):
        with pytest.raises(gp.GraspPlannerError, match=message) as caught:
            parse_contact_model(text)
        assert "\n" not in str(caught.value)
