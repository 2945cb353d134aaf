"""The card of the verdict: its upper rungs are found piece by piece, in tenths of a second, while nothing moves."""

from __future__ import annotations

import html
from collections import OrderedDict

import viser

from ..analysis.ladder import (
    CLOSES,
    NOT_MET,
    SURVIVES,
    Rung,
    clear_rung,
    closes_rung,
    errors_rung,
    holds_rung,
    model_rung,
)
from ..grasp.grasp import Grasp
from .session import Session
from .text import CARD
from .verdict_card import verdict_card

KEPT = 16
"""Grasps whose answers are kept."""
OPEN = "being checked …"


class LadderCheck:
    """What is known so far of the grasps shown last; for the worker's thread only."""

    def __init__(self) -> None:
        self._closes: OrderedDict[int, tuple[Grasp, Rung]] = OrderedDict()
        self._errors: dict[int, Rung] = {}

    def rungs(self, grasp: Grasp) -> tuple[Rung, ...]:
        """Return the ladder as far as it is known."""
        below = model_rung(grasp), clear_rung(grasp), holds_rung(grasp)
        if not grasp.feasible:
            return *below, Rung(CLOSES, None, NOT_MET), Rung(SURVIVES, None, NOT_MET)
        if id(grasp) not in self._closes:
            return *below, Rung(CLOSES, None, OPEN), Rung(SURVIVES, None, OPEN)
        return *below, self._closes[id(grasp)][1], self._errors.get(id(grasp), Rung(SURVIVES, None, OPEN))

    def step(self, grasp: Grasp) -> bool:
        """Find one piece more; return whether there was one to find."""
        if not grasp.feasible:
            return False
        if id(grasp) not in self._closes:
            self._closes[id(grasp)] = grasp, closes_rung(grasp)
            if len(self._closes) > KEPT:
                old, _ = self._closes.popitem(last=False)
                self._errors.pop(old, None)
            return True
        if id(grasp) in self._errors:
            return False
        self._errors[id(grasp)] = errors_rung(grasp)
        return True


class LadderCard:
    """The card on top of the page; its methods are for the worker's thread.

    Attributes:
        widget: The HTML.
    """

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self.widget = gui.add_html("")
        self._session, self._check = session, LadderCheck()

    def show(self) -> None:
        """Show what is known of the grasp, or what is going on."""
        session = self._session
        if session.preview is not None:
            self.widget.content = f"<div style='{CARD}'>{html.escape(session.preview.message)} …</div>"
        else:
            self.widget.content = verdict_card(session.grasp, session.note, self._check.rungs(session.grasp))

    def climb(self) -> bool:
        """Look at one more rung while nothing else is to do; return whether there was one."""
        if self._session.preview is not None or not self._check.step(self._session.grasp):
            return False
        self.show()
        return True
