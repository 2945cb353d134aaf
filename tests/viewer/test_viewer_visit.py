"""A first visit in a real browser, and windows of phones and small screens."""

from __future__ import annotations

import json

import numpy as np
import pytest

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
    page.page.wait_for_timeout(1500)
    panel = page.page.locator(".mantine-Paper-root:has([role=tablist])").bounding_box()
    below = panel["width"] > 0.9 * size[0]
    right, bottom = (size[0], panel["y"]) if below else (panel["x"], size[1])
    grasp = viewer.session.grasp
    for point in (*grasp.contacts.points, np.array(grasp.palm_pose.translation)):
        x, y = page.project(point)
        assert 0.0 < x < right
        assert 0.0 < y < bottom
    assert panel["x"] >= 0.0
    assert panel["x"] + panel["width"] <= size[0] + 1.0
    page.close()
