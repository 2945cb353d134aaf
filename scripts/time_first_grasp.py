"""Time the way of a newcomer: from `git clone` to the first grasp in the browser, by the commands of the README.

Clones into a new folder, runs `scripts/plan` (which makes a new virtual environment), opens the result with
`grasp-planner view` in headless Chromium, and waits until hand and object are drawn. Needs the extra "dev", a
Chromium and pip's index. Usage: ``python scripts/time_first_grasp.py [REPOSITORY]``

The browser is GRASP_PLANNER_CHROMIUM or /usr/bin/chromium; GRASP_PLANNER_BROWSER_GL names its renderer.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path

from playwright.sync_api import sync_playwright

BROWSER = os.environ.get("GRASP_PLANNER_CHROMIUM", "/usr/bin/chromium")
FLAGS = [
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    f"--use-angle={os.environ.get('GRASP_PLANNER_BROWSER_GL', 'swiftshader')}",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]
NODES = "() => window.__viserMutable && ['/object/mesh', '/hand'].every((name) => NODE(name) != null)".replace(
    "NODE(name)", "window.__viserMutable.nodeRefFromName[name]"
)
"""Whether object and hand are in the scene of the page."""


def timed(what: str, action: Callable[[], None]) -> None:
    """Run a step and print how long it took."""
    began = time.perf_counter()
    action()
    sys.stdout.write(f"{what}: {time.perf_counter() - began:.1f} s\n")
    sys.stdout.flush()


def look(clone: Path) -> None:
    """Open the planned grasp in the viewer and wait until it is drawn."""
    command = [".venv/bin/grasp-planner", "view", "grasp.json", "--no-open", "--port", "0"]
    viewer = subprocess.Popen(command, cwd=clone, stdout=subprocess.PIPE, text=True)
    assert viewer.stdout is not None
    try:
        found = re.search(r"http://[^;\s]+", viewer.stdout.readline())
        assert found is not None, "the viewer named no address"
        with urllib.request.urlopen(found.group(), timeout=60) as answer:
            assert answer.status == 200
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=BROWSER, headless=True, args=FLAGS)
            page = browser.new_page(viewport={"width": 1360, "height": 850})
            page.set_default_timeout(120_000)
            page.goto(found.group())
            page.wait_for_function(NODES)
            page.screenshot(path=clone / "first_grasp_in_browser.png")
            browser.close()
    finally:
        viewer.send_signal(signal.SIGINT)
        viewer.wait(timeout=30)


def main() -> None:
    """Time every step."""
    source = sys.argv[1] if len(sys.argv) > 1 else str(Path(__file__).parents[1])
    environment = {name: value for name, value in os.environ.items() if name not in ("VIRTUAL_ENV", "PYTHONPATH")}
    with tempfile.TemporaryDirectory() as folder:
        clone = Path(folder) / "grasp_planner"

        def everything() -> None:
            timed("git clone", lambda: run(["git", "clone", "--quiet", source, str(clone)], Path(folder)))
            timed("set-up: scripts/setup", lambda: run(["scripts/setup"], clone))
            timed("scripts/plan", lambda: run(["scripts/plan"], clone))
            timed("viewer and browser", lambda: look(clone))

        def run(command: list[str], where: Path) -> None:
            subprocess.run(command, cwd=where, env=environment, check=True, stdout=subprocess.DEVNULL)

        timed("from clone to the first grasp in the browser", everything)


if __name__ == "__main__":
    main()
