"""A soft-finger grasp in MuJoCo: two fingertips hold an object that hard ones would let turn."""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.model import HardFinger, SoftFinger
from grasp_planner.simulate.protocol import PLAN
from grasp_planner.simulate.run import simulate_grasp
from grasp_planner.simulate.scene import build_scene


@pytest.fixture(scope="module")
def pinched(right):
    parameters = gp.GraspParameters(contact_model=SoftFinger(torsion=0.005), friction=(0.7, 0.8))
    problem = gp.GraspProblem(right, gp.Cylinder(), parameters=parameters, contacts=("thumb", "index"))
    return gp.plan_grasp(problem, options=gp.PlannerOptions(enough=1))


def object_pairs(xml):
    """Return the pairs of hand and object."""
    pairs = [pair for pair in ElementTree.fromstring(xml).iter("pair") if "object" in pair.get("geom2")]
    assert len(pairs) > 2
    return pairs


def test_fingertips_rub_as_planned(pinched):
    """Four directions of friction, each tip with its own μ and with μ γ of torsion; the test's own numbers win."""
    expected = {"tip_thumb": [0.7, 0.7, 0.0035, 0.0, 0.0], "tip_index": [0.8, 0.8, 0.004, 0.0, 0.0]}
    for pair in object_pairs(build_scene(pinched, PLAN).xml):
        rubbing = [float(value) for value in pair.get("friction").split()]
        assert pair.get("condim") == "4"
        np.testing.assert_allclose(rubbing, expected.get(pair.get("geom1"), [0.7, 0.7, 0.0035, 0.0, 0.0]))
    for pair in object_pairs(build_scene(pinched, replace(PLAN, friction=0.5, torsional_friction=0.0)).xml):
        assert pair.get("condim") == "3" and pair.get("friction").startswith("0.5 0.5 0.0 ")


def test_two_soft_fingers_hold_what_two_hard_ones_let_turn(pinched):
    """With torsion the object stays and forces at rest are those of the plan; without it turns about the pinch."""
    soft = simulate_grasp(pinched, replace(PLAN, torques=False, hold_s=0.2), ladder=False)
    assert soft.rest.held and soft.rest.rotation_deg < 1.0
    np.testing.assert_allclose(soft.rest.normal_forces, pinched.normal_forces, rtol=0.05)
    assert all(report.held for report in soft.directions)
    hard = simulate_grasp(pinched, replace(PLAN, torsional_friction=0.0, torques=False, hold_s=0.5), ladder=False)
    turned = [hard.rest.rotation_deg, *(report.rotation_deg for report in hard.directions)]
    assert max(turned) > 5.0 * max(soft.rest.rotation_deg, *(report.rotation_deg for report in soft.directions))


def test_hard_fingers_have_three_directions(planned):
    assert planned.problem.contact_model == HardFinger()
    scene = build_scene(planned, PLAN).xml
    assert 'condim="3"' in scene and 'condim="4"' not in scene
