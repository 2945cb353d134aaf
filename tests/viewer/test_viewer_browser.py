"""The page in a real browser: headless Chromium with software rendering."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

from grasp_planner.viewer import GraspViewer, export_html

from .browser_page import TURN, TURNED, Page, until

pytestmark = pytest.mark.slow


def test_the_page_opens_with_a_grasp_and_its_sliders_move_the_hand(page, viewer):
    page.page.locator("[data-model='met']").wait_for()
    page.tab("Synergies")
    joint = "/hand/joint_1/joint_2/joint_3"
    before = page.page.evaluate(TURN, joint)
    page.row("σ1").fill("-0.6")
    page.page.wait_for_function(TURNED, arg=[joint, before])
    page.page.locator("[data-model='broken']").wait_for()
    assert viewer.session.live.sigma[0] == -0.6
    page.row("σ1").blur()
    page.page.keyboard.press("Control+z")
    page.page.locator("[data-model='met']").wait_for()
    page.page.keyboard.press("Control+Shift+Z")
    page.page.locator("[data-model='broken']").wait_for()


def test_plan_shows_progress_and_a_result_and_can_be_cancelled(page, viewer, easy_problem):
    viewer.worker.submit(lambda: viewer.session.set_problem(easy_problem))
    viewer.plan.enough.value, viewer.plan.starts.value = 1, 40
    page.tab("Plan")
    page.button("Plan").click()
    page.page.locator(".uplot").first.wait_for()
    # The page may still say "done" of an earlier search.
    until(lambda: viewer.session.results and not viewer.planning.busy, 150.0)
    page.page.get_by_text("done").wait_for(timeout=90_000)
    viewer.plan.enough.value, viewer.plan.starts.value = 50, 500
    page.button("Plan").click()
    until(lambda: viewer.planning.busy)
    page.button("Cancel").click()
    page.page.get_by_text("cancelled").first.wait_for()
    assert not viewer.planning.busy


def test_a_preset_of_the_paper_is_one_click(page, viewer):
    viewer.compare.preset.value = next(name for name in viewer.compare.preset.options if name.startswith("15"))
    viewer.plan.enough.value, viewer.plan.starts.value = 1, 8
    page.tab("Compare")
    page.button("Plan this figure").click()
    until(lambda: viewer.session.results and not viewer.planning.busy, 120.0)
    assert viewer.session.problem.n_synergies == 15
    assert viewer.session.results


def test_files_go_in_and_out(page, viewer, tmp_path):
    page.tab("Share")
    with page.page.expect_download() as download:
        page.button("Save the grasp (JSON)").click()
    saved = tmp_path / "saved.json"
    download.value.save_as(saved)
    assert json.loads(saved.read_text())["feasible"]
    chooser = page.page.locator("input[type=file]")
    chooser.set_input_files({"name": "../x.json", "mimeType": "application/json", "buffer": b'{"a": 1}'})
    page.page.get_by_text("Not a grasp file").wait_for()
    chooser.set_input_files(saved)
    page.page.get_by_text("opened from a file").wait_for()
    with page.page.expect_download(timeout=90_000) as download:
        page.button("Save as a web page (HTML)").click()
    download.value.save_as(tmp_path / "page.html")
    assert "data-model='met'" in (tmp_path / "page.html").read_text()
    with page.page.expect_download(timeout=90_000) as download:
        page.button("Save a picture (PNG)").click()
    picture = tmp_path / "picture.png"
    download.value.save_as(picture)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_letters_tell_what_they_mean_and_what_is_dropped_is_opened(page, viewer):
    page.page.locator("th[data-term='f_n']").wait_for()
    assert "normal" in page.page.locator("th[data-term='f_n']").get_attribute("title")
    cube = trimesh.creation.box((40.0, 40.0, 40.0)).export(file_type="stl")
    viewer.files.unit.value = "millimetres"
    page.page.evaluate(
        """(bytes) => {
          const data = new DataTransfer();
          data.items.add(new File([new Uint8Array(bytes)], 'cube.stl'));
          document.body.dispatchEvent(new DragEvent('drop', {dataTransfer: data, bubbles: true, cancelable: true}));
        }""",
        list(cube),
    )
    until(lambda: viewer.session.problem.grasp_object.kind == "mesh", 90.0)
    assert viewer.session.problem.grasp_object.half_extents.max() < 0.021
    page.page.get_by_text("not planned yet").wait_for()
    viewer.files.unit.value = "metres"


def test_a_copied_link_opens_what_was_shown(page, viewer, grasp):
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.tab("Share")
    page.button("command").click()
    page.page.get_by_text("Copied", exact=True).wait_for()
    assert page.page.evaluate("navigator.clipboard.readText()").startswith("grasp-planner plan --hand")
    page.button("link").click()
    page.page.get_by_text("Link copied").wait_for()
    link = page.page.evaluate("navigator.clipboard.readText()")
    assert link.startswith(f"{viewer.url}/?hand=")
    viewer.synergies.count.value = 1
    viewer.worker.drain()
    page.page.goto(link)
    page.page.get_by_text("opened from a link").wait_for()
    until(lambda: viewer.session.grasp.feasible)
    assert viewer.session.problem == grasp.problem
    page.page.wait_for_function("window.location.search === ''")


def test_clicking_a_contact_shows_its_numbers(page, viewer):
    viewer.display.boxes["cones"].value = viewer.display.boxes["forces"].value = False
    viewer.worker.drain()
    place = page.project(viewer.session.grasp.contacts.points[0])
    page.hover(place)
    page.page.mouse.click(*place)
    until(lambda: viewer.session.selected is not None, 20.0)
    viewer.display.boxes["cones"].value = viewer.display.boxes["forces"].value = True
    kind, which = viewer.session.selected
    name = viewer.session.problem.frames[which].name if kind == "contact" else which
    page.page.get_by_text(f"{kind.capitalize()} {name}").first.wait_for()


def test_a_page_of_another_origin_can_not_connect(browser, viewer):
    context = browser.new_context()
    page = context.new_page()
    # A document of another origin: its requests carry "Origin: null".
    page.goto("data:text/html,<title>foreign</title>")
    outcome = page.evaluate(
        """(url) => new Promise((done) => {
          const socket = new WebSocket(url, 'viser-v1.1.1');
          socket.onopen = () => done('open'); socket.onerror = () => done('refused');
        })""",
        viewer.url.replace("http", "ws"),
    )
    context.close()
    assert outcome == "refused"


def test_an_exported_page_opens_offline_with_numbers_and_animation(browser, grasp, tmp_path):
    path = tmp_path / "grasp.html"
    export_html(grasp, path, "A <b>title</b>")
    opened = Page(browser, path.as_uri())
    opened.page.locator("#grasp-numbers").wait_for()
    text = opened.page.locator("#grasp-numbers").inner_text()
    assert "A <b>title</b>" in text
    assert "cylinder, 60 × 60 × 150 mm, 200 g" in text
    assert "force along +y" in text
    assert "meets the model asked for" in text
    assert "thumb" in text
    # The time box of the playback bar: from the open hand to the closed one.
    time_box = opened.page.locator("input").first
    joint = "/hand/joint_1/joint_2/joint_3"

    def turn(seconds):
        time_box.fill(seconds)
        opened.steady()
        return np.array(opened.page.evaluate(TURN, joint))

    # The first time the page may still be drawing what it began with.
    until(lambda: np.abs(turn("0.1") - turn("1.4")).max() > 0.005)
    opened.close()


def test_a_second_task_is_typed_key_by_key_and_the_page_has_a_title(browser, viewer):
    page = Page(browser, viewer.url)
    page.page.wait_for_function("document.title === 'Grasp viewer'")
    assert not page.page.locator(".tabler-icon-adjustments").is_visible(), "nothing for developers"
    page.tab("Task")
    field = page.row("More tasks")
    field.click()
    field.press_sequentially("torque:+z", delay=120)
    field.press("Enter")
    until(lambda: len(viewer.session.problem.tasks) == 2)
    assert field.input_value() == "torque:+z"
    assert not viewer.share.last_error
    page.close()


def test_the_page_says_when_the_viewer_has_ended(browser, grasp):
    own = GraspViewer(grasp)
    page = Page(browser, own.url)
    note = page.page.locator("#connection-note")
    assert not note.is_visible()
    own.stop()
    note.wait_for(state="visible")
    assert "has ended" in note.inner_text()
    page.context.close()
