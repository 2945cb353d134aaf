"""The buttons that undo and redo."""

from __future__ import annotations

from collections.abc import Callable

import viser

from ..session import Session

UNDO, REDO = "↶ undo", "redo ↷"


class ChangesPanel:
    """Undo and redo; its methods are for the worker's thread.

    Attributes:
        buttons: The buttons.
    """

    def __init__(
        self, gui: viser.GuiApi, session: Session, stop_animation: Callable[[], None], later: Callable[..., None]
    ) -> None:
        """Add the buttons to the present container.

        Args:
            gui: The widgets of the page.
            session: What they change.
            stop_animation: Ends an animation; called in the worker's thread.
            later: Has the worker do something.
        """
        self._session, self._stop_animation = session, stop_animation
        self.buttons = gui.add_button_group("Changes", (UNDO, REDO), hint="Ctrl+Z, Ctrl+Shift+Z")
        self.buttons.on_click(lambda _: later(self.undo if self.buttons.value == UNDO else self.redo))

    def undo(self) -> None:
        """Show what was there before the last change."""
        self._stop_animation()
        self._session.undo()

    def redo(self) -> None:
        """Show what was there before the last undo."""
        self._stop_animation()
        self._session.redo()
