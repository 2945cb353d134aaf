"""The chapter *Why it holds*: a push onto the object, what every finger makes of it, how much is withstood."""

from __future__ import annotations

import numpy as np
import viser

from .. import text
from ..push import pushed
from ..session import Session
from .chapters import WHY, add_about
from .widgets import set_value


class WhyPanel:
    """Widgets of the chapter.

    Attributes:
        push: Whether a push is tried.
        size: How strong [N].
        margin: Whether the push that it resists least is drawn.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        add_about(gui, WHY)
        self.push = gui.add_checkbox("Push the object", False, hint="Drag the ball of the arrow, or its size below")
        self.size = gui.add_slider("Push N", 0.0, 10.0, 0.05, 1.0, disabled=True)
        self.answer = gui.add_markdown("")
        self.margin = gui.add_checkbox("Weakest push", False, hint="From where it resists least")
        self._why = gui.add_markdown("")

    def show(self, session: Session) -> None:
        """Show why the grasp holds, the push and what every finger makes of it; to be called by the worker only."""
        self._why.content = text.why_story(session.grasp)
        push = session.push
        self.size.disabled = push is None
        if push is None or not session.grasp.feasible:
            self.answer.content = "" if push is None else "*Only for a grasp that meets the model.*"
            return
        set_value(self.size, float(np.clip(np.linalg.norm(push), 0.0, self.size.max)))
        names = [frame.name for frame in session.grasp.problem.frames]
        self.answer.content = pushed(session.grasp, push).text(names)
