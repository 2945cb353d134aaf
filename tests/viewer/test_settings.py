"""Settings: each is reachable from the command line, JSON, a batch and the page, and means the same everywhere."""

import json

import click
import numpy as np
import pinocchio as pin
import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.batch.case import GraspCase
from grasp_planner.cli.options import planner_options, problem_from_options, problem_options, search_options
from grasp_planner.model import SoftFinger
from grasp_planner.problem.from_settings import PROBLEM_SETTINGS
from grasp_planner.problem.settings import settings_of
from grasp_planner.records.grasp_files import parse_grasp_record
from grasp_planner.viewer.panels.plan import PlanPanel
from grasp_planner.viewer.panels.problem import ProblemPanel
from grasp_planner.viewer.server import LocalServer
from grasp_planner.viewer.session import Session

SEARCH = {each.key: each for each in settings_of(gp.PlannerOptions)}
OTHERS = {
    "n_synergies": 7,
    "synergy_set": "native",
    "contact_set": "point",
    "contacts": ("thumb", "index", "middle"),
    "friction": (0.5, 0.6, 0.7, 0.8, 0.9),
    "contact_model": SoftFinger(torsion=0.004),
    "structural_compliance": 0.2,
    "joint_compliance": 0.3,
    "contact_stiffness": 2e4,
    "force_weight": 1e-3,
    "force_factor": 2.5,
    "least_share": 0.02,
    "sharing_weight": 0.5,
    "stop_weight": 0.4,
    "mean_weight": 0.3,
    "closing_weight": 0.2,
    "task_weight": 0.5,
    "gravity": (0.0, -9.0, 1.5),
    "torque_model": "internal",
    "force_law": "controllable",
    "clearance.link_object": "joint_centres",
    "clearance.self_collision": False,
    "clearance.tip_patch": False,
    "clearance.remark1": True,
    "clearance.margin": 0.002,
    "clearance.ground": -0.2,
    "loads.force": 0.5,
    "loads.torque": 0.01,
    "loads.acceleration": 2.0,
    "loads.position_error": 0.001,
    "loads.rotation_error": 0.02,
    "loads.wrenches": ((0.0, 0.0, -1.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0, 0.01, 0.0)),
    "loads.friction_safety": 1.5,
    "loads.min_normal_force": 0.2,
    "loads.max_normal_force": 9.0,
    "loads.max_force_norm": 30.0,
    "loads.hand_limits": False,
}
"""A value of every setting of a problem that is not its default."""
OTHER_SEARCH = {
    "starts": 7,
    "enough": 2,
    "max_iterations": 90,
    "tolerance": 1e-6,
    "time_limit_s": 12.5,
    "phase_one": False,
    "closing": False,
    "solver": "newton",
}
HANDS = tuple(gp.hand_library())


def values_of(problem):
    """Every setting of a problem, names of sets as they are in use."""
    owners = {"": problem, "clearance.": problem.clearance, "loads.": problem.loads}
    found = {}
    for key, each in PROBLEM_SETTINGS.items():
        owner = owners[each.group]
        value = getattr(owner if hasattr(owner, each.name) else problem.parameters, each.name)
        if hasattr(problem.parameters, each.name):
            value = getattr(problem.parameters, each.name)
        found[key] = np.asarray(value).tolist() if each.name == "gravity" else value
    found["synergy_set"] = problem.synergy_set_name
    found["contact_set"] = problem.contact_set_name
    return found | {
        "hand": problem.hand.name,
        "object": problem.grasp_object.text,
        "task": [task.text for task in problem.tasks],
    }


def by_python(hand, key, value):
    if key is None:
        return gp.GraspProblem(hand, gp.Cylinder())
    each = PROBLEM_SETTINGS[key]
    if each.group == "clearance.":
        return gp.GraspProblem(hand, gp.Cylinder(), clearance=gp.ClearanceOptions(**{each.name: value}))
    if each.group == "loads.":
        return gp.GraspProblem(hand, gp.Cylinder(), loads=gp.LoadCases(**{each.name: value}))
    if each in settings_of(gp.GraspParameters):
        return gp.GraspProblem(hand, gp.Cylinder(), parameters=gp.GraspParameters(**{each.name: value}))
    return gp.GraspProblem(hand, gp.Cylinder(), **{each.name: value})


def arguments_of(each, value):
    if each.kind == "truth":
        return [each.flag if value else f"--no-{each.flag.removeprefix('--')}"]
    if each.many:
        return [part for one in value for part in (each.flag, each.write(one))]
    return [each.flag, each.text(value)]


def by_command(arguments):
    made = []

    @click.command()
    @problem_options
    @search_options
    def command(seed, **given):
        made.append((problem_from_options(**given), planner_options(given)))

    result = CliRunner().invoke(command, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return made[0]


def by_batch(hand, key, value):
    plain = json.loads(json.dumps(value, default=lambda model: model.text))
    if key is None:
        return GraspCase(hand=hand.name).problem(hand)
    if key == "n_synergies":
        return GraspCase(n_synergies=plain).problem(hand)
    return GraspCase(hand=hand.name, settings={key: plain}).problem(hand)


def by_json(problem):
    hand = problem.hand
    middle = 0.5 * (hand.lower + hand.upper)
    grasp = gp.Grasp(problem, middle, pin.SE3.Identity(), np.zeros(problem.n_synergies))
    return gp.grasp_from_record(parse_grasp_record(gp.grasp_json(grasp).encode(), "x"), hand).problem


@pytest.fixture(scope="module")
def panels(grasp):
    server = LocalServer(port=0)
    yield ProblemPanel(server.gui, lambda: None), PlanPanel(server.gui), Session(grasp)
    server.stop()


def shown(each, value):
    """What a user types or chooses on the page."""
    if each.kind in ("truth", "choice") and not each.none:
        return value
    if each.kind == "truth":
        return "yes" if value else "no"
    return value if each.step is not None and not each.none and not each.each_of else each.text(value)


def by_page(panels, hand, key, value):
    panel, _, session = panels
    base = gp.GraspProblem(hand, gp.Cylinder())
    session.live = session.live.with_problem(base)
    panel.show(session, force=True)
    if key in ("synergy_set", "contact_set"):
        getattr(panel, key).value = value
    elif key == "contacts":
        for name, box in panel._fingers.items():
            box.value = name in value
    elif key == "n_synergies":
        return gp.GraspProblem(hand, gp.Cylinder(), n_synergies=value)  # the slider's own test sets it
    elif key is not None:
        each = PROBLEM_SETTINGS[key]
        folder = {"clearance.": panel.clearance, "loads.": panel.loads, "": panel.parameters}[each.group]
        folder.widgets[each.name].value = shown(each, value)
    return panel.problem(base)


def test_every_setting_has_a_value_to_try():
    assert set(OTHERS) == set(PROBLEM_SETTINGS) and set(OTHER_SEARCH) == set(SEARCH)


@pytest.mark.parametrize("key", OTHERS)
def test_every_setting_of_a_problem_means_the_same_through_every_door(panels, key):
    hand = gp.load_hand()
    value = OTHERS[key]
    wanted = by_python(hand, key, value)
    standard = values_of(by_python(hand, None, None))
    assert values_of(wanted)[key] != standard[key], "a value to be told from the default"
    assert values_of(by_command(arguments_of(PROBLEM_SETTINGS[key], value))[0]) == values_of(wanted)
    assert values_of(by_batch(hand, key, value)) == values_of(wanted)
    assert values_of(by_json(wanted)) == values_of(wanted)
    assert values_of(by_page(panels, hand, key, value)) == values_of(wanted)


@pytest.mark.parametrize("key", OTHER_SEARCH)
def test_every_setting_of_a_search_means_the_same_through_every_door(panels, key):
    each, value = SEARCH[key], OTHER_SEARCH[key]
    wanted = gp.PlannerOptions(**{key: value})
    assert by_command(arguments_of(each, value))[1] == wanted
    panel = panels[1].search
    panel.show(gp.PlannerOptions())
    panel.widgets[key].value = shown(each, value)
    assert panel.options(gp.PlannerOptions()) == wanted
    if key == "time_limit_s":  # of a case itself: its worker is ended
        assert GraspCase(time_limit_s=value).time_limit_s == value
    else:
        assert GraspCase(settings={key: value}).options() == wanted


@pytest.mark.parametrize("name", HANDS)
def test_without_settings_every_door_makes_the_same_problem(panels, name):
    hand = gp.load_hand(name)
    wanted = values_of(gp.GraspProblem(hand, gp.Cylinder()))
    assert gp.GraspProblem(hand, gp.Cylinder()).loads.disturbed
    command, options = by_command(["--hand", name])
    assert values_of(command) == wanted and options == gp.PlannerOptions()
    assert values_of(by_batch(hand, None, None)) == wanted
    assert values_of(by_json(gp.GraspProblem(hand, gp.Cylinder()))) == wanted
    panel, plan, session = panels
    first = gp.GraspProblem(gp.load_hand(), gp.Cylinder())
    session.live = session.live.with_problem(first)
    panel.show(session, force=True)
    panel.hand.value = name
    assert values_of(panel.problem(first)) == wanted
    plan.search.show(gp.PlannerOptions())
    assert plan.search.options(gp.PlannerOptions()) == gp.PlannerOptions()


def test_the_page_opens_with_the_default_problem(grasp):
    assert values_of(grasp.problem) == values_of(gp.GraspProblem(gp.load_hand(), gp.Cylinder()))


def test_a_row_holds_the_number_of_synergies_in_use():
    hand = gp.load_hand()
    assert GraspCase().columns(hand)["n_synergies"] == 3
    assert GraspCase(paper=True).columns(hand)["n_synergies"] == 3
    assert GraspCase(n_synergies=5).columns(hand)["n_synergies"] == 5
    assert GraspCase().columns(hand)["contact_stiffness"] == hand.description.compliance.contact_stiffness


@pytest.mark.parametrize("owner", [gp.GraspParameters, gp.ClearanceOptions, gp.LoadCases, gp.PlannerOptions])
def test_absurd_and_wrong_values_are_refused_where_they_enter(owner):
    for each in settings_of(owner):
        assert each.help and each.kind in ("number", "whole", "truth", "choice", "text")
        wrong = [1e308, "no such thing", -1e308] if each.kind != "truth" else [1, "yes"]
        for value in wrong:
            with pytest.raises(gp.GraspPlannerError):
                owner(**{each.name: value})


def test_parameters_of_files_from_before_have_old_names():
    hand = gp.load_hand()
    problem = gp.GraspProblem(hand, gp.Cylinder(), parameters=gp.GraspParameters(friction=0.4, contact_stiffness=3e4))
    grasp = gp.Grasp(problem, hand.lower, pin.SE3.Identity(), np.zeros(problem.n_synergies))
    data = json.loads(gp.grasp_json(grasp))
    for new, old in {"friction": "mu", "contact_stiffness": "K_c", "force_weight": "w_F"}.items():
        data["parameters"][old] = data["parameters"].pop(new)
    again = gp.grasp_from_record(parse_grasp_record(json.dumps(data).encode(), "old")).problem
    assert values_of(again) == values_of(problem)
