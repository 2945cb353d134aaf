"""How a simulated hand closes: around a loose object, one handed over, until its motors feel what they should."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.analysis.off_plan import palm_moved
from grasp_planner.closing.path import free_posture
from grasp_planner.simulate import World, find_protocol, protocol_from, simulate_grasp
from grasp_planner.simulate.closing_hand import MotorEfforts, close_hand
from grasp_planner.simulate.off_plan import GATE, survival
from tests.stored import stored

HANDED = replace(find_protocol("handed"), gate=GATE, torques=False, hold_s=0.4)


@pytest.fixture(scope="module")
def grasp():
    """Eight synergies, a box, clear links, load cases."""
    return stored("default_box")


@pytest.fixture(scope="module")
def path(grasp):
    return grasp.closing.path


@pytest.fixture(scope="module")
def off(grasp):
    """Its palm 2 mm and 2° off, so that fingertips are up to 8 mm off."""
    return palm_moved(grasp, np.array([0.0, -2e-3, 0.0]), np.radians([0.0, 0.0, 2.0]))


def closed(grasp, protocol, path):
    world = World(grasp, protocol)
    close_hand(world, path, world.run)
    return world


def test_a_giver_is_a_spring_and_lets_go(grasp, path):
    world = World(grasp, HANDED)
    world.reset(free_posture(grasp, path.open), path.open)
    world.weigh(False)
    world.carry_object((300.0, 0.3))
    world.push(np.zeros(6))
    world.data.qpos[world._object_qpos] += [3e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    world.run(0.01)
    assert 1e-3 < world.displacement < 3e-3
    world.run(0.3)
    assert world.displacement < 1e-4
    world.carry_object(None)
    world.push(np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0]))
    world.run(0.1)
    # Loose, 0.2 kg go ½ a t² = 7.5 mm.
    assert world.displacement == pytest.approx(0.5 * 0.3 / 0.2 * 0.1**2, rel=0.05)


def test_motors_squeeze_until_their_efforts_are_those_asked_for(grasp, off, path):
    for firmness in (1.5, 2.0):
        world = closed(off, replace(HANDED, firmness=firmness), path)
        assert MotorEfforts(world, path).ratio == pytest.approx(firmness, rel=0.05)
    plain = closed(off, replace(HANDED, firmness=1.0), path)
    np.testing.assert_array_equal(plain.references, path.squeezing)
    # The palm off, the planned references alone press with other forces.
    assert abs(MotorEfforts(plain, path).ratio - 1.0) > 0.2


def test_no_motor_squeezes_on_with_a_joint_at_its_torque_limit_or_where_a_contact_would_slide(grasp, path, monkeypatch):
    short = replace(path, onward=replace(path.onward, reach=0.2))
    way = closed(grasp, HANDED, short).references - path.squeezing
    np.testing.assert_allclose(way, 0.2 * path.onward.way, atol=1e-12)
    with monkeypatch.context() as patch:
        # Before the efforts are as planned, fingers have to arrive: nothing slides yet.
        patch.setattr(MotorEfforts, "ratio", property(lambda self: 0.5))
        farther = closed(grasp, HANDED, short).references - path.squeezing
    assert np.linalg.norm(farther) > 2.0 * np.linalg.norm(way)
    monkeypatch.setattr(MotorEfforts, "torque_use", property(lambda self: 1.0))
    np.testing.assert_array_equal(closed(grasp, HANDED, path).references, path.squeezing)


@pytest.mark.parametrize(
    ("shift", "turn"),
    [((-2e-3, 0, 0), (0, 0, 2)), ((0, 0, -2e-3), (0, 0, 2))],
    ids=str,
)
def test_a_palm_off_the_plan_holds_what_it_is_handed_where_the_planned_references_lose_it(grasp, path, shift, turn):
    off = palm_moved(grasp, np.array(shift), np.radians(turn))
    free = replace(find_protocol("free"), gate=GATE, torques=False, hold_s=0.4)
    lost = simulate_grasp(off, replace(free, stage_s=0.4, grip_s=0.4, firmness=1.0), ladder=False, path=path)
    assert not lost.passed
    held = simulate_grasp(off, HANDED, ladder=False, path=path)
    assert held.passed, held.verdict


def test_an_object_makes_way_without_being_thrown(grasp, path):
    shift = -8e-3 * grasp.contacts.normals[0]
    into = palm_moved(grasp, -shift, np.zeros(3))
    world = World(into, HANDED)
    world.reset(free_posture(into, path.open), path.open)
    world.weigh(False)
    begin = world.save()
    deepest = -min(contact.dist for contact in world.data.contact[: world.data.ncon])
    assert deepest > 1e-3
    world.run(0.05)
    thrown = world.displacement
    world.restore(begin)
    world.make_way()
    aside = world.displacement
    world.run(0.05)
    assert world.displacement - aside < 1e-4
    assert thrown > deepest


def test_who_hands_over_neither_holds_nor_has_a_table():
    handed = find_protocol("handed")
    assert protocol_from({**vars(handed), "carried": [300.0, 0.3]}) == handed
    for wrong in ({"hold_while_closing": True}, {"start": "plan"}, {"carried": (300.0, 0.0)}, {"firmness": 0.5}):
        with pytest.raises(gp.GraspPlannerError, match="protocol"):
            replace(handed, **wrong)


def test_what_survives_can_be_asked_of_an_object_that_is_handed_over(grasp):
    with pytest.raises(gp.InvalidValueError, match="closes from open"):
        survival(grasp, protocol=find_protocol("plan"))
