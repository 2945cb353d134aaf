"""The second tab: the synergies themselves, as sliders, and moving hand and object."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import viser

from ..problem import GraspProblem
from ..spatial import Array
from .session import Session
from .widgets import set_value

REACH = 2.0
"""Range of the synergy sliders to both sides [rad]."""


class SynergyPanel:
    """Sliders of σ and of the squeeze, closing along a synergy, gizmos.

    Attributes:
        count: Slider of n_s.
        sliders: Sliders of σ.
    """

    def __init__(self, gui: viser.GuiApi, changed: Callable[[], None]) -> None:
        self._gui, self._changed, self._version = gui, changed, -1
        self.count = gui.add_slider("Synergies n_s", 1, 15, 1, 3, hint="How many motor commands the hand has")
        self._folder = gui.add_folder("Synergy coordinates σ [rad]")
        self.sliders: list[viser.GuiSliderHandle[float]] = []
        self._range = gui.add_markdown("")
        self.reset = gui.add_button("Reset to the mean posture", icon=viser.Icon.REFRESH)
        with gui.add_folder("Close"):
            self.which = gui.add_dropdown("Along synergy", ("1",))
            self.close = gui.add_button("Close until contact", icon=viser.Icon.PLAYER_PLAY)
        with gui.add_folder("Squeeze δσ"):
            self.automatic = gui.add_checkbox("Automatic: least force", True, hint="Choose δσ anew at every move")
            self.squeeze = gui.add_slider("Squeeze ×", 0.0, 3.0, 0.05, 1.0, disabled=True)
        with gui.add_folder("Move"):
            self.move_hand = gui.add_checkbox("Move the hand", False, hint="Shows handles at the wrist")
            self.move_object = gui.add_checkbox("Move the object", False, hint="Shows handles at the object")

    @property
    def sigma(self) -> Array:
        """σ as the sliders say [rad]."""
        return np.array([slider.value for slider in self.sliders])

    def show(self, session: Session) -> None:
        """Show the state; to be called by the worker only."""
        problem, live = session.problem, session.live
        self._range.content = limits_text(problem, live.sigma, live.offset - live.bend)
        self.squeeze.disabled = session.automatic_squeeze
        if self._version == session.version:
            return
        self._version = session.version
        self._fit(problem)
        for slider, value in zip(self.sliders, live.sigma, strict=True):
            # A value the slider can't show is left to the numbers below it.
            set_value(slider, float(np.clip(value, -REACH, REACH)))
        set_value(self.count, problem.n_synergies)
        set_value(self.automatic, session.automatic_squeeze)
        set_value(self.squeeze, session.squeeze)

    def _fit(self, problem: GraspProblem) -> None:
        """Have one slider for every synergy."""
        n_s = problem.n_synergies
        if len(self.sliders) == n_s and self.count.max == most_synergies(problem):
            return
        self.count.max = most_synergies(problem)
        for slider in self.sliders:
            slider.remove()
        with self._folder:
            self.sliders = [self._gui.add_slider(*_slider(problem, index)) for index in range(n_s)]
        for slider in self.sliders:
            slider.on_update(lambda _: self._changed())
        self.which.options = tuple(str(index + 1) for index in range(n_s))


def most_synergies(problem: GraspProblem) -> int:
    """Return how many synergies the problem's set has."""
    full = problem.synergy_space or problem.hand.synergies(problem.synergy_set)
    return full.n_synergies


def _slider(problem: GraspProblem, index: int) -> tuple[str, float, float, float, float]:
    """Return label, range, step and value of the slider of a synergy."""
    return f"σ{index + 1}", -REACH, REACH, 0.005, 0.0


def limits_text(problem: GraspProblem, sigma: Array, besides: Array) -> str:
    """Return how far each synergy can go before a joint meets its limit (Markdown)."""
    hand, basis = problem.hand, problem.synergies.basis
    q = problem.synergies.joint_angles(sigma) + besides
    rows = ["| | from | to | stopped by |", "|---|--:|--:|---|"]
    for index in range(min(problem.n_synergies, 6)):
        column = basis[:, index]
        safe = np.where(np.abs(column) < 1e-9, np.nan, column)
        ends = np.sort(np.stack([(hand.lower - q) / safe, (hand.upper - q) / safe]), axis=0)
        low, high = float(np.nanmax(ends[0])), float(np.nanmin(ends[1]))
        joint = hand.joint_names[int(np.nanargmin(ends[1]))]
        rows.append(f"| σ{index + 1} | {sigma[index] + low:.2f} | {sigma[index] + high:.2f} | {joint} |")
    return "\n".join(rows)
