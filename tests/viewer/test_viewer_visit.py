"""A first visit in a real browser, and windows of phones and small screens."""

from __future__ import annotations

import json

import numpy as np
import pytest

from grasp_planner.viewer.ladder_card import OPEN

from .browser_page import Page, until

pytestmark = pytest.mark.slow


def test_a_first_visit_from_the_grasp_to_a_file_takes_few_actions(browser, viewer, tmp_path):
    """Open, skip the tour, change the number of motors, see the grasp get worse, plan it, send the file."""
    viewer.plan.enough.value = 1  # one grasp will do, so that the test is short
    done = []
    page = Page(browser, f"{viewer.url}/?fixedDpr=1", first_visit=True)
    done.append("opened")
    done.append(page.button("Skip the tour").click())
    done.append(page.tab("Synergies"))
    done.append(page.row("Synergies n_s").fill("1"))
    page.page.locator("[data-model='broken']").wait_for()
    done.append(page.tab("Plan"))
    done.append(page.button("Plan").click())
    page.page.locator("[data-model='met']").wait_for()
    until(lambda: not viewer.planning.busy)
    assert viewer.session.grasp.problem.n_synergies == 1
    done.append(page.tab("Share"))
    with page.page.expect_download() as download:
        done.append(page.button("Save the grasp (JSON)").click())
    saved = tmp_path / "grasp.json"
    download.value.save_as(saved)
    assert json.loads(saved.read_text())["feasible"]
    assert len(done) <= 12
    assert not page.page.get_by_text("That did not work").count()
    assert not viewer.share.last_error
    page.close()


@pytest.mark.parametrize("size", [(390, 844), (800, 600)])
def test_the_hand_is_in_sight_beside_the_panel_on_small_screens(browser, viewer, size):
    page = Page(browser, f"{viewer.url}/?fixedDpr=1", size=size)
    page.page.wait_for_function("window.graspViewerFit && window.graspViewerFit.changed")
    grasp = viewer.session.grasp
    points = (*grasp.contacts.points, np.array(grasp.palm_pose.translation))
    free = page.beside_panel()
    # The camera widens once the panel has its place.
    until(lambda: all(((at > 0.0) & (at < free)).all() for at in map(page.project, points)))
    panel = page.panel.bounding_box()
    assert panel["x"] >= 0.0
    assert panel["x"] + panel["width"] <= size[0] + 1.0
    page.close()


def test_on_a_phone_the_card_is_one_line_until_it_is_touched_and_the_hand_is_seen(browser, viewer):
    page = Page(browser, f"{viewer.url}/?fixedDpr=1", size=(390, 844), touch=True)
    page.page.wait_for_function("window.graspViewerFit && window.graspViewerFit.changed")
    until(lambda: OPEN not in viewer.card.widget.content)  # the card is not written again from here on
    card = page.page.locator("[data-model]")
    card.get_by_text("Closes and holds").wait_for()
    page.steady()
    title, rung = card.locator("> div").first, card.get_by_text("meets the model asked for")
    assert not rung.is_visible()
    assert card.bounding_box()["height"] < 60.0
    title.tap()
    rung.wait_for(state="visible")
    title.tap()
    rung.wait_for(state="hidden")
    with_hand = page.pixels()
    viewer.picture._hand._root.visible = False
    page.page.wait_for_function("() => !window.__viserMutable.nodeRefFromName['/hand'].visible")
    changed = np.abs(page.pixels().astype(int) - with_hand).max(axis=2) > 20
    viewer.picture._hand._root.visible = True
    across, down = page.beside_panel()
    free = changed[: int(down), : int(across)]
    assert free.mean() > 0.05, "of the window beside the panel"
    assert not free[-3:].any(), "the panel cuts nothing of the hand off"
    page.close()
