"""Series of problems side by side, the glossary and the tour."""

from __future__ import annotations

import json
import re

import pytest

import grasp_planner as gp
from grasp_planner.analysis.ladder import RUNGS
from grasp_planner.viewer import text
from grasp_planner.viewer.comparisons import HUMAN_SETS, SERIES, paper_cases, set_cases, synergy_cases
from grasp_planner.viewer.glossary import TERMS, glossary_table
from grasp_planner.viewer.panels.chapters import ABOUT, CHAPTERS
from grasp_planner.viewer.planning import PlanningProcess
from grasp_planner.viewer.tour import STEPS, tour_script
from grasp_planner.viewer.verdict_card import headline

from .test_viewer_app import settle


def test_the_series_differ_in_one_thing(grasp):
    problem = grasp.problem
    counts = [case.problem.n_synergies for case in synergy_cases(problem)]
    assert counts[0] == 1
    assert counts[-1] == 15
    assert counts == sorted(set(counts))
    sets = set_cases(problem)
    assert {case.problem.synergy_set for case in sets} >= {"santello", "native"}
    for case in sets:
        columns = problem.hand.synergies(case.problem.synergy_set).n_synergies
        assert case.problem.n_synergies == min(problem.n_synergies, columns)
    assert all(("(human)" in case.label) == (case.problem.synergy_set in HUMAN_SETS) for case in sets)
    assert all(("made" in case.label) == (case.problem.synergy_set not in HUMAN_SETS) for case in sets)
    for case in (*synergy_cases(problem), *sets):
        assert case.problem.grasp_object == problem.grasp_object
        assert case.problem.tasks == problem.tasks
    assert [case.problem.n_synergies for case in paper_cases(problem)].count(15) == 2


def test_human_sets_are_those_that_were_carried_over():
    names = set(gp.load_hand().synergy_set_names)
    assert set(HUMAN_SETS) <= names
    assert not any(name.startswith("native") for name in HUMAN_SETS)


def test_a_series_is_planned_one_after_the_other_and_its_cards_show_it(viewer, grasp, monkeypatch):
    """The search itself is another matter: here every problem is answered at once, the second by nothing feasible."""
    asked = []

    def answer(self, request, events):
        asked.append(request)
        q = grasp.joint_angles - 0.2 * (len(asked) == 2)
        found = gp.Grasp(request.problem, q, grasp.palm_pose, [0.0] * request.problem.n_synergies)
        events.best([found])
        events.end("done" if len(asked) < 4 else "cancelled", "")
        return True

    monkeypatch.setattr(PlanningProcess, "start", answer)
    viewer.compare.series.value = next(iter(SERIES))
    viewer.compare.plan_series.value = True
    settle(viewer)
    cases = viewer.comparison.cases
    assert [request.problem for request in asked] == [case.problem for case in cases][:4]
    assert all(request.options.enough == 1 and request.options.time_limit_s <= 20.0 for request in asked)
    buttons = viewer.compare.gallery.buttons
    assert [button.label.partition(" · ")[0] for button in buttons] == [case.label for case in cases]
    assert "does not meet" in buttons[1].label
    assert "not planned yet" in buttons[4].label
    assert viewer.compare.stop.disabled
    assert not viewer.compare.plan_series.disabled
    buttons[1].value = True
    settle(viewer)
    assert viewer.session.grasp is viewer.comparison.found[1]
    assert buttons[1].color == "green"
    buttons[4].value = True
    settle(viewer)
    assert viewer.session.grasp is viewer.comparison.found[1], "nothing to show there yet"


@pytest.mark.parametrize("motion", [False, True])
def test_every_letter_of_the_card_and_every_rung_is_in_the_glossary(grasp, motion):
    known = {word for term, _ in TERMS for word in re.split(r", ", term)}
    problem = gp.GraspProblem(grasp.problem.hand, grasp.problem.grasp_object, (gp.parse_task("twist:+y"),), 6)
    shown = gp.Grasp(problem, grasp.joint_angles, grasp.palm_pose, [0.0] * 6) if motion else grasp
    assert {symbol for symbol, _, _ in headline(shown)} <= known
    assert set(RUNGS[1:]) - {"holds a push from any side"} <= known
    heads = re.findall(
        r"\|([^|\n]+)", text.contact_table(grasp).splitlines()[0] + text.joint_table(grasp).splitlines()[0]
    )
    letters = {head.split()[0] for head in heads if head.strip()} - {"contact", "joint", "margin", "gap", "friction"}
    assert letters <= known


def test_terms_are_named_once_and_stand_in_the_table():
    assert len({term for term, _ in TERMS}) == len(TERMS)
    assert all(term in glossary_table() and meaning in glossary_table() for term, meaning in TERMS)


def test_the_tour_goes_through_the_chapters_in_their_order_and_its_script_is_whole():
    assert tuple(chapter for chapter, _ in STEPS) == CHAPTERS == tuple(ABOUT)
    script = tour_script()
    assert "__" not in script
    assert json.dumps(STEPS) in script
    assert "</script" not in script


@pytest.mark.slow
def test_the_tour_is_shown_on_a_first_visit_and_never_again(browser, shared_viewer):
    from .browser_page import Page

    page = Page(browser, f"{shared_viewer.url}/?fixedDpr=1", first_visit=True)
    tour = page.page.locator("#tour")
    tour.get_by_text("1 of 6").wait_for()
    page.button("Next").click()
    tour.get_by_text(STEPS[1][1]).wait_for()
    page.page.locator("[role=tab][aria-selected=true]").get_by_text(STEPS[1][0]).wait_for()
    page.button("Skip the tour").click()
    tour.wait_for(state="detached")
    page.page.reload()
    page.page.get_by_role("tab", name="Guide").click()
    # The tour begins by a timer of 300 ms, which fires before one that is set later.
    page.page.evaluate("() => new Promise((done) => setTimeout(done, 301))")
    assert not tour.is_visible()
    page.button("Show the tour").click()
    tour.get_by_text("1 of 6").wait_for()
    page.close()
