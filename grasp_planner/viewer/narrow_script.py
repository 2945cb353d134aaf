"""What keeps the hand in sight on phones and in small windows: the panel a sheet, the card folded, a wide camera."""

from __future__ import annotations

from ..drawing.camera import FIELD_OF_VIEW

PHONE = 700
"""Windows narrower than this have the panel below the picture [pixels]."""
SHARE = 46
"""How much of such a window's height the panel takes [%]."""
WIDEST = 1.2
"""Width by height of what is seen at the usual angle of view."""

SCRIPT = """(() => {
  if (window.graspViewerFit) return;
  const style = document.createElement('style');
  style.textContent = '@media (max-width: PHONEpx) {' +
    '.mantine-Paper-root:has([role=tablist]) {left: 0 !important; right: 0 !important; width: 100% !important; ' +
    'top: auto !important; bottom: 0 !important; height: SHARE !important; max-height: SHARE !important} ' +
    '.mantine-Paper-root:has([role=tablist]) .mantine-ScrollArea-content > div {width: 100% !important} ' +
    '.mantine-Paper-root [data-model] > :first-child {cursor: pointer} ' +
    '.mantine-Paper-root [data-model] > :first-child::after {content: " ▴"} ' +
    'body:not(.card-open) .mantine-Paper-root [data-model] > :first-child::after {content: " ▾"} ' +
    'body:not(.card-open) .mantine-Paper-root [data-model] > :not(:first-child) {display: none !important}}';
  document.head.appendChild(style);
  document.addEventListener('click', (event) => {
    const line = event.target.closest && event.target.closest('.mantine-Paper-root [data-model] > :first-child');
    if (line) document.body.classList.toggle('card-open');
  });
  const fit = () => {
    const view = window.__viserMutable, camera = view && view.camera;
    const canvas = document.querySelector('canvas[data-engine]');
    if (!camera || !canvas) return;
    const all = canvas.getBoundingClientRect();
    let width = all.width, height = all.height;
    const tabs = document.querySelector('[role=tablist]'), panel = tabs && tabs.closest('.mantine-Paper-root');
    if (panel) {
      const over = panel.getBoundingClientRect();
      const across = Math.min(over.right, all.right) - Math.max(over.left, all.left);
      const down = Math.min(over.bottom, all.bottom) - Math.max(over.top, all.top);
      if (across > 0 && down > 0) {
        if (across > 0.8 * all.width) height = Math.max(100, over.top - all.top);
        else if (over.left > all.left + 0.3 * all.width) width = Math.max(100, over.left - all.left);
      }
    }
    const wide = Math.max(1, WIDEST * height / width) * all.height / height;
    const wanted = 2 * Math.atan(Math.tan(FIELD / 2) * wide) * 180 / Math.PI;
    const x = (all.width - width) / 2, y = (all.height - height) / 2, old = camera.view;
    const moved = old ? old.offsetX !== x || old.offsetY !== y || old.fullHeight !== all.height : x || y;
    if (wide > 1.001 || window.graspViewerFit.changed) {
      if (Math.abs(camera.fov - wanted) < 0.01 && !moved) return;
      window.graspViewerFit.changed = true;
      camera.fov = wanted;
      camera.setViewOffset(all.width, all.height, x, y, all.width, all.height);
      camera.updateProjectionMatrix();
      if (view.requestRender) view.requestRender();
    }
  };
  window.graspViewerFit = {timer: setInterval(fit, 300), changed: false};
})();"""


def narrow_script() -> str:
    """Return the script; on a page that is wide enough it changes nothing."""
    values = {"PHONE": f"{PHONE}", "SHARE": f"{SHARE}%", "WIDEST": f"{WIDEST}", "FIELD ": f"{FIELD_OF_VIEW:.6g} "}
    script = SCRIPT
    for name, value in values.items():
        script = script.replace(name, value)
    return script
