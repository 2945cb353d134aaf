"""What the tests of simulation share: a grasp that holds."""

from dataclasses import replace

import pytest

import grasp_planner as gp
from grasp_planner.simulate import find_protocol


@pytest.fixture(scope="session")
def held(right):
    """Spherical fingertips, every joint free, on a cylinder of 36 mm radius."""
    problem = gp.GraspProblem.paper(
        right, gp.Cylinder(radius=0.036), n_synergies=15, synergy_set="native", contact_set="sphere"
    )
    grasp = gp.plan_grasp(problem, seed=0, options=gp.PlannerOptions(enough=1))
    assert grasp.feasible
    return grasp


@pytest.fixture(scope="session")
def tips_only():
    """The plan's own test with fingertips only: the grasp was planned without clearances."""
    return replace(find_protocol("plan"), geometry="contacts")
