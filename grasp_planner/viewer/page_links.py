"""Addresses of the page that open something: a row of a run, as the links of its report, or a copied state."""

from __future__ import annotations

import json
from collections.abc import Callable

import viser

from ..exceptions import GraspPlannerError, InvalidValueError
from .page_script import send_script
from .run_control import RunControl
from .server import LocalServer
from .state_link import LinkedState, is_state, parse_state

FORGET = "window.history.replaceState(null, '', window.location.pathname);"
"""Has a page forget the link it came by, so that loading it again does not undo what was done since."""
COPY = """(async () => {
  const text = TEXT;
  try { await navigator.clipboard.writeText(text); }
  catch (error) {
    const field = document.createElement('textarea');
    field.value = text;
    document.body.appendChild(field);
    field.select();
    document.execCommand('copy');
    field.remove();
  }
})();"""


class PageLinks:
    """Has that shown which a page just opened asks for; tells the page, once it is there, why not."""

    def __init__(
        self,
        server: LocalServer,
        run: RunControl | None,
        later: Callable[..., None],
        open_state: Callable[[LinkedState], None],
        aim: Callable[[], None],
    ) -> None:
        """Listen to pages that are opened.

        Args:
            server: The server.
            run: The batch run that is gone through, if there is one.
            later: Has the worker do something.
            open_state: Shows a state; called in the worker's thread.
            aim: Points the camera that pages start with at what is shown; called in the worker's thread.
        """
        self._run, self._later, self._open_state, self._aim = run, later, open_state, aim
        self._greeting, self._forget = "", False
        server.page_asked = self._asked
        server.on_client_connect(self._greet)

    def _asked(self, query: dict[str, str]) -> None:
        """Take in the query of a page that is being opened."""
        if "row" in query or is_state(query):
            self._later(lambda: self._open(query))
        # The page is not there yet and will look from here, whatever has been shown since the last one came.
        self._later(self._aim)

    def _open(self, query: dict[str, str]) -> None:
        """Show the row or the state; runs in the worker's thread."""
        try:
            if "row" not in query:
                self._forget = True
                self._open_state(parse_state(query))
                return
            if self._run is None:
                raise InvalidValueError("the link", "a row of a batch run", "links to a viewer started with its folder")
            self._run.open_link(query)
        except GraspPlannerError as error:
            self._greeting = str(error)
            raise

    def _greet(self, client: viser.ClientHandle) -> None:
        """Tell a page that has just connected why its link did not work."""
        message, self._greeting = self._greeting, ""
        if message:
            client.add_notification("The link did not work", message[:300], color="red")
        if self._forget:
            self._forget = False
            send_script(client, FORGET)


def copy_link(client: viser.ClientHandle, query: str) -> None:
    """Have a page put a link with a query on the clipboard; the address is that by which the page itself was opened."""
    _copy(client, f"window.location.origin + window.location.pathname + '?' + {json.dumps(query)}")
    client.add_notification("Link copied", "It opens this in any running viewer at the same address.", color="green")


def copy_text(client: viser.ClientHandle, text: str) -> None:
    """Have a page put a text on the clipboard."""
    _copy(client, json.dumps(text))
    client.add_notification("Copied", text.partition("\n")[0][:80], color="green", auto_close_seconds=3.0)


def _copy(client: viser.ClientHandle, expression: str) -> None:
    """Have a page put what an expression of its script gives on the clipboard."""
    send_script(client, COPY.replace("TEXT", expression, 1))
