"""The judge: one requirement at a time is broken by a known amount, which it has to name and to measure.

Every test starts from a stored feasible grasp; the amounts are analytic or those of tests/judge_model.py.
"""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.judge import posed_grasp
from tests.judge_model import by_hand, full_angles
from tests.stored import FOLDER, failures, stored

PAPER = ("paper", "native_3", "native_15")


def with_problem(grasp, **changes):
    """Return the grasp as an answer to a changed problem."""
    return gp.Grasp(replace(grasp.problem, **changes), grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma)


def with_object(grasp, **changes):
    return with_problem(grasp, grasp_object=replace(grasp.problem.grasp_object, **changes))


def with_parameters(grasp, **changes):
    return with_problem(grasp, parameters=replace(grasp.problem.parameters, **changes))


def with_hand(grasp, **changes):
    return with_problem(grasp, hand=replace(grasp.problem.hand, **changes))


def with_forces(grasp, forces):
    """Return the grasp with contact forces that are not those of its model."""
    wrong = gp.Grasp(grasp.problem, grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma)
    wrong.__dict__["intensities"] = forces
    return wrong


def turned(axis, angle, shift=(0.0, 0.0, 0.0)):
    return pin.SE3(pin.exp3(angle * np.array(axis, dtype=float)), np.array(shift))


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.json")), ids=lambda path: path.stem)
def test_stored_grasps_are_feasible(path):
    grasp = stored(path.stem)
    assert failures(grasp) == {}
    assert grasp.feasible
    assert grasp.verdict.startswith("feasible")


@pytest.mark.parametrize("name", ["paper", "push", "loads", "point_sphere", "round_sphere", "clear"])
def test_contacts_forces_and_torques_are_those_computed_by_hand(name):
    grasp = stored(name)
    model = by_hand(grasp)
    np.testing.assert_allclose(grasp.contacts.points, model.points, atol=1e-12)
    np.testing.assert_allclose(grasp.contacts.normals, model.normals, atol=1e-9)
    np.testing.assert_allclose(grasp.contacts.gaps, model.gaps, atol=1e-12)
    np.testing.assert_allclose(grasp.grasp_matrix, model.grasp_matrix, atol=1e-12)
    np.testing.assert_allclose(grasp.hand_jacobian, model.jacobian, atol=1e-12)
    np.testing.assert_allclose(grasp.forces, model.forces, atol=1e-7)
    np.testing.assert_allclose(grasp.joint_torques, model.torques, atol=1e-8)
    np.testing.assert_allclose(grasp.friction_margins, model.slack(0.8), atol=1e-7)
    assert grasp.force_norm == pytest.approx(np.sqrt((model.normal_forces**2).sum()), rel=1e-9)


@pytest.mark.parametrize("change", [0.004, -0.003])
@pytest.mark.parametrize("name", ["paper", "round_sphere"])
def test_surface(name, change):
    """A thicker object is penetrated, a thinner one not touched, by the difference of the radii."""
    grasp = with_object(stored(name), radius=stored(name).problem.grasp_object.radius + change)
    assert failures(grasp) == {"surface": pytest.approx(abs(change), abs=1e-9)}


def test_surface_of_one_contact():
    """One finger that leaves the surface is enough."""
    grasp = stored("paper")
    q = np.array(grasp.joint_angles)
    q[grasp.problem.hand.joint_index("ring_pip")] -= 0.03
    moved = gp.Grasp(grasp.problem, q, grasp.palm_pose, grasp.delta_sigma)
    gaps = np.abs(by_hand(moved).gaps)
    assert gaps[3] > 1e-4 and np.delete(gaps, 3).max() < 1e-9
    assert moved.violations["surface"].value == pytest.approx(gaps[3], abs=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_region_ends_at_both_rims(side):
    """Moved along its axis the cylinder is touched as before, but beyond its rim, less the strip that is left out."""
    grasp = stored("paper")
    up = pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.1 * side])) * grasp.palm_pose
    moved = gp.Grasp(grasp.problem, grasp.joint_angles, up, grasp.delta_sigma)
    beyond = (side * by_hand(moved).points[:, 2]).max() - (0.075 - 0.002)
    assert beyond > 0.005
    assert moved.violations["region"].value == pytest.approx(beyond, abs=1e-9)
    assert moved.violations["surface"].value < 1e-9


@pytest.mark.parametrize("name", PAPER)
def test_friction(name):
    """With less friction the same forces lie outside of the cones by |f_t| − μ f_n."""
    slick = with_parameters(stored(name), friction=0.3)
    outside = -by_hand(slick).slack(0.3).min()
    assert outside > 0.01
    assert failures(slick) == {"friction": pytest.approx(outside, abs=1e-7)}


def test_friction_of_fingers_that_pull():
    """A reversed squeeze pulls: the violation is μ |f_n| + |f_t|."""
    grasp = stored("push")
    pulling = gp.Grasp(grasp.problem, grasp.joint_angles, grasp.palm_pose, -grasp.delta_sigma)
    model = by_hand(pulling)
    assert model.normal_forces.min() < -1.0
    assert pulling.violations["friction"].value == pytest.approx(-model.slack(0.8).min(), rel=1e-8)


@pytest.mark.parametrize("joint", [0, 7, 14])
@pytest.mark.parametrize("end", ["lower", "upper"])
def test_joint_limits(end, joint):
    """A limit that lies 0.02 rad inside of the angle, of one joint."""
    grasp = stored("native_3")
    limits = np.array(getattr(grasp.problem.hand, end))
    limits[joint] = grasp.joint_angles[joint] + (0.02 if end == "lower" else -0.02)
    assert failures(with_hand(grasp, **{end: limits})) == {"joint_limit": pytest.approx(0.02, abs=1e-12)}


@pytest.mark.parametrize("name", ["paper", "native_3_push"])
def test_compliance(name):
    """Synergies whose mean is shifted out of their range leave the posture unexplained by the shift."""
    grasp = stored(name)
    space = grasp.problem.synergies
    shift = 0.01 * np.linalg.svd(space.basis.T)[2][-1]
    away = with_problem(grasp, synergy_space=replace(space, mean=space.mean + shift))
    assert failures(away) == {"compliance": pytest.approx(np.abs(shift).max(), abs=1e-9)}
    along = with_problem(grasp, synergy_space=replace(space, mean=space.mean + 0.1 * space.basis[:, 0]))
    assert failures(along) == {}
    np.testing.assert_allclose(along.sigma - grasp.sigma, [-0.1, *np.zeros(len(grasp.sigma) - 1)], atol=1e-9)


@pytest.mark.parametrize("torque_model", ["total", "internal"])
def test_compliance_bends_the_joints_by_the_torques_of_the_model(torque_model):
    """S_⊥-part of q − q̄ + C_q τ with uneven C_q, τ of all forces or of internal ones."""
    c_q = tuple(np.linspace(0.02, 0.3, 15))
    grasp = with_parameters(stored("push"), joint_compliance=c_q, torque_model=torque_model)
    model, space = by_hand(grasp), grasp.problem.synergies
    torques = model.torques if torque_model == "total" else model.internal_torques
    bent = grasp.joint_angles + np.array(c_q) * torques
    rest = bent - space.mean
    rest = rest - space.basis @ np.linalg.lstsq(space.basis, rest, rcond=None)[0]
    assert np.abs(rest).max() > 1e-3
    assert grasp.violations["compliance"].value == pytest.approx(np.abs(rest).max(), abs=1e-8)
    np.testing.assert_allclose(grasp.reference_joint_angles + rest, bent, atol=1e-8)


@pytest.mark.parametrize("axis", range(6))
def test_equilibrium(axis):
    """Forces that leave a known wrench unbalanced: 3 mN or 3 mN m along one axis."""
    grasp = stored("clear")
    extra = np.linalg.pinv(by_hand(grasp).grasp_matrix) @ (0.003 * np.eye(6)[axis])
    found = failures(with_forces(grasp, grasp.forces + extra.reshape(-1, 3)))
    name = "equilibrium_force" if axis < 3 else "equilibrium_moment"
    assert found[name] == pytest.approx(0.003, rel=1e-6)
    assert [key for key in found if key.startswith("equilibrium")] == [name]


@pytest.mark.parametrize("gravity", [(1.0, -2.0, 3.0), (0.0, 9.81, 0.0)])
def test_equilibrium_is_that_with_the_weight(gravity):
    """The judge weighs the object itself: forces for another weight are out by the difference."""
    grasp = stored("paper")
    other = with_parameters(grasp, gravity=np.array(gravity))
    assert other.violations["equilibrium_force"].value < 1e-9
    off = 0.2 * (np.array(gravity) - [0.0, 0.0, -9.81])
    wrong = with_forces(other, grasp.forces).violations
    assert wrong["equilibrium_force"].value == pytest.approx(np.abs(off).max(), rel=1e-6)
    assert wrong["equilibrium_moment"].value < 1e-9
    assert with_object(grasp, mass=0.7).violations["equilibrium_force"].value < 1e-9
    np.testing.assert_allclose(by_hand(other, weight=0.2 * np.array(gravity)).forces, other.forces, atol=1e-7)


@pytest.mark.parametrize("name", ["paper", "clear"])
def test_what_is_not_force_closed_is_not_feasible(name, monkeypatch):
    """Every requirement met and no force closure: not feasible, and the verdict says why."""
    grasp = gp.Grasp(*(getattr(stored(name), f) for f in ("problem", "joint_angles", "palm_pose", "delta_sigma")))
    assert stored(name).force_closed
    assert stored(name).force_closure_margin > 0.0
    monkeypatch.setattr(posed_grasp, "shows_force_closure", lambda *_: False)
    grasp.__dict__["force_closure_margin"] = -1e-3
    assert failures(grasp) == {}
    assert not grasp.force_closed
    assert not grasp.is_feasible()
    assert not grasp.feasible
    assert grasp.status == "infeasible"
    assert grasp.verdict == "infeasible: not force-closed"


def test_force_closure_is_that_of_the_contacts_and_of_friction():
    """The judge asks for the closure of these contacts with the problem's own friction."""
    grasp = stored("native_15_push")
    model = by_hand(grasp)
    assert grasp.force_closure_margin == pytest.approx(
        gp.model.force_closure_margin(model.points, model.normals, 0.8), abs=1e-7
    )
    least = min(mu for mu in np.linspace(0.02, 0.8, 40) if with_parameters(grasp, friction=mu).force_closed)
    assert with_parameters(grasp, friction=0.8).force_closed
    slick = with_parameters(grasp, friction=0.5 * least)
    assert not slick.force_closed
    assert "not force-closed" in slick.verdict


@pytest.mark.parametrize("tolerance", [1e-6, 1e-2])
def test_feasible_is_within_the_tolerance(tolerance):
    """Just within and just beyond."""
    grasp = stored("paper")
    for factor, expected in ((0.9, True), (1.1, False)):
        off = with_object(grasp, radius=0.03 - factor * tolerance)
        assert off.is_feasible(tolerance) == expected
        assert off.failures(tolerance) == ({} if expected else pytest.approx(off.failures(0.5 * tolerance)))


def test_failures_come_largest_first_and_numbers_that_are_none_fail():
    grasp = stored("paper")
    off = with_parameters(with_object(grasp, radius=0.029), friction=0.3)
    values = [found.value for found in off.failures().values()]
    assert len(values) == 2
    assert values == sorted(values, reverse=True)
    broken = with_parameters(grasp)
    broken.__dict__["contacts"] = replace(grasp.contacts, gaps=np.full(5, np.nan))
    assert list(failures(broken)) == ["surface"]
    assert not broken.is_feasible(1e9)


def test_full_angles_are_those_of_the_hand():
    """The coupling of the hand is DIP = PIP, whatever the order of joints in the URDF."""
    hand = gp.load_hand()
    q = np.linspace(0.0, 1.0, 15)
    np.testing.assert_allclose(hand.full_configuration(q), full_angles(hand, q), atol=1e-15)
