"""Addresses of the page that name a row of a run, such as the links of its report."""

from __future__ import annotations

from collections.abc import Callable

import viser

from ..exceptions import GraspPlannerError, InvalidValueError
from .run_control import RunControl
from .server import LocalServer


class RowLinks:
    """Has the row shown that a page just opened asks for; tells the page, once it is there, why not."""

    def __init__(self, server: LocalServer, run: RunControl | None, later: Callable[..., None]) -> None:
        self._run, self._later, self._greeting = run, later, ""
        server.page_asked = self._asked
        server.on_client_connect(self._greet)

    def _asked(self, query: dict[str, str]) -> None:
        """Take in the query of a page that is being opened."""
        if "row" in query:
            self._later(lambda: self._open(query))

    def _open(self, query: dict[str, str]) -> None:
        """Show the row; runs in the worker's thread."""
        try:
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
