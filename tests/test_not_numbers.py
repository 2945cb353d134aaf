"""What is not a number violates its requirement, whichever number of a grasp it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import grasp_planner as gp
from grasp_planner.grasp.verdict import Violation
from grasp_planner.problem.term import METRE, NEWTON, Constraint, above_zero
from grasp_planner.simulate.gate import GateReport
from grasp_planner.terms.registry import REQUIREMENTS
from tests.stored import stored

NAN = float("nan")


class Stained:
    """A grasp some of whose quantities are others."""

    def __init__(self, grasp, quantities):
        self.__dict__.update(quantities)
        self._grasp = grasp

    def __getattr__(self, name):
        return getattr(self._grasp, name)


def last_nan(values):
    """Return a copy of an array whose last number is none."""
    found = np.array(values)
    found[-1] = NAN
    return found


def pairs_with_nan(grasp, kind):
    """Return the clearances with the last one of a kind that counts not known."""
    pairs = list(grasp.clearances)
    index = max(k for k, pair in enumerate(pairs) if pair.kind == kind and not pair.exempt)
    pairs[index] = replace(pairs[index], distance=NAN)
    return {"near_clearances": tuple(pairs)}


def contacts_with_nan(grasp, name):
    return {"contacts": replace(grasp.contacts, **{name: last_nan(getattr(grasp.contacts, name))})}


def loads_with_nan(grasp, name):
    return {"load_check": replace(grasp.load_check, **{name: NAN})}


class Foggy:
    """An object whose distance is not known everywhere."""

    def __init__(self, grasp):
        self.solid, self._clear = self, grasp.problem.grasp_object

    def sample(self, points):
        """Return the distances, the last one unknown."""
        found = self._clear.sample(points)
        return replace(found, distance=last_nan(found.distance))


STAINS = {
    "surface": lambda grasp: contacts_with_nan(grasp, "gaps"),
    "region": lambda grasp: contacts_with_nan(grasp, "points"),
    "tip_patch": lambda grasp: contacts_with_nan(grasp, "normals"),
    "contact_off_link": lambda grasp: contacts_with_nan(grasp, "normals"),
    "tangency": lambda grasp: {"contacts": replace(grasp.contacts, normals=np.full((5, 3), NAN))},
    "edge": lambda grasp: {"surface_contacts": replace(grasp.contacts, points=last_nan(grasp.contacts.points))},
    "friction": lambda grasp: {"friction_margins": last_nan(grasp.friction_margins)},
    "finger_share": lambda grasp: {"normal_forces": last_nan(grasp.normal_forces)},
    "joint_limit": lambda grasp: {"joint_angles": last_nan(grasp.joint_angles)},
    "abduction_order": lambda grasp: {"joint_angles": np.full(15, NAN)},
    "tension": lambda grasp: {"sigma": last_nan(grasp.sigma)},
    "compliance": lambda grasp: {"bending_torques": last_nan(grasp.bending_torques)},
    "equilibrium_force": lambda grasp: {"intensities": last_nan(grasp.intensities)},
    "equilibrium_moment": lambda grasp: {"intensities": last_nan(grasp.intensities)},
    "link_object": lambda grasp: pairs_with_nan(grasp, "link_object"),
    "self_collision": lambda grasp: pairs_with_nan(grasp, "self_collision"),
    "ground": lambda grasp: pairs_with_nan(grasp, "ground"),
    "joint_centre": lambda grasp: {"problem": Stained(grasp.problem, {"grasp_object": Foggy(grasp)})},
    "load_friction": lambda grasp: loads_with_nan(grasp, "friction"),
    "load_min_normal": lambda grasp: loads_with_nan(grasp, "least_normal"),
    "load_max_normal": lambda grasp: loads_with_nan(grasp, "largest_normal"),
    "load_torque": lambda grasp: loads_with_nan(grasp, "torque"),
    "load_force_norm": lambda grasp: {"force_norm": NAN},
}
SIDES = {
    "contact_set": "links",
    "contacts": ("thumb_pad", "index_pad", "middle_medial", "ring_medial", "little_pad"),
    "n_synergies": 15,
    "synergy_set": "santello_clear",
}


@pytest.fixture(scope="module")
def grasp(right):
    """Every quantity of it is a number, and every requirement can be judged."""
    everything = gp.GraspProblem(
        right,
        gp.Cylinder(),
        loads=gp.LoadCases(max_force_norm=100.0),
        clearance=gp.ClearanceOptions(ground=-0.2, remark1=True),
        **SIDES,
    )
    q = 0.5 * (right.lower + right.upper)
    return gp.Grasp(everything, q, pin.exp6(np.array([0.0, 0.0, 0.3, 0.1, 0.2, 0.3])), np.zeros(15))


def test_every_requirement_has_its_stain():
    assert set(STAINS) == {term.name for term in REQUIREMENTS}


@pytest.mark.parametrize("term", REQUIREMENTS, ids=lambda term: term.name)
def test_what_is_not_a_number_is_a_violation(grasp, term):
    if term.name == "tension":
        problem = gp.GraspProblem.paper(gp.load_hand("tendon_hand"), gp.Sphere(radius=0.03))
        grasp = gp.Grasp(problem, problem.synergies.mean, grasp.palm_pose, np.zeros(3))
    assert np.isfinite(term.violation(grasp))
    found = term.violation(Stained(grasp, STAINS[term.name](grasp)))
    assert np.isnan(found)
    assert Violation(term.name, found, term.unit).text.startswith(f"{term.name} not a number")


def test_a_violation_that_is_no_number_comes_first_and_is_the_largest():
    grasp = stored("paper")
    found = dict(grasp.violations)
    judged = replace(grasp)
    judged.__dict__["violations"] = {
        "large": Violation("large", 5.0, METRE),
        "none": Violation("none", NAN, NEWTON),
        "larger": Violation("larger", 7.0, METRE),
        **found,
    }
    assert list(judged.failures()) == ["none", "larger", "large"]
    assert np.isnan(judged.max_violation) and not judged.feasible


def test_in_the_search_it_is_one_too():
    class Unknown(Constraint):
        name, unit = "unknown", METRE

        def residual(self, problem, state):
            return np.array([1.0, NAN, 2.0])

        def jacobian(self, problem, state):
            return np.zeros((3, 1))

        def violation(self, grasp):
            return NAN

    assert np.isnan(Unknown().shortfall(None, None))
    assert above_zero(-2.0) == 0.0 and above_zero(2) == 2.0 and np.isnan(above_zero(NAN))


def test_the_gate_of_the_simulation_does_not_open():
    assert GateReport("planned", 0.0, 0.0, 1e-3).passed
    assert not GateReport("planned", NAN, 0.0, 1e-3).passed
    assert not GateReport("planned", 0.0, NAN, 1e-3).passed


@pytest.mark.parametrize("wrong", ["0.5", True, None, [[0.5]], [0.5, True, "x"], "much", 1j])
def test_a_number_is_no_text_and_no_truth_value(wrong):
    with pytest.raises(gp.InvalidValueError, match="friction") as caught:
        gp.GraspParameters(friction=wrong)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("wrong", [("0", "0", "-9.81"), (True, False, True)])
def test_nor_are_the_numbers_of_a_vector(wrong):
    with pytest.raises(gp.InvalidValueError, match="gravity"):
        gp.GraspParameters(gravity=wrong)


@pytest.mark.parametrize("kind", [int, np.int64, np.uint8])
def test_whole_numbers_of_any_kind_are_whole_numbers(right, kind):
    problem = gp.GraspProblem(right, gp.Sphere(), n_synergies=kind(5))
    assert type(problem.n_synergies) is int and problem == gp.GraspProblem(right, gp.Sphere(), n_synergies=5)
    options = gp.PlannerOptions(starts=kind(3))
    assert type(options.starts) is int and options == gp.PlannerOptions(starts=3)
    for wrong in (True, 5.0, "5"):
        with pytest.raises(gp.InvalidValueError, match="n_synergies"):
            gp.GraspProblem(right, gp.Sphere(), n_synergies=wrong)


def test_an_array_of_wrenches_is_taken_as_a_tuple():
    rows = np.arange(12.0).reshape(2, 6)
    loads = gp.LoadCases(wrenches=rows)
    assert loads.wrenches == tuple(map(tuple, rows.tolist())) and loads == gp.LoadCases(wrenches=loads.wrenches)
    for wrong in (np.arange(6.0), rows[:, :5], 3.0):
        with pytest.raises(gp.InvalidValueError, match=r"loads\.wrenches"):
            gp.LoadCases(wrenches=wrong)
