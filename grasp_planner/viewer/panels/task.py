"""The chapter *Task*: which way the hand is to be strong, and what that costs."""

from __future__ import annotations

import viser

from ..session import Session
from ..text import task_story
from ..verdict_card import headline
from .chapters import TASK, add_about


class TaskPanel:
    """Widgets of the chapter.

    Attributes:
        form: Where the widgets of the task stand; Enter submits it.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        add_about(gui, TASK)
        self.form = gui.add_form(None)
        self._story = gui.add_markdown("")
        self._costs = gui.add_markdown("")

    def show(self, session: Session) -> None:
        """Show what the task means for the grasp and what it costs; to be called by the worker only."""
        self._story.content = task_story(session.grasp)
        rows = [f"| {symbol} | {value} | {meaning} |" for symbol, value, meaning in headline(session.grasp)]
        self._costs.content = "\n".join(["| | | |", "|---|--:|---|", *rows])
