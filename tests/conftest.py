"""Shared fixtures: the hands, and one planned grasp that many tests look at."""

import numpy as np
import pytest

import grasp_planner as gp
from tests.stored import TOTAL, stored


@pytest.fixture(scope="session")
def right():
    return gp.load_hand("dlr_hit_ii_right")


@pytest.fixture(scope="session", params=["dlr_hit_ii_right", "dlr_hit_ii_left"])
def hand(request):
    return gp.load_hand(request.param)


@pytest.fixture
def rng():
    return np.random.default_rng(12345)


@pytest.fixture(scope="session")
def planned(right):
    """The stored grasp of the paper's case: its cylinder, force along +y, three synergies; as a search ended."""
    found = stored("paper")
    assert found.problem == gp.GraspProblem.paper(right, gp.Cylinder(), parameters=TOTAL)
    return found
