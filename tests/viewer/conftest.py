"""Fixtures of the viewer's tests: one grasp, one viewer, a client without a browser, a real browser."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from grasp_planner import ClearanceOptions, Cylinder, Grasp, GraspProblem, load_hand
from grasp_planner.viewer import GraspViewer, first_grasp
from grasp_planner.viewer.scene.draw_grasp import DisplayOptions

from .browser_page import Page
from .protocol_client import ProtocolClient

BROWSER = os.environ.get("GRASP_PLANNER_CHROMIUM") or shutil.which("chromium") or "/usr/bin/chromium"
REQUIRED = os.environ.get("GRASP_PLANNER_REQUIRE_BROWSER") == "1"
FLAGS = (
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    f"--use-angle={os.environ.get('GRASP_PLANNER_BROWSER_GL', 'swiftshader')}",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
    # Nothing but this machine can be reached.
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
)


@pytest.fixture(scope="session")
def grasp() -> Grasp:
    """The feasible grasp the viewer opens with."""
    found = first_grasp()
    assert found.feasible
    return found


@pytest.fixture(scope="session")
def easy_problem() -> GraspProblem:
    """A problem that is planned within a second."""
    return GraspProblem.paper(load_hand(), Cylinder(), n_synergies=15, clearance=ClearanceOptions.off())


@pytest.fixture(scope="session")
def shared_viewer(grasp):
    """One viewer for all tests that leave it as it was."""
    viewer = GraspViewer(grasp)
    yield viewer
    viewer.stop()


@pytest.fixture
def viewer(shared_viewer, grasp):
    """The viewer, showing the first grasp again."""
    shared_viewer.planning.cancel()
    shared_viewer.worker.submit(lambda: shared_viewer.worker.animate(None))

    def reset():
        session = shared_viewer.session
        session.results, session.pinned, session.seed, session.selected = [], None, None, None
        session.automatic_squeeze = True
        session.show(grasp, "test")
        # A page looks from where this points, and a busy machine may come to it after the page has.
        shared_viewer.picture.aim(grasp)

    shared_viewer.worker.submit(reset)
    shared_viewer.synergies.move_hand.value = shared_viewer.synergies.move_object.value = False
    for name, box in shared_viewer.display.boxes.items():
        box.value = bool(getattr(DisplayOptions(), name))
    assert shared_viewer.worker.drain()
    shared_viewer.share.last_error = ""
    return shared_viewer


@pytest.fixture
def client(viewer):
    """A client that speaks the page's protocol."""
    with ProtocolClient(viewer.server.get_port()) as connected:
        yield connected


@pytest.fixture(scope="session")
def browser():
    """Headless Chromium; skipped without one, unless it is required."""
    if not Path(BROWSER).exists():
        if REQUIRED:
            pytest.fail(f"no browser at {BROWSER}, but GRASP_PLANNER_REQUIRE_BROWSER=1")
        pytest.skip("no Chromium")
    if REQUIRED:
        from playwright import sync_api
    else:
        sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=BROWSER, headless=True, args=list(FLAGS))
        yield running
        running.close()


@pytest.fixture
def page(browser, viewer):
    opened = Page(browser, f"{viewer.url}/?fixedDpr=1")
    yield opened
    opened.close()
