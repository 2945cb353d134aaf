"""Make the pictures of docs/viewer.md from the running viewer, in headless Chromium: every tab in its states.

Usage: python scripts/make_viewer_screenshots.py [folder]      (docs/images by default)

The browser is GRASP_PLANNER_CHROMIUM or /usr/bin/chromium; GRASP_PLANNER_BROWSER_GL names its renderer, which needs
no graphics card by default.
"""

from __future__ import annotations

import io
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from grasp_planner.batch import RunRows, parse_spec, run_batch
from grasp_planner.viewer import GraspViewer, export_html
from grasp_planner.viewer.ladder_card import OPEN
from grasp_planner.viewer.tour import REMEMBERED

BROWSER = os.environ.get("GRASP_PLANNER_CHROMIUM", "/usr/bin/chromium")
FLAGS = [
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    f"--use-angle={os.environ.get('GRASP_PLANNER_BROWSER_GL', 'swiftshader')}",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]
SIZE = {"width": 1360, "height": 850}
COLOURS = 256
"""Colours of a picture: as many as a small PNG has."""
READY = "() => window.__viserMutable && window.__viserMutable.nodeRefFromName['/object/mesh'] != null"
SCROLL = """(share) => document.querySelectorAll('[class*=ScrollArea-viewport], div').forEach(e => {
  if (e.scrollHeight > e.clientHeight + 40 && e.clientHeight > 300) e.scrollTop = share * e.scrollHeight;
})"""
CLEAN = (
    """() => document.querySelectorAll("[class*='Notification-root']").forEach(e => { e.style.display = 'none'; })"""
)
"""Hides notes such as that on software rendering, which no person sees."""
SPEC = {
    "defaults": {"object": "cylinder", "starts": 8, "enough": 1},
    "blocks": [{"product": {"object.radius": [0.025, 0.03], "task": ["force:+y", "force:+x"], "n_synergies": [8, 15]}}],
}


class Camera:
    """Takes the pictures."""

    def __init__(self, page: Page, viewer: GraspViewer, folder: Path) -> None:
        self.page, self.viewer, self.folder = page, viewer, folder

    def take(self, name: str, *, tab: str = "", scroll: float = 0.0, upto: str = "", wait: bool = True) -> None:
        """Write what the page shows as a small PNG.

        Args:
            name: Name of the picture.
            tab: The tab to open first.
            scroll: How far down its panel, from 0 to 1 …
            upto: … or the element that is to be seen.
            wait: Whether to wait until all rungs of the card are known.
        """
        if tab:
            self.page.get_by_role("tab", name=tab, exact=True).click()
        if wait:
            self.viewer.worker.drain(60.0)
            wait_for(lambda: OPEN not in self.viewer.card.widget.content)
            self.page.wait_for_timeout(2500)
        if upto:
            self.page.locator(upto).first.scroll_into_view_if_needed()
        else:
            self.page.evaluate(SCROLL, scroll)
        self.page.wait_for_timeout(300)
        self.page.evaluate(CLEAN)
        self.page.wait_for_timeout(200)
        path = self.folder / f"viewer_{name}.png"
        picture = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB")
        few = picture.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=3)
        few.save(path, optimize=True)
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def wait_for(condition: Callable[[], Any], timeout_s: float = 30.0) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("the viewer did not get there in time")
        time.sleep(0.05)


def show_grasp(camera: Camera) -> None:
    """Take the page as it opens, and with a contact selected."""
    viewer = camera.viewer
    camera.take("grasp", tab="Grasp")
    viewer.picture.clicked(("contact", 0))
    camera.take("contact")
    viewer.picture.clicked(("link", "index_medial"))
    camera.take("link")
    viewer.worker.submit(lambda: setattr(viewer.session, "selected", None))


def show_synergies(camera: Camera) -> None:
    """Take a moved synergy slider, the closing hand and the handles."""
    viewer, first = camera.viewer, camera.viewer.session.grasp
    viewer.compare.pin.value = True
    slider = viewer.synergies.sliders[0]
    slider.value = slider.value + 0.35
    camera.take("synergies", tab="Synergies")
    camera.take("joints", scroll=1.0)
    camera.take("compare", tab="Compare")
    viewer.compare.unpin.value = True
    viewer.worker.submit(lambda: viewer.session.show(first))
    viewer.worker.drain(60.0)
    viewer.synergies.move_hand.value = viewer.synergies.move_object.value = True
    camera.take("handles", tab="Synergies")
    viewer.synergies.move_hand.value = viewer.synergies.move_object.value = False


def show_push(camera: Camera) -> None:
    """Take a pushed grasp, and what the task costs."""
    why = camera.viewer.why
    why.push.value = True
    camera.take("why", tab="Why it holds")
    why.push.value = False
    camera.take("task", tab="Task")


def show_plan(camera: Camera) -> None:
    """Take a search while it runs, its ranked results, and the widgets of the problem."""
    viewer, first = camera.viewer, camera.viewer.session.grasp
    plan = viewer.plan
    plan.enough.value, plan.starts.value = 3, 8
    plan.from_here.value = True
    camera.page.get_by_role("tab", name="Plan", exact=True).click()
    plan.plan.value = True
    wait_for(lambda: viewer.planning.busy and len(plan._history) > 30, 60.0)
    camera.take("planning", upto=".u-legend", wait=False)
    wait_for(lambda: not viewer.planning.busy, 240.0)
    viewer.display.look.value = True
    wait_for(lambda: all(picture is not None for picture in plan.gallery.pictures), 60.0)
    camera.take("plan")
    camera.take("problem", scroll=1.0)
    plan.from_here.value = False
    viewer.worker.submit(lambda: viewer.session.show(first))


def show_preset(camera: Camera) -> None:
    """Take a figure of the paper: one synergy, whose ellipsoid is two plates."""
    viewer = camera.viewer
    viewer.plan.starts.value = 60
    viewer.compare.preset.value = "1 synergy, push along y"
    viewer.compare.show_preset.value = True
    wait_for(lambda: viewer.planning.busy)
    wait_for(lambda: not viewer.planning.busy, 240.0)
    viewer.display.look.value = True
    camera.take("one_synergy", tab="Compare")


def show_drawings(camera: Camera) -> None:
    """Take all that can be drawn: q_r as a ghost, torques, normals, names."""
    boxes = camera.viewer.display.boxes
    for name in ("reference_ghost", "torques", "normals", "labels", "margin"):
        boxes[name].value = True
    for name in ("force_ellipsoid", "cones"):
        boxes[name].value = False
    camera.take("drawings", tab="View")
    for name in ("reference_ghost", "torques", "normals", "labels", "margin"):
        boxes[name].value = False
    for name in ("force_ellipsoid", "cones"):
        boxes[name].value = True
    camera.take("share", tab="Share")


def show_layouts(camera: Camera) -> None:
    """Take the page in the dark, in a small window and on a phone."""
    dark = camera.viewer.display.dark
    dark.value = True
    camera.take("dark", tab="Synergies")
    dark.value = False
    for name, width, height in (("small", 800, 600), ("phone", 390, 844)):
        camera.page.set_viewport_size({"width": width, "height": height})
        camera.take(name, tab="Grasp")
    camera.page.set_viewport_size(SIZE)


def open_page(page: Page, viewer: GraspViewer) -> None:
    """Open the page and wait until it is drawn."""
    viewer.worker.drain(60.0)
    page.goto(f"{viewer.url}/?fixedDpr=1")
    page.wait_for_function(READY)


def take_viewer(page: Page, folder: Path, temporary: Path) -> None:
    """Take the viewer of one grasp in all its states, and its exported page."""
    viewer = GraspViewer()
    first = viewer.session.grasp
    open_page(page, viewer)
    camera = Camera(page, viewer, folder)
    for show in (show_grasp, show_synergies, show_push, show_drawings, show_layouts, show_plan, show_preset):
        show(camera)
        viewer.worker.drain(60.0)
    exported = temporary / "grasp.html"
    export_html(first, exported)
    page.goto(exported.as_uri())
    page.wait_for_function(READY)
    page.wait_for_timeout(2000)
    page.locator("input").first.fill("1.45")
    page.wait_for_timeout(2000)
    camera.take("export", wait=False)
    viewer.stop()


def take_run(page: Page, folder: Path) -> None:
    """Take the viewer of a batch run, in the working folder."""
    run = Path("cylinders")
    run_batch(parse_spec(SPEC), run, workers=1)
    viewer = GraspViewer(rows=RunRows(run))
    open_page(page, viewer)
    Camera(page, viewer, folder).take("run", tab="Run")
    viewer.stop()


def main() -> None:
    """Make all pictures."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/images").resolve()
    folder.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as name:
        browser = playwright.chromium.launch(executable_path=BROWSER, headless=True, args=FLAGS)
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(90_000)
        page.add_init_script(f"localStorage.setItem('{REMEMBERED}', 'seen')")
        os.chdir(name)
        take_viewer(page, folder, Path(name))
        take_run(page, folder)
        browser.close()


if __name__ == "__main__":
    main()
