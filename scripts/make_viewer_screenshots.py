"""Make the pictures of docs/viewer.md from the running viewer, in headless Chromium.

Usage: python scripts/make_viewer_screenshots.py [folder]      (docs/images by default)

The browser is GRASP_PLANNER_CHROMIUM or /usr/bin/chromium; GRASP_PLANNER_BROWSER_GL names its renderer.
"""

from __future__ import annotations

import io
import os
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from grasp_planner.viewer import GraspViewer, export_html

BROWSER = os.environ.get("GRASP_PLANNER_CHROMIUM", "/usr/bin/chromium")
FLAGS = [
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    f"--use-angle={os.environ.get('GRASP_PLANNER_BROWSER_GL', 'gl-egl')}",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]
SIZE = {"width": 1360, "height": 850}
READY = "() => window.__viserMutable && window.__viserMutable.nodeRefFromName['/object/mesh'] != null"


def settle(viewer: GraspViewer, page: Page) -> None:
    """Wait until everything has been drawn."""
    viewer.worker.drain(60.0)
    page.wait_for_timeout(2500)


def save(page: Page, path: Path) -> None:
    """Write what the page shows as a small PNG."""
    toast = page.get_by_text("Software WebGL rendering")
    if toast.count():
        toast.first.locator("xpath=ancestor::div[contains(@class,'Notification-root')]").locator("button").click()
        page.wait_for_timeout(800)
    picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    picture.save(path, optimize=True)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def tab(page: Page, name: str) -> None:
    """Open a tab."""
    page.get_by_role("tab", name=name).click()


def show_synergies(viewer: GraspViewer, page: Page) -> None:
    """Move a synergy slider, with the grasp from before pinned as a ghost."""
    tab(page, "Synergies")
    viewer.grasp_panel.pin.value = True
    slider = viewer.synergies.sliders[0]
    slider.value = slider.value + 0.35
    settle(viewer, page)


def show_plan(viewer: GraspViewer, page: Page) -> None:
    """Plan from the pinned grasp, and show the ranked results."""
    first = viewer.session.pinned or viewer.session.grasp
    viewer.worker.submit(lambda: viewer.session.show(first))
    viewer.worker.drain(60.0)
    viewer.grasp_panel.unpin.value = True
    tab(page, "Plan")
    viewer.plan.from_here.value = True
    viewer.plan.enough.value, viewer.plan.starts.value = 2, 5
    viewer.plan.plan.value = True
    wait_for(lambda: viewer.planning.busy)
    wait_for(lambda: not viewer.planning.busy, 240.0)
    settle(viewer, page)


def show_one_synergy(viewer: GraspViewer, page: Page) -> None:
    """Show the ellipsoid of a hand with a single motor command: two plates."""
    tab(page, "View")
    problem = replace(viewer.session.problem, n_synergies=1)
    viewer.worker.submit(lambda: viewer.session.set_problem(problem))
    settle(viewer, page)


def wait_for(condition: Callable[[], Any], timeout_s: float = 30.0) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + timeout_s
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("the viewer did not get there in time")
        time.sleep(0.05)


def main() -> None:
    """Make all pictures."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/images")
    folder.mkdir(parents=True, exist_ok=True)
    viewer = GraspViewer()
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as temporary:
        browser = playwright.chromium.launch(executable_path=BROWSER, headless=True, args=FLAGS)
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(90_000)
        page.goto(f"{viewer.url}/?fixedDpr=1")
        page.wait_for_function(READY)
        settle(viewer, page)
        save(page, folder / "viewer_grasp.png")
        for name, show in (("synergies", show_synergies), ("plan", show_plan), ("one_synergy", show_one_synergy)):
            show(viewer, page)
            save(page, folder / f"viewer_{name}.png")
        exported = Path(temporary) / "grasp.html"
        export_html(viewer.session.results[0] if viewer.session.results else viewer.session.grasp, exported)
        page.goto(exported.as_uri())
        page.wait_for_function(READY)
        page.wait_for_timeout(4000)
        save(page, folder / "viewer_export.png")
        browser.close()
    viewer.stop()


if __name__ == "__main__":
    main()
