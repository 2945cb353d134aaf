"""What the page gets besides widgets and scene: its title, a word when the server is gone, no panel for developers."""

from __future__ import annotations

import json

import viser
from viser import _messages as messages

GONE = "The viewer has ended or can't be reached. Start it again on its machine: grasp-planner view"
BACK = "Connected again."
LOST_S, SHOWN_S = 3, 4
"""How long there is no connection before the page says so, and how long it says that it is back [s]."""

SCRIPT = """(() => {
  document.title = TITLE;
  if (window.graspViewerWatch) return;
  const style = document.createElement('style');
  style.textContent = 'button:has(> .tabler-icon-adjustments), button:has(.tabler-icon-adjustments) {display: none}' +
    '[data-mantine-color-scheme=dark] [data-model] :is(b, div:first-child) ' +
    '{filter: brightness(1.5)} pre, pre code {white-space: pre-wrap !important; overflow-wrap: anywhere} ' +
    '.mantine-Table-table th:not([style]) {text-align: left} ' +
    '.mantine-Table-table :is(th, td) + :is(th, td) {padding-left: 10px} ' +
    '#connection-note {position: fixed; left: 50%; top: 12px; transform: translateX(-50%); z-index: 9999; ' +
    'padding: 10px 16px; border-radius: 10px; font: 600 14px system-ui, sans-serif; color: #fff; max-width: 90vw}';
  document.head.appendChild(style);
  const note = document.createElement('div');
  note.id = 'connection-note';
  note.setAttribute('role', 'status');
  note.hidden = true;
  document.body.appendChild(note);
  let lost = 0, back = 0;
  const connected = () => document.querySelector('.tabler-icon-cloud-check') !== null;
  window.graspViewerWatch = setInterval(() => {
    if (connected()) {
      if (lost > LOST) {back = SHOWN; note.textContent = BACK; note.style.background = '#1b8a5a';}
      lost = 0;
      back = Math.max(0, back - 1);
      note.hidden = back === 0;
    } else if (++lost > LOST) {
      note.textContent = GONE;
      note.style.background = '#c62839';
      note.hidden = false;
    }
  }, 1000);
})();"""


def page_script(title: str) -> str:
    """Return the script of the page.

    Args:
        title: Title of the page.
    """
    texts = {"TITLE": title, "GONE": GONE, "BACK": BACK}
    script = SCRIPT.replace("LOST)", f"{LOST_S})").replace("= SHOWN;", f"= {SHOWN_S};")
    for name, text in texts.items():
        # A closing script tag would end the script of an exported page.
        script = script.replace(f"= {name};", f"= {json.dumps(text).replace('</', '<' + chr(92) + '/')};")
    return script


def send_script(server: viser.ViserServer | viser.ClientHandle, script: str) -> None:
    """Have every page, now and later, run a script; or one page, once."""
    server.gui._websock_interface.queue_message(messages.RunJavascriptMessage(script))
