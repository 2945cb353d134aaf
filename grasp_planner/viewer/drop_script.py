"""Files dropped on the page go to the button that takes their kind."""

from __future__ import annotations

import json

from ..files.reading import MESH_SUFFIXES
from .panels.chapters import PLAN
from .uploads import URDF_SUFFIXES

SHARE = "Share"
PLACES = dict.fromkeys((*MESH_SUFFIXES, *URDF_SUFFIXES), PLAN) | {".json": SHARE}
"""The tab that has the button, by ending."""

SCRIPT = """(() => {
  if (window.graspViewerDrop) return;
  window.graspViewerDrop = true;
  const PLACES = __PLACES__;
  const taker = (ending) => [...document.querySelectorAll('input[type=file]')].find((input) =>
    input.accept.split(',').some((kind) => kind === ending || kind === 'application/' + ending.slice(1)));
  document.addEventListener('dragover', (event) => event.preventDefault());
  document.addEventListener('drop', (event) => {
    const files = event.dataTransfer && event.dataTransfer.files;
    if (!files || !files.length) return;
    event.preventDefault();
    const ending = (files[0].name.toLowerCase().match(/[.][a-z0-9]+$/) || [''])[0];
    if (!(ending in PLACES)) return;
    if (!taker(ending) && window.graspViewerOpen) window.graspViewerOpen(PLACES[ending]);
    let tries = 40;
    const waiting = setInterval(() => {
      const input = taker(ending);
      if (!input && --tries > 0) return;
      clearInterval(waiting);
      if (!input) return;
      const given = new DataTransfer();
      given.items.add(files[0]);
      input.files = given.files;
      input.dispatchEvent(new Event('change', {bubbles: true}));
    }, 100);
  });
})();"""


def drop_script() -> str:
    """Return the script."""
    return SCRIPT.replace("__PLACES__", json.dumps(PLACES))
