"""An object on its table: where the table is, who hits it, lifted and shaken as an accelerated palm would."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.closing.path import free_posture
from grasp_planner.simulate import World, find_protocol, simulate_grasp
from grasp_planner.simulate.lifting import _lifted, lift
from grasp_planner.simulate.off_plan import ERRORS, ROWS, TABLE, _from_table
from grasp_planner.simulate.table import table_height
from tests.stored import stored

TEST = find_protocol("table")
SHORT = replace(TEST, shake_s=0.3)


@pytest.fixture(scope="module")
def from_above():
    """Planned above a table that no link may enter."""
    grasp = stored("ground")
    assert grasp.problem.clearance.ground is not None
    return grasp


@pytest.mark.parametrize(
    "thing",
    [
        gp.Sphere(0.03),
        gp.Cylinder(radius=0.03, height=0.1),
        gp.Box(x=0.04, y=0.05, z=0.06, edge=0.005),
        gp.Capsule(radius=0.02, height=0.05),
    ],
    ids=lambda thing: type(thing).__name__,
)
def test_an_object_reaches_as_deep_as_its_triangles(thing, rng):
    for way in rng.normal(size=(5, 3)):
        way = way / np.linalg.norm(way)
        reach = float((np.asarray(thing.mesh.vertices) @ way).max())
        # The triangles of a box have sharp corners, 3.7 mm out of those rounded by 5 mm; chords are a little inside.
        assert thing.reach(way) == pytest.approx(reach, abs=4e-3)
    assert thing.reach(np.array([0.0, 0.0, -1.0])) == pytest.approx(-thing.mesh.bounds[0, 2], abs=1e-4)


def test_what_does_not_stand_is_refused(planned):
    problem = planned.problem
    assert table_height(problem) == pytest.approx(problem.grasp_object.height / 2)
    slanted = replace(problem, parameters=replace(problem.parameters, gravity=[6.0, 0.0, -7.0]))
    with pytest.raises(gp.InvalidValueError, match="stands on a table") as refused:
        table_height(slanted)
    assert len(str(refused.value)) <= 200
    tilted = replace(planned, problem=slanted)
    assert _from_table(tilted).tried == 0
    assert "does not stand" in _from_table(tilted).worst


def test_a_plan_that_knows_no_table_is_not_simulated_on_one(planned):
    found = simulate_grasp(planned, TEST)
    assert found.rest is None and not found.passed
    assert found.verdict.startswith("not simulated: the hand would go through the table by")
    assert (_from_table(planned).survived, _from_table(planned).tried) == (0, 0)


def test_the_way_up_is_smooth_and_ends_at_rest():
    ways, accelerations = np.array([_lifted(TEST, time) for time in np.linspace(0.0, TEST.lift_s, 2001)]).T
    assert (ways[0], ways[-1], accelerations[0]) == (0.0, pytest.approx(TEST.lift), 0.0)
    assert accelerations[-1] == pytest.approx(0.0, abs=1e-9)
    step = TEST.lift_s / 2000
    np.testing.assert_allclose(np.diff(ways, 2) / step**2, accelerations[1:-1], atol=1e-4)


def test_a_table_bears_what_stands_on_it_and_goes_down(from_above):
    world = World(from_above, replace(TEST, geometry="contacts"))
    path = from_above.closing.path
    world.reset(free_posture(from_above, path.open), path.open)
    world.weigh(True)
    world.run(0.3)
    assert world.displacement < 1e-4
    lift(world, world.run)
    assert world.displacement > 0.08, "nothing holds it: it stays on the table, which is away"


def test_an_accelerated_palm_pulls_every_mass(from_above):
    world = World(from_above, TEST)
    world.accelerate(np.array([1.0, 0.0, -2.0]))
    body = world.model.body("object").id
    np.testing.assert_allclose(world.data.xfrc_applied[body], np.array([-1.0, 0.0, 2.0, 0, 0, 0]) * world.scene.mass)
    np.testing.assert_allclose(world.data.xfrc_applied[:, 0], -world.model.body_mass)


def test_a_plan_above_a_table_is_lifted_and_shaken(from_above):
    found = simulate_grasp(from_above, SHORT, record=True)
    assert all(gate.table_overlap == 0.0 for gate in found.gates)
    assert found.passed, found.verdict
    assert found.verdict == "passed: lifted 10 cm, 3 of 3 shakes of 5 m/s² held"
    assert [report.kind for report in found.directions] == ["shake"] * 3
    assert found.frames[-1].time > TEST.lift_s
    thrown = simulate_grasp(from_above, replace(SHORT, shake=500.0))
    assert not thrown.passed and thrown.rest.held


def test_a_table_wants_an_open_hand_gravity_and_a_free_object():
    for wrong in ({"start": "plan"}, {"gravity": False}, {"hold_while_closing": True}):
        with pytest.raises(gp.InvalidValueError, match="protocol table"):
            replace(TEST, **wrong)


def test_the_table_of_what_survives_ends_with_the_table():
    assert (*ERRORS, TABLE) == ROWS
    assert TABLE == "table, lifted 10 cm, shaken"
