"""Terms have two sides that share no formula, the search's and the judge's: each is the other's oracle."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.evaluation.load_response import CONE_SMOOTHING
from grasp_planner.evaluation.state import FRICTION_SMOOTHING
from grasp_planner.grasp.verdict import Violation
from grasp_planner.problem.term import BUILT_IN_CONSTRAINTS, BUILT_IN_COSTS, Constraint, Cost, Unit
from grasp_planner.records.grasp_record import grasp_record
from grasp_planner.terms.objective import SMALL_COSTS, problem_objective
from grasp_planner.terms.registry import REQUIREMENTS, judged_requirements, problem_constraints, stacked
from tests.finite_differences import central_differences, relative_error
from tests.test_state import grasp_at, random_point, steps_of

LOADS = gp.LoadCases(
    force=2.0,
    torque=0.02,
    acceleration=1.0,
    position_error=1e-4,
    wrenches=((0.0, 1.0, 0.0, 0.01, 0.0, 0.0),),
    min_normal_force=0.5,
    max_normal_force=4.0,
    max_force_norm=3.0,
)
POWER = ("thumb_pad", "index_pad", "middle_medial", "ring_medial", "little_pad")
ON_GROUND = gp.ClearanceOptions(ground=-0.05, margin=0.0, remark1=True)
CENTRES = gp.ClearanceOptions(link_object="joint_centres", margin=0.0)
BOX = gp.Box(x=0.05, y=0.05, z=0.08, edge=0.01)


@pytest.fixture(scope="module")
def problems(right):
    """Problems that ask, together, for every requirement there is."""
    paper = gp.GraspProblem.paper
    with_sides = {"contact_set": "links", "contacts": POWER, "synergy_set": "santello_clear", "n_synergies": 15}
    return (
        paper(right, gp.Cylinder(), n_synergies=5, loads=LOADS),
        paper(right, gp.Cylinder(), n_synergies=5, loads=replace(LOADS, max_normal_force=None, hand_limits=False)),
        paper(right, BOX, n_synergies=8, contact_set="point", clearance=CENTRES, loads=LOADS),
        paper(right, gp.Cylinder(radius=0.045, height=0.18), clearance=ON_GROUND, **with_sides),
        gp.GraspProblem(right, BOX, n_synergies=2, clearance=gp.ClearanceOptions.off(), loads=LOADS),
        paper(gp.load_hand("tendon_hand"), gp.Sphere(radius=0.03), n_synergies=3),
    )


def points(problem, rng, count=12):
    """Yield random states of a problem with the grasps that stand there."""
    for _ in range(count):
        evaluator, x = random_point(problem, rng)
        layout = evaluator.layout
        x[layout.displacement] *= rng.choice([1.0, 30.0])  # gentle or far too strong
        x[layout.translation] *= rng.choice([1.0, 3.0])  # around the object or away from it
        yield evaluator.evaluate(x), grasp_at(evaluator, x)


def as_the_judge_sees_it(term, problem, state):
    """Return a term's violation from the search's residuals, without what makes them smooth."""
    if term.name == "compliance":  # its rows are coordinates along S_⊥
        return np.abs(problem.synergies.complement() @ term.residual(problem, state)).max()
    if term.name == "friction":
        margins, normal = term.residual(problem, state), state.normal_forces
        smooth = problem.parameters.friction * normal - margins
        return max(0.0, -(margins + smooth - np.sqrt(smooth**2 - FRICTION_SMOOTHING**2)).min())
    return term.shortfall(problem, state)


EXACT = (
    "surface",
    "region",
    "compliance",
    "friction",
    "finger_share",
    "equilibrium_force",
    "equilibrium_moment",
    "tip_patch",
    "tangency",
    "abduction_order",
    "tension",
)
SMOOTH = {
    "load_friction": CONE_SMOOTHING,
    "load_min_normal": 1e-8,
    "load_max_normal": 1e-8,
    "load_torque": 1e-8,
    "load_force_norm": 1e-8,
}
"""How much smoothing may hide or add, in the unit of the term."""
BODIES = ("link_object", "joint_centre", "self_collision", "ground")
OF_MESHES = ("edge",)
"""Those that only meshes have: tests/objects/test_triangles.py."""


def test_every_constraint_has_its_oracle_below():
    """A constraint that is added to the registry is added to one of the tests too."""
    constraints = {term.name for term in REQUIREMENTS if isinstance(term, Constraint)}
    assert constraints == {*EXACT, *SMOOTH, *BODIES, *OF_MESHES}
    assert {term.name for term in REQUIREMENTS} - constraints == {"joint_limit", "contact_off_link"}


@pytest.mark.parametrize("name", EXACT)
def test_search_and_judge_agree_to_rounding(problems, name, rng):
    seen = []
    for problem in problems:
        for term in (term for term in problem_constraints(problem) if term.name == name):
            for state, grasp in points(problem, rng):
                judged = term.violation(grasp)
                assert as_the_judge_sees_it(term, problem, state) == pytest.approx(judged, rel=1e-6, abs=1e-9)
                seen.append(judged)
    assert max(seen) > 1e-3, "violated somewhere, or nothing was compared"


@pytest.mark.parametrize("name", SMOOTH)
def test_search_and_judge_agree_to_the_smoothing(problems, name, rng):
    """Smooth residuals are on the safe side of the plain ones, by no more than their smoothing."""
    seen = []
    for problem in problems[:3]:
        for term in (term for term in problem_constraints(problem) if term.name == name):
            for state, grasp in points(problem, rng):
                searched, judged = term.shortfall(problem, state), term.violation(grasp)
                assert -1e-9 * (1.0 + judged) <= searched - judged <= SMOOTH[name] + 1e-9 * judged
                seen.append(judged)
    assert max(seen) > 1e-2, "violated somewhere, or nothing was compared"


@pytest.mark.parametrize("name", BODIES)
def test_what_the_judge_finds_inside_the_search_finds_too(problems, name, rng):
    """Distances saturate and blend in the search; an overlap of 3 mm is one for both, and clear hands for neither."""
    overlaps = free = 0
    for problem in problems[2:]:
        for term in (term for term in problem_constraints(problem) if term.name == name):
            for state, grasp in points(problem, rng, count=25):
                searched, judged = term.shortfall(problem, state), term.violation(grasp)
                if judged > 3e-3:
                    overlaps += 1
                    assert searched > 1e-3
                if searched > 3e-3 and name != "link_object":  # there the search guards more than the judge counts
                    assert judged > 0.0
                free += judged == 0.0
    assert overlaps > 0
    assert free > 0 or name == "self_collision"


@pytest.mark.parametrize("number", [0, 1, 4])
def test_every_jacobian_equals_central_differences(problems, number, rng):
    """Bodies that keep apart have their own test, which knows where distances have kinks."""
    problem = problems[number]
    evaluator, x = random_point(problem, rng)
    state, steps = evaluator.evaluate(x), steps_of(evaluator.layout)
    for term in problem_constraints(problem):
        numeric = central_differences(lambda y, t=term: t.residual(problem, evaluator.evaluate(y)), x, steps)
        analytic = term.jacobian(problem, state)
        assert analytic.shape == numeric.shape == (term.residual(problem, state).size, x.size)
        if numeric.size:
            assert relative_error(analytic, numeric) < 1e-5, term.name


def test_the_objective_is_the_weighted_sum_on_both_sides(right, rng):
    own = _Height().weighted(3.0)
    parameters = gp.GraspParameters(force_weight=0.2, task_weight=5.0)
    problem = gp.GraspProblem.paper(right, gp.Cylinder(), n_synergies=5, parameters=parameters, costs=(own,))
    objective = problem_objective(problem)
    assert [each.cost.name for each in objective.terms] == ["force_norm", "task_index", "palm_height"]
    evaluator, x = random_point(problem, rng)
    layout, state = evaluator.layout, evaluator.evaluate(x)
    grasp = gp.Grasp(problem, x[layout.joints], evaluator.palm_pose(x), x[layout.displacement])
    height = float(grasp.palm_pose.translation[2]) ** 2
    assert grasp.objective == pytest.approx(0.2 * grasp.force_norm + 5.0 * grasp.task_index + 3.0 * height, rel=1e-12)
    assert objective.value(problem, state) == pytest.approx(grasp.objective, rel=1e-6)
    numeric = central_differences(
        lambda y: [objective.value(problem, evaluator.evaluate(y))], x, steps_of(evaluator.layout)
    )
    assert relative_error(objective.gradient(problem, state), numeric) < 1e-5
    assert objective.scaled(4.0).value(problem, state) == pytest.approx(4.0 * objective.value(problem, state))


def test_rows_are_weighted_and_moved_by_their_margins(problems, rng):
    problem = problems[0]
    evaluator, x = random_point(problem, rng)
    state, terms = evaluator.evaluate(x), problem_constraints(problem)[:3]
    value, slope = stacked(terms, problem, state, lambda term: term.unit.weight, lambda term: term.unit.margin)
    row = 0
    for term in terms:
        residual = term.residual(problem, state)
        rows = slice(row, row + residual.size)
        np.testing.assert_allclose(value[rows], term.unit.weight * (residual - term.unit.margin))
        np.testing.assert_allclose(slope[rows], term.unit.weight * term.jacobian(problem, state))
        row += residual.size
    assert row == value.size == len(slope)
    none, no_slope = stacked((), problem, state, lambda term: 1.0)
    assert none.shape == (0,) and no_slope.shape == (0, x.size)


def test_what_is_judged_follows_the_problem(right):
    plain = {term.name for term in judged_requirements(gp.GraspProblem.paper(right, gp.Cylinder()))}
    assert plain == {
        "surface",
        "region",
        "compliance",
        "friction",
        "joint_limit",
        "equilibrium_force",
        "equilibrium_moment",
    }
    safe = {term.name for term in judged_requirements(gp.GraspProblem(right, gp.Cylinder()))}
    clear = {"link_object", "self_collision", "tip_patch", "contact_off_link"}
    assert safe - plain == clear | {"load_friction", "load_min_normal", "load_max_normal", "load_torque"}


# --- the user's own terms ---------------------------------------------------------------------------


class _Height(Cost):
    """Square of the height of the palm above the object."""

    name, unit = "palm_height", Unit("m²")

    def value(self, problem, state):
        return float(state.geometry.translation[2] ** 2)

    def gradient(self, problem, state):
        slope = np.zeros(state.x.size)
        slope[problem.hand.n_joints + 2] = 2.0 * state.geometry.translation[2]
        return slope

    def clear_value(self, grasp):
        return float(grasp.palm_pose.translation[2] ** 2)


class _PalmAbove(Constraint):
    """The palm stays above a height."""

    name, unit = "palm_above", Unit("m", 100.0, 1000.0, 1e-4, 1e-8, "cm", 100.0)

    def __init__(self, least):
        self.least = least

    def residual(self, problem, state):
        return np.array([state.geometry.translation[2] - self.least])

    def jacobian(self, problem, state):
        slope = np.zeros((1, state.x.size))
        slope[0, problem.hand.n_joints + 2] = 1.0
        return slope

    def violation(self, grasp):
        return max(0.0, self.least - float(grasp.palm_pose.translation[2]))


QUICK = gp.PlannerOptions(starts=6, enough=1)


@pytest.fixture(scope="module")
def plain(right):
    return gp.plan_grasp(gp.GraspProblem.paper(right, gp.Cylinder(), n_synergies=15), options=QUICK)


@pytest.fixture(scope="module")
def raised(plain):
    """The same problem with the palm kept a centimetre above where it came to be."""
    height = float(plain.palm_pose.translation[2]) + 0.01
    return gp.plan_grasp(replace(plain.problem, constraints=(_PalmAbove(height),)), options=QUICK)


def test_an_own_constraint_is_held(plain, raised):
    (term,) = raised.problem.constraints
    assert plain.feasible and term.violation(plain) == pytest.approx(0.01)
    assert raised.feasible, raised.verdict
    assert float(raised.palm_pose.translation[2]) >= term.least - 1e-6
    assert raised.violations["palm_above"] == Violation("palm_above", term.violation(raised), term.unit)
    assert max(record.violations["palm_above"] for record in raised.search.history) > 0.0


def test_an_own_constraint_is_reported_where_it_is_violated(plain, raised):
    judged = replace(plain, problem=raised.problem)
    assert not judged.feasible and judged.status == "infeasible"
    assert list(judged.failures()) == ["palm_above"]
    assert judged.verdict == "infeasible: palm_above 0.01 m"


def test_an_own_cost_is_made_small(plain):
    weighted = replace(plain.problem, costs=(_Height().weighted(100.0),))
    low = gp.plan_grasp(weighted, options=QUICK)
    assert low.feasible, low.verdict
    before, after = (abs(float(grasp.palm_pose.translation[2])) for grasp in (plain, low))
    assert after < 0.5 * before
    assert low.objective == pytest.approx(plain_sum(low) + 100.0 * after**2, rel=1e-9)
    assert low.search.history[-1].objective == pytest.approx(low.objective, rel=1e-4)


def plain_sum(grasp):
    """Return w_F F + w_C C."""
    parameters = grasp.problem.parameters
    return parameters.force_weight * grasp.force_norm + parameters.task_weight * grasp.task_index


def test_own_terms_come_back_from_the_record_when_passed_in_again(raised):
    grasp = replace(raised, problem=replace(raised.problem, costs=(_Height().weighted(0.5),)))
    record = grasp_record(grasp)
    assert record.violations["palm_above"].unit == "m"
    assert record.costs["palm_height"].weight == 0.5 and record.costs["palm_height"].unit == "m²"
    assert record.costs["palm_height"].value == pytest.approx(float(grasp.palm_pose.translation[2]) ** 2)
    total = sum(cost.weight * cost.value for cost in record.costs.values())
    assert record.objective == pytest.approx(total)
    (term,) = raised.problem.constraints
    again = gp.grasp_from_record(record, costs=(_Height(),), constraints=(term,))
    assert again.problem.constraints == (term,)
    assert [each.weight for each in again.problem.costs] == [0.5]
    assert grasp_record(again).violations.keys() == record.violations.keys()
    assert again.objective == pytest.approx(grasp.objective)


def test_a_record_says_which_own_terms_are_missing(raised):
    record = grasp_record(replace(raised, problem=replace(raised.problem, costs=(_Height(),))))
    with pytest.raises(gp.InvalidValueError, match=r"palm_height missing; pass .* costs=") as caught:
        gp.grasp_from_record(record)
    assert "\n" not in str(caught.value)
    with pytest.raises(gp.InvalidValueError, match=r"palm_above missing; pass .* constraints="):
        gp.grasp_from_record(record, costs=(_Height(),))
    with pytest.raises(gp.InvalidValueError, match="only own terms that the file names"):
        gp.grasp_from_record(
            grasp_record(replace(raised, problem=replace(raised.problem, constraints=()))), costs=(_Height(),)
        )


def test_why_not_names_an_own_constraint_with_its_unit(plain):
    """No palm 20 m above the object holds it."""
    problem = replace(plain.problem, constraints=(_PalmAbove(20.0),))
    diagnosis = gp.analysis.explain_infeasibility(replace(plain, problem=problem), only=("none",), time_limit_s=5.0)
    assert diagnosis.binding.name in ("palm_above", "surface")
    assert "palm_above" in diagnosis.text
    assert f"{diagnosis.least_violated.violations['palm_above'].value:.3g} m" in diagnosis.text


class _Named(_PalmAbove):
    def __init__(self, name, unit=_PalmAbove.unit):
        super().__init__(0.0)
        self.name, self.unit = name, unit


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"constraints": (_PalmAbove,)}, "constraints: got"),
        ({"constraints": _PalmAbove(0.0)}, "constraints: got"),
        ({"constraints": (_Height(),)}, "Constraint objects"),
        ({"constraints": (_Named("a"), _Named("b"), _Named("a"))}, "every name once"),
        ({"constraints": (_Named(""),)}, "name of _Named"),
        ({"constraints": (_Named("a", "m"),)}, "unit of a"),
        ({"costs": (_PalmAbove(0.0),)}, "Cost objects"),
        ({"costs": (_Height(), _Height())}, "every name once"),
        ({"costs": 3.0}, "costs: got 3.0"),
    ],
)
def test_wrong_terms_are_one_line(right, fields, said):
    with pytest.raises(gp.InvalidValueError, match=said) as caught:
        gp.GraspProblem.paper(right, gp.Cylinder(), **fields)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("weight", [-1.0, float("nan"), "much"])
def test_wrong_weights_are_named(weight):
    with pytest.raises(gp.InvalidValueError, match="weight of palm_height"):
        _Height().weighted(weight)


def test_names_of_built_in_terms_are_taken(plain):
    """They are refused when the problem is made; the list of names is that of the registry."""
    assert set(BUILT_IN_CONSTRAINTS) == {term.name for term in REQUIREMENTS}
    for name in BUILT_IN_CONSTRAINTS:
        with pytest.raises(gp.InvalidValueError, match=rf"{name}.*no built-in term"):
            replace(plain.problem, constraints=(_Named(name),))
    costs = [*(each.cost for each in problem_objective(plain.problem).terms), *SMALL_COSTS]
    assert set(BUILT_IN_COSTS) == {cost.name for cost in costs}
    for cost in costs:
        with pytest.raises(gp.InvalidValueError, match=rf"{cost.name}.*no built-in term"):
            replace(plain.problem, costs=(cost,))


class _Misshapen(_PalmAbove):
    def jacobian(self, problem, state):
        return np.zeros((1, 3))


class _Flat(_PalmAbove):
    def residual(self, problem, state):
        return 0.5


class _NoNumber(_PalmAbove):
    def violation(self, grasp):
        return np.zeros(2)


class _ShortGradient(_Height):
    def gradient(self, problem, state):
        return np.zeros(2)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"constraints": (_Misshapen(0.0),)}, r"jacobian of palm_above: got \(1, 3\)"),
        ({"constraints": (_Flat(0.0),)}, r"residual of palm_above: got \(\)"),
        ({"costs": (_ShortGradient(),)}, r"gradient of palm_height: got \(2,\)"),
        ({"constraints": (_NoNumber(0.0),)}, "violation of palm_above"),
    ],
)
def test_wrong_shapes_are_one_line_when_planning(plain, fields, said):
    with pytest.raises(gp.InvalidValueError, match=said) as caught:
        gp.plan_grasp(replace(plain.problem, **fields), options=gp.PlannerOptions(starts=1, max_iterations=2))
    assert "\n" not in str(caught.value)


def test_a_violation_that_is_no_number_is_none_that_is_met(plain):
    class _Undefined(_PalmAbove):
        def violation(self, grasp):
            return float("nan")

    judged = replace(plain, problem=replace(plain.problem, constraints=(_Undefined(0.0),)))
    assert not judged.feasible
    assert grasp_record(judged).violations["palm_above"].value is None


def test_own_costs_are_shown(raised):
    """On the command line with value and weight, on the page in the unit that people read."""
    from grasp_planner.cli.plan import own_cost_rows
    from grasp_planner.viewer.verdict_card import headline

    grasp = replace(raised, problem=replace(raised.problem, costs=(_Height().weighted(0.5),)))
    ((name, text),) = own_cost_rows(grasp)
    assert name == "palm_height" and text.startswith(f"{_Height().clear_value(grasp):.3g} m²") and "0.5" in text
    assert headline(grasp)[-1][0] == "palm height"
    assert own_cost_rows(raised) == []
