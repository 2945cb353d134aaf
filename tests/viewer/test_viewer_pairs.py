"""All pairs of hand, number of synergies, shape and contact set on a real page: what is shown is what is used."""

from __future__ import annotations

import itertools
import os

import pytest

from grasp_planner import load_hand
from grasp_planner.hand.description import hand_library

from .browser_page import until

pytestmark = pytest.mark.slow

EVERY = 1 if os.environ.get("GRASP_PLANNER_ALL_PAIRS") == "1" else 8
"""Every which of the cases is tried; all of them take minutes."""
SHAPES = ("sphere", "cylinder", "box", "capsule", "ellipsoid")
COUNTS = ("few", "some", "all")
SETS = ("first", "last")


def all_pairs():
    """Return cases such that every two values of different choices meet in one of them, found greedily."""
    everything = list(itertools.product(hand_library(), COUNTS, SHAPES, SETS))
    missing = {pair for case in everything for pair in itertools.combinations(enumerate(case), 2)}
    cases = []
    while missing:
        best = max(everything, key=lambda case: len(missing & set(itertools.combinations(enumerate(case), 2))))
        missing -= set(itertools.combinations(enumerate(best), 2))
        cases.append(best)
    return cases


CASES = all_pairs()


def test_the_cases_are_few_and_meet_all_pairs():
    met = {pair for case in CASES for pair in itertools.combinations(enumerate(case), 2)}
    everything = itertools.product(hand_library(), COUNTS, SHAPES, SETS)
    assert met == {pair for case in everything for pair in itertools.combinations(enumerate(case), 2)}
    assert len(CASES) < 2 * len(list(hand_library())) * len(SHAPES)


def test_what_the_page_shows_is_what_is_used(page, viewer):
    problem = viewer.problem
    for hand, count, shape, contacts in CASES[::EVERY]:
        problem.hand.value, problem.kind.value = hand, shape
        assert viewer.worker.drain(60.0)
        names = load_hand(hand).contact_set_names
        problem.contact_set.value = names[0 if contacts == "first" else -1]
        most = viewer.synergies.count.max
        wanted = {"few": 1, "some": min(3, most), "all": most}[count]
        viewer.synergies.count.value = wanted
        assert viewer.worker.drain(60.0)
        used = viewer.session.problem
        assert (used.hand.name, used.grasp_object.kind, used.n_synergies) == (hand, shape, wanted)
        page.tab("Plan")
        shown = {"Hand": hand, "Shape": shape, "Contacts": used.contact_set or names[0]}
        for label, value in shown.items():
            until(lambda label=label, value=value: page.row(label).input_value() == value, 20.0)
        page.tab("Synergies")
        until(lambda used=used: page.row("Synergies n_s").input_value() == str(used.n_synergies), 20.0)
        assert page.page.get_by_text(f"σ{used.n_synergies}", exact=True).first.is_visible()
        assert not page.page.get_by_text("That did not work").count()
        assert not viewer.share.last_error
