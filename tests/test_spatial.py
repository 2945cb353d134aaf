"""Vector algebra against its definitions."""

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.checks import finite_array, positive, unit_vector
from grasp_planner.spatial import rotation_between, rotation_exp, rotation_left_jacobian, skew
from tests.finite_differences import central_differences


def test_skew_is_the_cross_product(rng):
    a, b = rng.normal(size=(2, 4, 3))
    np.testing.assert_allclose((skew(a) @ b[..., None])[..., 0], np.cross(a, b), atol=1e-15)


@pytest.mark.parametrize("size", [0.0, 1e-6, 0.3, 3.0])
def test_rotation_exponential_agrees_with_pinocchio(rng, size):
    vector = size * unit_vector("v", rng.normal(size=3))
    np.testing.assert_allclose(rotation_exp(vector), pin.exp3(vector), atol=1e-12)


@pytest.mark.parametrize("size", [1e-6, 0.3, 2.5])
def test_left_jacobian_is_the_derivative_of_the_exponential(rng, size):
    vector = size * unit_vector("v", rng.normal(size=3))
    base = rotation_exp(vector)
    numeric = central_differences(lambda v: pin.log3(rotation_exp(v) @ base.T), vector, 1e-4)
    np.testing.assert_allclose(rotation_left_jacobian(vector), numeric, atol=1e-9)


def test_rotation_between_takes_one_vector_to_the_other(rng):
    a, b = (unit_vector("v", rng.normal(size=3)) for _ in range(2))
    for target in (b, a, -a):
        rotation = rotation_between(a, target)
        np.testing.assert_allclose(rotation @ a, target, atol=1e-12)
        np.testing.assert_allclose(np.linalg.det(rotation), 1.0, atol=1e-12)


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda: finite_array("angles", [1.0, np.nan], (2,)), "angles"),
        (lambda: finite_array("angles", [1.0], (2,)), "angles"),
        (lambda: finite_array("angles", ["a", "b"], (2,)), "angles"),
        (lambda: unit_vector("normal", [0.0, 0.0, 0.0]), "normal"),
        (lambda: positive("mass", -1.0), "mass"),
        (lambda: positive("mass", 0.0), "mass"),
        (lambda: positive("mass", float("inf")), "mass"),
        (lambda: positive("mass", "heavy"), "mass"),
    ],
)
def test_bad_numbers_name_field_value_and_what_is_allowed(call, field):
    with pytest.raises(gp.InvalidValueError) as caught:
        call()
    assert caught.value.field == field
    assert caught.value.allowed


def test_checked_arrays_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        finite_array("a", [1.0, 2.0], (2,))[0] = 3.0
