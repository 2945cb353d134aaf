"""A short guided tour on a first visit, in the browser alone: six cards, skippable, remembered there."""

from __future__ import annotations

import json

from .panels.chapters import COMPARE, GRASP, PLAN, SYNERGIES, TASK, WHY

STEPS: tuple[tuple[str, str], ...] = (
    (
        GRASP,
        "A hand with 15 joints and 3 motors holds a cylinder. Red arrows are its forces; the card is green as far "
        "as the grasp is true: from the model on paper to a hand that closes.",
    ),
    (
        SYNERGIES,
        "Drag Close: the fingers touch one after the other. Drag Synergies n_s: with another number of motors "
        "the same posture may no longer hold.",
    ),
    (
        WHY,
        "Tick Push the object and drag the ball of the arrow: each finger shows how much of its friction it uses. "
        "Red slips.",
    ),
    (TASK, "Drag the green ball to say where the hand is to be strong. The blue ellipsoid shows where it is."),
    (PLAN, "Press Plan. What the search finds that differs gets a card; click one to see it."),
    (COMPARE, "Lay 1 to 15 synergies, or human and made ones, side by side. Under Share, a grasp is sent as one file."),
)
"""Chapter that is opened, and what is said."""
REMEMBERED = "grasp-planner-tour"
"""Name under which the browser remembers that the tour was seen."""
AGAIN = "window.graspViewerTour && window.graspViewerTour();"
"""Shows the tour once more."""

SCRIPT = """(() => {
  if (window.graspViewerTour) return;
  const STEPS = __STEPS__, KEY = __KEY__;
  const element = (kind, style, text) => {
    const made = document.createElement(kind);
    made.style.cssText = style;
    made.textContent = text;
    return made;
  };
  const remember = () => { try { localStorage.setItem(KEY, 'seen'); } catch (error) { return; } };
  const seen = () => { try { return localStorage.getItem(KEY) !== null; } catch (error) { return true; } };
  const tabs = () => [...document.querySelectorAll('[role=tab]')];
  // The tabs listen to a pointer, because they can be dragged: a mere click does nothing.
  const open = (tab) => {
    const box = tab.getBoundingClientRect();
    const at = {bubbles: true, cancelable: true, composed: true, isPrimary: true, pointerId: 1, pointerType: 'mouse',
                clientX: box.x + box.width / 2, clientY: box.y + box.height / 2};
    tab.dispatchEvent(new PointerEvent('pointerdown', {...at, buttons: 1}));
    tab.dispatchEvent(new PointerEvent('pointerup', at));
    tab.dispatchEvent(new MouseEvent('click', at));
  };
  window.graspViewerOpen = (name) => {
    const tab = tabs().find((each) => each.textContent.trim() === name);
    if (tab) open(tab);
  };
  window.graspViewerTour = () => {
    if (document.getElementById('tour')) return;
    let step = 0;
    const card = element('div', 'position:fixed;left:12px;z-index:900;width:min(320px,calc(100vw - 24px));' +
      'box-sizing:border-box;padding:12px 14px;border-radius:12px;background:#1d2433;color:#fff;' +
      'font:14px/1.45 system-ui,sans-serif;box-shadow:0 6px 24px rgba(0,0,0,.25)', '');
    // Notes of the page come up on the left above; on a phone the panel takes the lower part.
    card.style[window.innerWidth < 700 ? 'top' : 'bottom'] = '12px';
    card.id = 'tour';
    card.setAttribute('role', 'dialog');
    card.setAttribute('aria-label', 'Tour');
    const head = element('div', 'font-weight:700;margin-bottom:4px', '');
    const words = element('div', '', '');
    const row = element('div', 'display:flex;gap:8px;margin-top:10px', '');
    const button = 'border:0;border-radius:8px;padding:6px 12px;font:600 13px system-ui,sans-serif;cursor:pointer;';
    const skip = element('button', button + 'background:transparent;color:#c3cad8;margin-right:auto', 'Skip the tour');
    const back = element('button', button + 'background:#3a4358;color:#fff', 'Back');
    const next = element('button', button + 'background:#1b8a5a;color:#fff', '');
    const show = () => {
      head.textContent = STEPS[step][0] + ' · ' + (step + 1) + ' of ' + STEPS.length;
      words.textContent = STEPS[step][1];
      next.textContent = step + 1 < STEPS.length ? 'Next' : 'Done';
      back.style.visibility = step ? 'visible' : 'hidden';
      window.graspViewerOpen(STEPS[step][0]);
    };
    const end = () => { remember(); card.remove(); };
    skip.onclick = end;
    back.onclick = () => { step = Math.max(0, step - 1); show(); };
    next.onclick = () => { step += 1; if (step < STEPS.length) show(); else end(); };
    row.append(skip, back, next);
    card.append(head, words, row);
    document.body.appendChild(card);
    show();
  };
  const waiting = setInterval(() => {
    if (!tabs().length) return;
    clearInterval(waiting);
    if (!seen()) window.graspViewerTour();
  }, 300);
})();"""


def tour_script() -> str:
    """Return the script: it shows the tour on a first visit."""
    return SCRIPT.replace("__STEPS__", json.dumps(STEPS)).replace("__KEY__", json.dumps(REMEMBERED))
