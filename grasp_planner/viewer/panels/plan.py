"""The widgets of planning: presets, Plan and Cancel, progress curves, ranked results."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import viser
from viser import uplot

from ...grasp.grasp import IterationRecord
from ...planning.planner import MOST_GRASPS
from ...problem.search_options import PlannerOptions
from .chapters import PLAN, add_about
from .gallery import GalleryPanel
from .requirement_curves import POINTS, RequirementCurves
from .settings import SettingsPanel
from .widgets import log10

CURVES_S = 0.25
"""Least time between two drawings of the curves, which cost as much as the hand [s]."""


class PlanPanel:
    """Widgets of the search.

    Attributes:
        starters: Buttons that start a search; only while none runs.
        stoppers: Buttons that end it.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        typed: Callable[[], None] = lambda: None,
        chosen: Callable[[int], None] = lambda _: None,
    ) -> None:
        """Add the widgets to the present container.

        Args:
            gui: The widgets of the page.
            typed: Called when a setting of the search has changed.
            chosen: Called with the rank of a result that was clicked, from 0.
        """
        self._gui = gui
        add_about(gui, PLAN)
        self.count = gui.add_number(
            "Different grasps", 1, min=1, max=MOST_GRASPS, step=1, hint="How many to look for; the best comes first"
        )
        self.count.on_update(lambda _: typed())
        self.plan = gui.add_button("Plan", color="green", icon=viser.Icon.ROCKET, hint="Search in the background")
        self.starters = [self.plan]
        self.cancel = gui.add_button("Cancel", color="red", disabled=True)
        self.stoppers = [self.cancel]
        self.bar = gui.add_progress_bar(0.0, visible=False, animated=True)
        self.status = gui.add_markdown("")
        self._add_curves()
        self.requirements = RequirementCurves(gui)
        self.gallery = GalleryPanel(gui, chosen, "Grasps that differ, best first")
        self.browse = gui.add_button_group("Show", ("best", "previous", "next"))
        with gui.add_folder("Search", expand_by_default=False):
            self.seed = gui.add_number("Seed", 0, min=0, max=10**6, step=1)
            self.search = SettingsPanel(gui, PlannerOptions, typed)
            self.starts, self.enough = self.search.widgets["starts"], self.search.widgets["enough"]
            self.from_here = gui.add_checkbox("Start from the hand as it is", False)

    def set_running(self, running: bool) -> None:
        """Switch between Plan and Cancel."""
        for button in self.starters:
            button.disabled = running
        for button in self.stoppers:
            button.disabled = not running
        self.bar.visible = running
        if running:
            self._history: list[tuple[float, float]] = []
            self._undrawn: list[IterationRecord] = []
        elif self._undrawn:
            self._draw_curves()

    def add_progress(self, records: list[IterationRecord]) -> None:
        """Take further iterations; the curves follow a few times a second."""
        for record in records:
            worst = max(record.violations.values(), default=0.0)
            self._history.append((log10(record.objective), log10(worst)))
        self._undrawn += records
        if time.monotonic() - self._drawn >= CURVES_S:
            self._draw_curves()

    def _draw_curves(self) -> None:
        """Draw all iterations so far."""
        shown = np.array(self._history[-POINTS:])
        first = len(self._history) - len(shown)
        steps = np.arange(first, len(self._history), dtype=float)
        self.curves.data = (steps, shown[:, 0].copy(), shown[:, 1].copy())
        self.curves.visible = True
        self.requirements.add(self._undrawn)
        self._undrawn, self._drawn = [], time.monotonic()

    def _add_curves(self) -> None:
        """Add the curves of the search."""
        zero = np.zeros(2)
        scales = {"x": uplot.Scale(time=False, auto=True), "y": uplot.Scale(auto=True)}
        series = (
            uplot.Series(label="iteration"),
            uplot.Series(label="log₁₀ objective", stroke="#118a4e", width=2),
            uplot.Series(label="log₁₀ worst violation", stroke="#c62839", width=2),
        )
        self.curves = self._gui.add_uplot(
            (np.arange(2.0), zero, zero), series, scales=scales, aspect=1.9, visible=False
        )
        self._history, self._undrawn, self._drawn = [], [], -CURVES_S
