"""The chapter *Why it holds*: a push onto the object, what every finger makes of it, how much is withstood."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import viser

from ...analysis.measured_contacts import contact_set
from ...drawing.measures_picture import measures_pixels
from ...grasp.grasp import Grasp
from .. import text
from ..live import contact_share
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
        slices: Button that draws what the grasp can exert, how stiffly it holds and where the motors move it.
        drawn: Those slices of the grasp shown.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        add_about(gui, WHY)
        self.push = gui.add_checkbox("Push the object", False, hint="Drag the ball of the arrow, or its size below")
        self.size = gui.add_slider("Push N", 0.0, 10.0, 0.05, 1.0, disabled=True)
        self.answer = gui.add_markdown("")
        self.margin = gui.add_checkbox("Weakest push", False, hint="From where it resists least")
        self._why = gui.add_markdown("")
        hint = "Forces it can exert with ε, shifts by a force, reach of the motors, each in three planes"
        self.slices = gui.add_button("Draw slices", icon=viser.Icon.CHART_RADAR, hint=hint)
        self.drawn = gui.add_image(np.full((1, 1, 3), 255, np.uint8), format="png", visible=False)
        self._of: Grasp | None = None

    def connect(
        self, session: Session, push: Callable[[], None], later: Callable[[Callable[[], None], str], None]
    ) -> None:
        """Connect the widgets.

        Args:
            session: What is shown.
            push: Takes the push of the widgets.
            later: Has the worker do something; a request replaces an older one of the same name.
        """
        for widget in (self.push, self.size):
            widget.on_update(lambda _: later(push, "push"))
        self.slices.on_click(lambda _: later(lambda: self.draw_slices(session.grasp), "slices"))

    def draw_slices(self, grasp: Grasp) -> None:
        """Draw the slices of a grasp, which takes about half a second; to be called by the worker only."""
        self.drawn.image = measures_pixels(contact_set(grasp))
        self.drawn.visible, self._of = True, grasp

    def show(self, session: Session) -> None:
        """Show why the grasp holds, the push and what every finger makes of it; to be called by the worker only."""
        self._why.content = text.why_story(session.grasp)
        self.slices.disabled = contact_share(session.grasp) <= 0.0
        self.drawn.visible = self._of is session.grasp
        push = session.push
        self.size.disabled = push is None
        if push is None or not session.grasp.feasible:
            self.answer.content = "" if push is None else "*Only for a grasp that meets the model.*"
            return
        set_value(self.size, float(np.clip(np.linalg.norm(push), 0.0, self.size.max)))
        names = [frame.name for frame in session.grasp.problem.frames]
        self.answer.content = pushed(session.grasp, push).text(names)
