"""Small helpers around widgets: values, typing, errors beside their field."""

from __future__ import annotations

import html
import math
import threading
from collections.abc import Callable, Iterable
from typing import Any

import viser

from ...exceptions import GraspPlannerError

TYPING_S = 0.7
"""How long nobody has typed when what was typed is taken; Enter takes it at once [s]."""
COMPLAINT = "<div style='color:#c62839;font:12px system-ui,sans-serif;margin:-4px 12px 4px'>{}</div>"


MOST_SAID = 300
"""Most letters of what is wrong with a field."""


class FieldError(GraspPlannerError):
    """What a field holds can't be read; the field itself says so."""


class Pause:
    """Passes on that a field has changed once its typing has paused; a change by the program at once."""

    def __init__(self, changed: Callable[[], None]) -> None:
        self._changed = changed
        self._timer: threading.Timer | None = None
        self._lock = threading.Lock()

    def __call__(self, event: Any) -> None:
        """Take note of a change; the callback of a widget."""
        if event.client is None:
            self.now()
            return
        with self._lock:
            self._drop()
            self._timer = threading.Timer(TYPING_S, self._changed)
            self._timer.daemon = True
            self._timer.start()

    def now(self) -> None:
        """Pass it on at once, as for Enter."""
        with self._lock:
            self._drop()
        self._changed()

    def _drop(self) -> None:
        """Forget a change that waits."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


class TextField:
    """A text with a line below it that says why it can't be read.

    Attributes:
        widget: The text.
    """

    def __init__(self, gui: viser.GuiApi, label: str, value: str, hint: str) -> None:
        self.widget = gui.add_text(label, value, hint=hint)
        self._complaint = gui.add_html("", visible=False)

    def read(self, text: str, parse: Callable[[str], Any]) -> Any:
        """Return what a text means.

        Raises:
            FieldError: If it means nothing; the line below says why.
        """
        try:
            value = parse(text)
        except GraspPlannerError as error:
            self.complain(str(error))
            raise FieldError(str(error)) from None
        self.complain("")
        return value

    def complain(self, message: str) -> None:
        """Say what is wrong; nothing if empty."""
        say_beside(self._complaint, message)


class UploadField:
    """A button that takes a file, with a line below it that says why it can't be used.

    Attributes:
        button: The button.
    """

    def __init__(self, gui: viser.GuiApi, label: str, endings: Iterable[str], hint: str) -> None:
        self.button = gui.add_upload_button(label, icon=viser.Icon.UPLOAD, mime_type=",".join(endings), hint=hint)
        self._complaint = gui.add_html("", visible=False)

    def complain(self, message: str) -> None:
        """Say what is wrong; nothing if empty."""
        say_beside(self._complaint, message)


def say_beside(line: viser.GuiHtmlHandle, message: str) -> None:
    """Show a line beside a field, or hide it if there is nothing to say."""
    if message:
        line.content = COMPLAINT.format(html.escape(message[:MOST_SAID]))
    if line.visible != bool(message):
        line.visible = bool(message)


def set_value(widget: Any, value: Any) -> None:
    """Show a value in a widget, if it is another one; callbacks run in the caller's thread."""
    if widget.value != value:
        widget.value = value


def log10(value: float) -> float:
    """Return the logarithm of a value, at least −12."""
    return math.log10(max(value, 1e-12)) if math.isfinite(value) else 12.0
