"""What the tests of simulation share: a grasp that holds."""

from dataclasses import replace

import pytest

from grasp_planner.simulate import find_protocol
from tests.stored import stored


@pytest.fixture(scope="session")
def held():
    """Spherical fingertips, every joint free, on a cylinder of 36 mm radius."""
    grasp = stored("round_15")
    assert grasp.feasible
    return grasp


@pytest.fixture(scope="session")
def tips_only():
    """The plan's own test with fingertips only: the grasp was planned without clearances."""
    return replace(find_protocol("plan"), geometry="contacts")
