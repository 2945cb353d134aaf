"""The judge of load cases and the inputs that search and judge share, against tests/judge_model.py."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from tests.judge_model import by_hand, cube_directions, load_extremes, load_forces
from tests.stored import failures, stored
from tests.test_judge import with_hand, with_parameters, with_problem

MASS = 0.2


def with_loads(grasp, **changes):
    return with_problem(grasp, loads=replace(grasp.problem.loads, **changes))


def normal_extremes(grasp):
    """Return the least and the largest normal force of every contact over all load cases."""
    model = by_hand(grasp)
    return load_extremes(model, grasp.problem.loads, MASS, lambda f: (f * model.normals).sum(axis=1))


def torque_extremes(grasp):
    """Return the least and the largest torque of every joint over all load cases."""
    model = by_hand(grasp)
    return load_extremes(model, grasp.problem.loads, MASS, lambda f: model.jacobian.T @ f.ravel())


def friction_left(grasp):
    """Return the least slack of friction over all load cases with the problem's safety."""
    model, problem = by_hand(grasp), grasp.problem
    friction = problem.parameters.friction / problem.loads.friction_safety
    return min(model.slack(friction, forces).min() for forces in load_forces(model, problem.loads, MASS))


@pytest.mark.parametrize("name", ["loads", "push", "native_3_push"])
def test_least_normal_force(name):
    grasp = stored(name)
    low = normal_extremes(grasp)[0].min()
    asked = with_loads(grasp, min_normal_force=low + 0.05)
    assert failures(asked) == {"load_min_normal": pytest.approx(0.05, abs=1e-6)}


@pytest.mark.parametrize("name", ["loads", "push", "native_3_push"])
def test_largest_normal_force_asked_for(name):
    grasp = stored(name)
    high = normal_extremes(grasp)[1].max()
    assert failures(with_loads(grasp, max_normal_force=high - 0.3)) == {"load_max_normal": pytest.approx(0.3, abs=1e-6)}
    assert failures(with_loads(grasp, max_normal_force=high + 1e-3)) == {}


def test_largest_normal_force_of_the_hand():
    """Without one that is asked for, the hand's 10 N count, unless they shall not."""
    grasp = stored("push")
    asked = with_loads(grasp, force=8.0, friction_safety=1.0, max_force_norm=None)
    high = normal_extremes(asked)[1].max()
    assert high > 10.5
    assert asked.violations["load_max_normal"].value == pytest.approx(high - 10.0, abs=1e-6)
    assert with_loads(asked, hand_limits=False).violations["load_max_normal"].value == 0.0
    assert with_loads(asked, max_normal_force=high - 0.1).violations["load_max_normal"].value == pytest.approx(
        0.1, abs=1e-6
    )


@pytest.mark.parametrize("joint", range(0, 15, 2))
def test_joint_torques(joint):
    """The URDF's effort limit of one motor, lowered to 0.01 N m less than its largest torque."""
    grasp = stored("loads")
    low, high = torque_extremes(grasp)
    largest = max(-low[joint], high[joint])
    model = grasp.problem.hand.model.copy()
    effort = np.array(model.effortLimit)
    effort[model.joints[model.getJointId(grasp.problem.hand.joint_names[joint])].idx_v] = largest - 0.01
    model.effortLimit = effort
    limited = with_hand(grasp, model=model)
    assert limited.problem.torque_limits[joint] == pytest.approx(largest - 0.01)
    assert failures(limited) == {"load_torque": pytest.approx(0.01, abs=1e-7)}
    assert failures(with_loads(limited, hand_limits=False)) == {}


def test_both_signs_of_torques_count():
    low, high = torque_extremes(stored("loads"))
    assert (-low > high).any() and (high > -low).any(), "else the tests above show one sign only"


def test_force_budget_is_that_of_the_nominal_case():
    grasp = stored("loads")
    nominal = np.linalg.norm(by_hand(grasp).normal_forces)
    assert failures(with_loads(grasp, max_force_norm=nominal - 0.2)) == {
        "load_force_norm": pytest.approx(0.2, abs=1e-6)
    }
    assert failures(with_loads(grasp, max_force_norm=nominal + 1e-4)) == {}


CHANGES = {
    "force": {"force": 2.5},
    "torque": {"torque": 0.08},
    "acceleration": {"acceleration": 14.0},
    "acceleration beside a smaller force": {"force": 1.0, "acceleration": 12.0},
    "force beside a smaller acceleration": {"force": 2.4, "acceleration": 6.0},
    "position": {"position_error": 4e-4},
    "rotation": {"rotation_error": 1e-2},
    "wrenches": {"wrenches": ((0.3, 0.0, -0.2, 0.0, 0.005, 0.0), (-4.0, 8.0, 4.0, 0.04, 0.0, -0.1))},
    "safety": {"friction_safety": 2.0},
    "everything": {"force": 1.5, "torque": 0.03, "position_error": 1e-4, "rotation_error": 2e-3},
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("name", ["loads", "push"])
def test_every_kind_of_load_case(name, change):
    """Friction, normal forces and torques are those of the largest load case."""
    asked = with_loads(stored(name), hand_limits=True, **CHANGES[change])
    low, high = normal_extremes(asked)
    down, up = torque_extremes(asked)
    found = asked.violations
    limits = np.tile([1.15, 1.15, 0.6], 5)
    assert found["load_friction"].value == pytest.approx(max(0.0, -friction_left(asked)), abs=1e-6)
    assert found["load_friction"].value > 1e-3, "else nothing is shown"
    assert found["load_min_normal"].value == pytest.approx(max(0.0, 0.1 - low.min()), abs=1e-6)
    assert found["load_max_normal"].value == pytest.approx(max(0.0, high.max() - 10.0), abs=1e-6)
    assert found["load_torque"].value == pytest.approx(max(0.0, (np.maximum(up, -down) - limits).max()), abs=1e-7)
    assert not asked.is_feasible()


def test_linear_limits_hold_on_the_whole_sphere(rng):
    """No direction of a disturbing force is worse than the closed form says, and one is as bad."""
    grasp = with_loads(stored("push"), force=2.0)
    model = by_hand(grasp)
    low, _ = normal_extremes(grasp)
    directions = rng.normal(size=(4000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    response = np.linalg.solve(model.grasp_matrix @ model.stiffness @ model.grasp_matrix.T, np.eye(6)[:, :3])
    change = (model.stiffness @ model.grasp_matrix.T @ response) @ (2.0 * directions.T)
    normal = np.einsum("ij,kij->ki", model.normals, model.forces - change.T.reshape(-1, *model.forces.shape))
    assert normal.min() >= low.min() - 1e-9
    assert normal.min() == pytest.approx(low.min(), abs=0.02)
    assert grasp.violations["load_min_normal"].value == pytest.approx(0.1 - low.min(), abs=1e-6)


@pytest.mark.parametrize(
    ("force", "acceleration", "radius"), [(1.0, 20.0, 4.0), (1.0, 3.0, 1.0), (0.0, 5.0, 1.0), (2.0, 0.0, 2.0)]
)
def test_of_force_and_acceleration_the_larger_one_counts(force, acceleration, radius):
    cases = gp.LoadCases(force=force, acceleration=acceleration).cases(0.2)
    assert cases.shape == (15, 6)
    np.testing.assert_array_equal(cases[0], 0.0)
    assert not cases[:, 3:].any()
    rows = cases[1:, :3]
    np.testing.assert_allclose(np.linalg.norm(rows, axis=1), radius)
    for direction in cube_directions():
        assert np.abs(rows - radius * direction).max(axis=1).min() < 1e-12


def test_load_cases_are_those_that_are_asked_for():
    loads = gp.LoadCases(
        force=1.0, torque=0.2, position_error=0.003, rotation_error=0.04, wrenches=((1.0, 2.0, 3.0, 4.0, 5.0, 6.0),)
    )
    cases = loads.cases(1.0)
    assert cases.shape == (2 + 4 * 14, 12)
    assert loads.disturbed and loads.displaced and loads.active
    np.testing.assert_array_equal(cases[:2], [np.zeros(12), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, *np.zeros(6)]])
    for kind, radius in enumerate((1.0, 0.2, 0.003, 0.04)):
        block = cases[2 + 14 * kind : 16 + 14 * kind]
        np.testing.assert_allclose(np.linalg.norm(block[:, 3 * kind : 3 * kind + 3], axis=1), radius)
        assert not np.delete(block, range(3 * kind, 3 * kind + 3), axis=1).any()


@pytest.mark.parametrize("name", ["force", "torque", "acceleration", "position_error", "rotation_error"])
def test_every_sphere_alone_is_a_disturbance(name):
    loads = replace(gp.LoadCases.off(), **{name: 0.5})
    assert loads.active and loads.disturbed
    assert len(loads.cases(0.2)) == 15
    assert loads.displaced == name.endswith("error")


def test_listed_wrenches_alone_are_a_disturbance():
    loads = replace(gp.LoadCases.off(), wrenches=((0.0, 0.0, 1.0, 0.0, 0.0, 0.0),))
    assert loads.active and loads.disturbed and not loads.displaced
    grasp = with_problem(stored("paper"), loads=loads)
    assert grasp.violations["load_friction"].value == pytest.approx(-friction_left(grasp), abs=1e-6)


@pytest.mark.parametrize("compliance", [0.1, 0.0, tuple(np.linspace(0.01, 0.4, 15))])
def test_the_answer_is_that_of_the_compliance_of_every_joint(compliance):
    """C_q enters K_m, K and with them forces and the answer to disturbances, joint by joint."""
    grasp = with_parameters(stored("push"), joint_compliance=compliance)
    np.testing.assert_allclose(grasp.problem.joint_compliance, np.broadcast_to(compliance, 15))
    np.testing.assert_allclose(grasp.forces, by_hand(grasp).forces, atol=1e-7)
    harder = with_loads(grasp, force=3.0)
    assert harder.violations["load_friction"].value == pytest.approx(-friction_left(harder), abs=1e-6)


@pytest.mark.parametrize("changes", [{"structural_compliance": 0.02}, {"contact_stiffness": 3e4}, {"friction": 0.5}])
def test_every_parameter_is_used(changes):
    grasp = with_loads(with_parameters(stored("push"), **changes), force=3.0)
    model = by_hand(grasp)
    np.testing.assert_allclose(grasp.forces, model.forces, atol=1e-7)
    np.testing.assert_allclose(grasp.friction_margins, model.slack(changes.get("friction", 0.8)), atol=1e-7)
    assert grasp.violations["load_friction"].value == pytest.approx(-friction_left(grasp), abs=1e-6)


@pytest.mark.parametrize("hand", ["dlr_hit_ii_right", "dlr_hit_ii_left"])
def test_torque_limits_are_the_efforts_of_the_urdf(hand):
    found = gp.load_hand(hand)
    joints = ElementTree.parse(found.folder / found.description.urdf).getroot().iter("joint")
    efforts = {joint.get("name"): limit.get("effort") for joint in joints if (limit := joint.find("limit")) is not None}
    expected = [float(efforts[name]) for name in found.joint_names]
    problem = gp.GraspProblem.paper(found, gp.Cylinder(), loads=gp.LoadCases())
    np.testing.assert_array_equal(problem.torque_limits, expected)


def test_torque_limits_follow_the_order_of_the_hands_joints():
    hand = gp.load_hand()
    model = hand.model.copy()
    model.effortLimit = np.arange(1.0, model.nv + 1.0)
    limited = gp.GraspProblem(replace(hand, model=model), gp.Cylinder())
    order = [name for name in model.names.tolist()[1:]]
    np.testing.assert_array_equal(limited.torque_limits, [1.0 + order.index(name) for name in hand.joint_names])


@pytest.mark.parametrize("contact_set", ["point", "sphere"])
def test_radii_are_those_of_the_contacts_that_touch(contact_set):
    problem = gp.GraspProblem(
        gp.load_hand(), gp.Cylinder(), contact_set=contact_set, contacts=("ring", "thumb", "index")
    )
    assert [frame.name for frame in problem.frames] == ["thumb", "index", "ring"]
    np.testing.assert_array_equal(problem.radii, np.full(3, 0.01 if contact_set == "sphere" else 0.0))
    power = gp.GraspProblem(gp.load_hand(), gp.Cylinder(), contact_set="power")
    np.testing.assert_array_equal(power.radii[:4], [0.010, 0.011, 0.010, 0.011])


def test_the_weight_acts_at_the_centre_of_mass_along_gravity():
    parameters = gp.GraspParameters(gravity=np.array([1.0, 2.0, -2.0]))
    problem = gp.GraspProblem(gp.load_hand(), gp.Cylinder(mass=0.3), parameters=parameters)
    np.testing.assert_allclose(problem.external_wrench, [0.3, 0.6, -0.6, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(problem.up, [-1 / 3, -2 / 3, 2 / 3])
    standard = gp.GraspProblem(gp.load_hand(), gp.Cylinder(mass=0.3))
    np.testing.assert_allclose(standard.external_wrench, [0.0, 0.0, -2.943, 0.0, 0.0, 0.0])
    weightless = gp.GraspProblem(gp.load_hand(), gp.Cylinder(), parameters=gp.GraspParameters(gravity=np.zeros(3)))
    assert not weightless.external_wrench.any()
    np.testing.assert_array_equal(weightless.up, [0.0, 0.0, 1.0])
