"""Shared fixtures: the hands, and one planned grasp that many tests look at."""

import numpy as np
import pytest

import grasp_planner as gp


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
    """The grasp of the command line's defaults: the paper's cylinder, force along +y, three synergies."""
    return gp.plan_grasp(gp.GraspProblem.paper(right, gp.Cylinder()), options=gp.PlannerOptions(enough=1))
