"""A page of the viewer in headless Chromium, with what it complains about."""

from __future__ import annotations

import time

import numpy as np

from grasp_planner.viewer.tour import REMEMBERED

TOLERATED = (
    "THREE.Clock: This module has been deprecated",
    "KHR_parallel_shader_compile",
    "Unable to preventDefault inside passive event listener",
)
"""What the page's libraries say on the console; nothing else may be an error or a warning."""
DRIVER_WARNINGS = ("GPU stall due to ReadPixels", "GL Driver Message")
"""Warnings of software rendering, which no person sees."""

READY = """(names) => {
  const view = window.__viserMutable, tree = window.__viserSceneTree;
  if (!view || !tree || !view.scene || view.messageQueue.length) return false;
  return names.every((name) => view.nodeRefFromName[name]) && window.__viserTestpoints.rendererInfo.render.frame > 0;
}"""

TURN = """(name) => window.__viserMutable.nodeRefFromName[name].quaternion.toArray()"""

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

    def __init__(self, browser, url, wait_for=("/object/mesh", "/hand"), first_visit=False, size=(1100, 760)):
        self.context = browser.new_context(viewport={"width": size[0], "height": size[1]}, accept_downloads=True)
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

    def tab(self, name):
        """Open a tab."""
        self.page.get_by_role("tab", name=name).click()

    def button(self, name):
        """Return a button."""
        return self.page.get_by_role("button", name=name, exact=True)

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
        self.page.wait_for_timeout(200)
        mouse.move(*place)
        self.page.wait_for_timeout(500)

    def drag(self, start, end):
        """Drag with the left button from one place of the screen to another."""
        self.hover(start)
        self.page.mouse.down()
        self.page.wait_for_timeout(100)
        self.page.mouse.move(*end, steps=12)
        self.page.wait_for_timeout(400)
        self.page.mouse.up()

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
