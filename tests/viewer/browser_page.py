"""A page of the viewer in headless Chromium, with what it complains about."""

from __future__ import annotations

import io
import time

import numpy as np
from PIL import Image

from grasp_planner.viewer.tour import REMEMBERED

TOLERATED = (
    "THREE.Clock: This module has been deprecated",
    "KHR_parallel_shader_compile",
    "Unable to preventDefault inside passive event listener",
    "(OK) Tried to remove non-existent component",  # a page that opens while controls are made anew
)
"""What the page's libraries say on the console; nothing else may be an error or a warning."""
DRIVER_WARNINGS = (
    "GPU stall due to ReadPixels",
    "GL Driver Message",
    "glDrawElementsInstanced: Vertex shader input type does not match",
)
"""Warnings of software rendering, which no person sees; the last one where many copies of a mesh are drawn in the frame
in which they are made, a fault of the library that draws them (agargaro/instanced-mesh, issue 93)."""

READY = """(names) => {
  const view = window.__viserMutable, tree = window.__viserSceneTree;
  if (!view || !tree || !view.scene || view.messageQueue.length) return false;
  return names.every((name) => view.nodeRefFromName[name]) && window.__viserTestpoints.rendererInfo.render.frame > 0;
}"""

TURN = """(name) => window.__viserMutable.nodeRefFromName[name].quaternion.toArray()"""

TURNED = """([name, before]) => window.__viserMutable.nodeRefFromName[name].quaternion.toArray()
  .some((value, i) => Math.abs(value - before[i]) > 0.005)"""
"""Whether a joint is not where it was."""

STEADY = """async (frames) => {
  const view = window.__viserMutable;
  let last = '', same = 0;
  while (same < frames) {
    await new Promise(requestAnimationFrame);
    const matrices = [view.camera.matrixWorld, view.camera.projectionMatrix];
    const now = matrices.map((matrix) => matrix.elements.join()).join();
    same = now === last && !view.messageQueue.length ? same + 1 : 0;
    last = now;
  }
}"""
"""Waits until the camera has not moved and nothing was left to draw for some frames."""

PROJECT = """(p) => {
  const view = window.__viserMutable, root = view.nodeRefFromName[''];
  const v = view.camera.position.clone().set(p[0], p[1], p[2]);
  if (root) v.applyMatrix4(root.matrixWorld);
  v.project(view.camera);
  const r = view.canvas.getBoundingClientRect();
  return [r.left + (v.x + 1) / 2 * r.width, r.top + (1 - v.y) / 2 * r.height];
}"""


class Page:
    """A browser page with what it complains about."""

    def __init__(
        self, browser, url, wait_for=("/object/mesh", "/hand"), first_visit=False, size=(1100, 760), touch=False
    ):
        self.context = browser.new_context(
            viewport={"width": size[0], "height": size[1]}, accept_downloads=True, has_touch=touch
        )
        self.context.set_default_timeout(180_000)
        if not first_visit:
            self.context.add_init_script(f"try {{ localStorage.setItem('{REMEMBERED}', 'seen') }} catch (error) {{}}")
        self.page = self.context.new_page()
        self.complaints, self.failed, self.foreign = [], [], []
        self.page.on("console", self._on_console)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("requestfailed", lambda request: self.failed.append(request.url))
        self.page.on("request", self._on_request)
        self.own = url.split("?")[0].rstrip("/")
        self.page.goto(url)
        self.page.wait_for_function(READY, arg=list(wait_for), timeout=90_000)

    def _on_console(self, message):
        known = (*TOLERATED, *DRIVER_WARNINGS) if message.type == "warning" else TOLERATED
        if message.type in ("error", "warning") and not any(words in message.text for words in known):
            self.complaints.append(message.text)

    def _on_request(self, request):
        if not request.url.startswith((self.own, "blob:", "data:")):
            self.foreign.append(request.url)

    def row(self, label):
        """Return the number box of a widget."""
        path = f"//label[normalize-space()='{label}']/ancestor::div[contains(@class,'Flex-root')][1]"
        return self.page.locator(f"xpath={path}").locator("input:not([type=hidden])")

    @property
    def panel(self):
        """The panel with the tabs."""
        return self.page.locator(".mantine-Paper-root:has([role=tablist])")

    def beside_panel(self):
        """Return how far right and down the picture is free of the panel [pixels]."""
        size, box = self.page.viewport_size, self.panel.bounding_box()
        below = box["width"] > 0.9 * size["width"]
        return np.array([size["width"], box["y"]] if below else [box["x"], size["height"]])

    def pixels(self):
        """Return what is on the screen once it stands still, of shape (height, width, 3)."""
        self.steady()
        return np.array(Image.open(io.BytesIO(self.page.screenshot())).convert("RGB"))

    def tab(self, name):
        """Open a tab."""
        self.page.get_by_role("tab", name=name).click()

    def button(self, name):
        """Return a button."""
        return self.page.get_by_role("button", name=name, exact=True)

    def steady(self, frames=5):
        """Wait until the picture stands still."""
        self.page.evaluate(STEADY, frames)

    def project(self, point):
        """Return where a point of the scene is on the screen [pixels]."""
        return np.array(self.page.evaluate(PROJECT, [float(value) for value in point]))

    def hover(self, place):
        """Put the mouse somewhere and let the page notice what lies under it."""
        # The browser's notes, such as that on software rendering, lie over the scene for a while.
        self.page.evaluate(
            "document.querySelectorAll(\"[class*='Notification']\").forEach(n => { n.style.pointerEvents = 'none'; })"
        )
        mouse = self.page.mouse
        mouse.move(place[0] - 3.0, place[1])
        self.steady()
        mouse.move(*place)
        self.steady()

    def drag(self, start, end):
        """Drag with the left button from one place of the screen to another."""
        self.hover(start)
        self.page.mouse.down()
        self.steady()
        self.page.mouse.move(*end, steps=12)
        self.steady()
        self.page.mouse.up()

    def track(self, label):
        """Return where the track of a slider begins and ends on the screen [pixels]."""
        name = self.page.locator(f"xpath=//label[normalize-space()='{label}']").get_attribute("for")
        box = self.page.locator(f'[id="{name}"] .mantine-Slider-trackContainer').bounding_box()
        y = box["y"] + box["height"] / 2.0
        return np.array([box["x"], y]), np.array([box["x"] + box["width"], y])

    def swipe(self, start, end, steps=12):
        """Draw a finger from one place of the screen to another."""
        finger = self.context.new_cdp_session(self.page)
        for share in np.linspace(0.0, 1.0, steps + 1):
            x, y = start + share * (end - start)
            kind = "touchMove" if share else "touchStart"
            finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y}]})
        finger.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    def close(self):
        """Close the page; it must not have complained or asked for anything elsewhere."""
        self.context.close()
        assert not self.complaints, self.complaints
        assert not self.failed
        assert not self.foreign


def until(condition, timeout_s=60.0):
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, "the condition did not come true"
        time.sleep(0.02)
