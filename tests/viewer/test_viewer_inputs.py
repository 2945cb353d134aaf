"""Inputs of the page: committed when typing pauses, errors beside their field, choices that fit each other."""

import itertools
import shlex
from dataclasses import replace
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

import grasp_planner as gp
from grasp_planner.cli import plan as plan_command
from grasp_planner.cli.main import main
from grasp_planner.hand.description import hand_library
from grasp_planner.viewer.equivalent import command_text, python_text, what_is_lost
from grasp_planner.viewer.page_script import page_script
from grasp_planner.viewer.panels import widgets

from ..stored import stored
from .browser_page import until

FROM_PAGE = SimpleNamespace(client=object())


def settled(viewer):
    assert viewer.worker.drain(60.0)
    return viewer.session.problem


def test_typing_is_taken_when_it_pauses_and_enter_takes_it_at_once(monkeypatch):
    monkeypatch.setattr(widgets, "TYPING_S", 0.2)
    taken = []
    pause = widgets.Pause(lambda: taken.append(1))
    for _ in range(5):
        pause(FROM_PAGE)
    assert not taken
    until(lambda: taken, 10.0)
    assert len(taken) == 1
    pause(FROM_PAGE)
    pause.now()
    assert len(taken) == 2
    pause(SimpleNamespace(client=None))
    assert len(taken) == 3, "what the program sets holds at once"


def test_a_second_task_can_be_typed_letter_by_letter(viewer):
    text = "torque:+z"
    for end in range(1, len(text) + 1):
        viewer.problem.more.value = text[:end]
        settled(viewer)
        assert viewer.problem.more.value == text[:end], "what is typed stays"
        assert viewer.problem._more._complaint.visible == (end < len(text)), text[:end]
    assert [task.text for task in viewer.session.problem.tasks] == ["force:0,1,0", "torque:0,0,1"]
    assert not viewer.share.last_error


def test_another_task_leaves_the_hand_where_it_is(viewer, grasp):
    viewer.problem.more.value = "torque:+z"
    problem = settled(viewer)
    shown = viewer.session.grasp
    assert shown.problem is problem
    assert (shown.joint_angles == grasp.joint_angles).all()
    assert shown.feasible, "it still holds"
    assert len(shown.transmission_ratios) == 2


def test_an_error_stands_beside_its_field_and_goes_with_it(viewer):
    panel = viewer.problem.parameters
    before = viewer.session.problem
    panel.widgets["friction"].value = "-1"
    assert settled(viewer) == before
    complaint = panel._fields["friction"]._complaint
    assert complaint.visible
    assert "friction" in complaint.content
    panel.widgets["friction"].value = "0.7"
    assert settled(viewer).parameters.friction == 0.7
    assert not complaint.visible


@pytest.mark.slow
def test_every_hand_takes_every_shape_and_each_of_its_contact_sets(viewer):
    shapes = [kind for kind in viewer.problem.kind.options if kind != "mesh"]
    for name, kind in itertools.product(hand_library(), shapes):
        viewer.share.last_error = ""
        viewer.problem.kind.value = kind
        viewer.problem.hand.value = name
        problem = settled(viewer)
        assert (problem.hand.name, problem.grasp_object.kind) == (name, kind), viewer.share.last_error
        assert (viewer.problem.hand.value, viewer.problem.kind.value) == (name, kind), "shown is used"
        assert not viewer.share.last_error
    for name in hand_library():
        viewer.problem.hand.value = name
        settled(viewer)
        for chosen in viewer.problem.contact_set.options:
            viewer.problem.contact_set.value = chosen
            problem = settled(viewer)
            used = problem.contact_set or problem.hand.contact_set_names[0]
            assert used == viewer.problem.contact_set.value
        for count in (1, viewer.synergies.count.max):
            viewer.synergies.count.value = count
            problem = settled(viewer)
            assert problem.n_synergies == viewer.synergies.count.value == len(viewer.synergies.sliders) == count


def test_a_twist_brings_the_synergies_it_needs_and_says_so(viewer):
    viewer.problem.task_kind.value = "twist"
    problem = settled(viewer)
    assert problem.tasks[0].is_motion
    assert problem.n_synergies == viewer.synergies.count.value == 6
    assert "n_s is 6 now" in viewer.card.widget.content
    viewer.synergies.count.value = 2
    assert settled(viewer).n_synergies == 6
    assert viewer.synergies.count.value == 6, "shown is used"


def test_a_number_beyond_its_range_is_shown_as_it_is_used(viewer, client):
    handle = viewer.problem._sizes["radius"]
    client.set("radius", 77.0)
    until(lambda: viewer.session.problem.grasp_object.radius == handle.max)
    until(lambda: client.widget("radius")["props"].get("value", client.widget("radius").get("value")) == handle.max)


def problems():
    first = stored("clear").problem
    yield "default", gp.GraspProblem(first.hand, gp.Cylinder())
    yield "paper", gp.GraspProblem.paper(first.hand, gp.Sphere(radius=0.04), (gp.parse_task("torque:+z"),))
    yield "stored", first
    loads = gp.LoadCases(force=0.5, wrenches=((0.0, 0.0, -1.0, 0.0, 0.0, 0.0),), min_normal_force=0.2)
    parameters = gp.GraspParameters(friction=(0.8, 0.7, 0.8, 0.8, 0.8), gravity=(0.0, 1.0, -9.0))
    tasks = (gp.parse_task("force:+x"), gp.parse_task("torque:+y*0.5"))
    box = gp.Box(x=0.05, y=0.04, z=0.1)
    yield "many", gp.GraspProblem(first.hand, box, tasks, n_synergies=5, parameters=parameters, loads=loads)
    clearance = replace(gp.ClearanceOptions(), self_collision=False)
    some = ("thumb", "index", "middle")
    yield "few", gp.GraspProblem(first.hand, gp.Capsule(), clearance=clearance, contacts=some, contact_set="sphere")


PROBLEMS = dict(problems())


@pytest.mark.parametrize("name", PROBLEMS)
def test_command_and_python_plan_the_very_problem(name, monkeypatch):
    problem, planned = PROBLEMS[name], []

    def keep(found, count, **_):
        planned.append(found)
        raise KeyboardInterrupt

    monkeypatch.setattr(plan_command, "plan_grasps", keep)
    words = shlex.split(command_text(problem))
    assert words[0] == "grasp-planner"
    result = CliRunner().invoke(main, words[1:])
    assert planned == [problem], result.output
    lines = python_text(problem).splitlines()
    space = {}
    exec("\n".join(line for line in lines if "plan_grasp" not in line and "verdict" not in line), space)
    assert space["problem"] == problem
    assert not what_is_lost(problem)


def test_the_search_is_part_of_the_command():
    text = command_text(PROBLEMS["default"], gp.PlannerOptions(starts=7), seed=3)
    assert text.endswith("--starts 7 --seed 3")


def test_the_script_of_the_page_has_a_title_and_ends_no_script():
    script = page_script("</script><b>")
    assert "</script>" not in script
    assert "TITLE" not in script
    assert "GONE" not in script
    assert "LOST" not in script
