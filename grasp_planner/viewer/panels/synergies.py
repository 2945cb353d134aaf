"""The second tab: the synergies themselves, as sliders, and moving hand and object."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser
from viser._messages import GuiSliderMark

from ...grasp.grasp import Grasp
from ...problem.problem import GraspProblem
from ...spatial import Array
from ..session import Session
from ..text import fixed, synergy_story
from .chapters import SYNERGIES, add_about
from .widgets import set_value

REACH = 2.0
"""Range of the synergy sliders to both sides [rad]."""
LISTED = 6
"""Synergies whose limits are listed."""
LABEL_WIDTH = 0.9
"""What a number below a slider takes up of it [rad]."""


class SynergyPanel:
    """Sliders of σ and of the squeeze, closing along a synergy, gizmos.

    Attributes:
        count: Slider of n_s.
        sliders: Sliders of σ.
    """

    def __init__(self, gui: viser.GuiApi, changed: Callable[[], None]) -> None:
        self._gui, self._changed, self._version = gui, changed, -1
        add_about(gui, SYNERGIES)
        self.story = gui.add_slider(
            "Close", 0.0, 2.0, 0.01, 2.0, marks=((0.0, "open"), (1.0, "touch"), (2.0, "held")), hint="Drag to the left"
        )
        self.count = gui.add_slider("Synergies n_s", 1, 15, 1, 3, hint="How many motor commands the hand has")
        self._counted = int(self.count.value)
        self.springs = gui.add_checkbox("Springs", False, hint="The gap between motors and fingers, in newtons")
        self._words = gui.add_markdown("")
        self._folder = gui.add_folder("σ [rad]; the marks are joint limits")
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
        with gui.add_folder("Joints"):
            self._joints = gui.add_markdown("")

    @property
    def sigma(self) -> Array:
        """σ as the sliders say [rad]."""
        return np.array([slider.value for slider in self.sliders])

    def show(self, session: Session) -> None:
        """Show the state; to be called by the worker only."""
        problem, live = session.problem, session.live
        ranges = synergy_ranges(problem, live.sigma, live.offset - live.bend)
        self._range.content = limits_text(ranges)
        self._joints.content = joint_text(session.grasp)
        self._words.content = synergy_story(session.grasp)
        self.squeeze.disabled = session.automatic_squeeze
        if self._version != session.version:
            self._version = session.version
            self._follow(session, ranges)
        for slider, limits in zip(self.sliders, ranges, strict=False):
            marks = limit_marks(limits)
            if slider._marks != marks:
                slider._marks = marks

    def _follow(self, session: Session, ranges: list[SynergyRange]) -> None:
        """Have the widgets say what the state is."""
        problem = session.problem
        # A value a slider can't show is left to the numbers below it.
        values = np.clip(session.live.sigma, -REACH, REACH).tolist()
        self._fit(problem, values, ranges)
        for slider, value in zip(self.sliders, values, strict=True):
            set_value(slider, value)
        if self.count.value in (self._counted, problem.n_synergies):  # else picked meanwhile: its change is on its way
            set_value(self.count, problem.n_synergies)
            self._counted = problem.n_synergies
        set_value(self.story, 2.0)
        set_value(self.automatic, session.automatic_squeeze)
        set_value(self.squeeze, session.squeeze)

    def _fit(self, problem: GraspProblem, values: list[float], ranges: list[SynergyRange]) -> None:
        """Have one slider for every synergy.

        Each begins with its value and marks: an update that came when it is gone again would be complained of.
        """
        n_s = problem.n_synergies
        if len(self.sliders) == n_s and self.count.max == most_synergies(problem):
            return
        self.count.max = most_synergies(problem)
        for slider in self.sliders:
            slider.remove()
        with self._folder:
            self.sliders = [
                self._gui.add_slider(f"σ{index}", -REACH, REACH, 0.005, value, marks=marks_of(limits))
                for index, (value, limits) in enumerate(zip(values, ranges, strict=True), start=1)
            ]
        for slider in self.sliders:
            slider.on_update(lambda _: self._changed())
        self.which.options = tuple(str(index + 1) for index in range(n_s))


def most_synergies(problem: GraspProblem) -> int:
    """Return how many synergies the problem's set has."""
    full = problem.synergy_space or problem.hand.synergies(problem.synergy_set)
    return full.n_synergies


@dataclass(frozen=True)
class SynergyRange:
    """How far one synergy can go, from a posture, before a joint meets its limit.

    Attributes:
        low: Least σ [rad].
        high: Largest σ [rad].
        low_joint: Joint that stops it at the low end.
        high_joint: Joint that stops it at the high end.
    """

    low: float
    high: float
    low_joint: str
    high_joint: str


def synergy_ranges(problem: GraspProblem, sigma: Array, besides: Array) -> list[SynergyRange]:
    """Return the range of every synergy with all others as they are.

    Args:
        problem: The problem.
        sigma: σ [rad], of shape (n_s,).
        besides: What the posture has besides the synergies [rad], of shape (n_q,).
    """
    hand, basis = problem.hand, problem.synergies.basis
    q = problem.synergies.joint_angles(sigma) + besides
    found = []
    for index, value in enumerate(sigma):
        moved = np.flatnonzero(np.abs(basis[:, index]) > 1e-9)
        column = basis[moved, index]
        ends = np.sort(np.stack([(hand.lower - q)[moved] / column, (hand.upper - q)[moved] / column]), axis=0)
        low, high = int(ends[0].argmax()), int(ends[1].argmin())
        names = hand.joint_names[moved[low]], hand.joint_names[moved[high]]
        found.append(SynergyRange(float(value + ends[0, low]), float(value + ends[1, high]), *names))
    return found


def limit_marks(limits: SynergyRange) -> tuple[GuiSliderMark, ...]:
    """Return the marks of a slider: where joint limits stop the synergy, or where the slider itself ends."""
    low = limits.low if -REACH < limits.low < REACH else -REACH
    high = limits.high if -REACH < limits.high < REACH else REACH
    if high - low < LABEL_WIDTH:  # Too near for two labels.
        return GuiSliderMark(low, f"{fixed(low)} … {fixed(high)}"), GuiSliderMark(high, None)
    return GuiSliderMark(low, fixed(low)), GuiSliderMark(high, fixed(high))


def marks_of(limits: SynergyRange) -> tuple[float | tuple[float, str], ...]:
    """Return the marks as a new slider takes them."""
    return tuple(mark.value if mark.label is None else (mark.value, mark.label) for mark in limit_marks(limits))


def limits_text(ranges: list[SynergyRange]) -> str:
    """Return which joints stop the first synergies at both ends (Markdown)."""
    rows = ["| | from | stopped by | to | stopped by |", "|---|--:|---|--:|---|"]
    for index, entry in enumerate(ranges[:LISTED]):
        low, high = fixed(entry.low), fixed(entry.high)
        rows.append(f"| σ{index + 1} | {low} | {entry.low_joint} | {high} | {entry.high_joint} |")
    return "\n".join(rows)


def joint_text(grasp: Grasp) -> str:
    """Return the angle of every joint and where it is between its limits (Markdown)."""
    hand = grasp.problem.hand
    rows = ["| joint | from ° | now ° | to ° |", "|---|--:|--:|--:|"]
    for index, name in enumerate(hand.joint_names):
        low, now, high = np.degrees([hand.lower[index], grasp.joint_angles[index], hand.upper[index]])
        limit = " ⚠" if min(now - low, high - now) < 0.05 else ""
        rows.append(f"| {name}{limit} | {fixed(low, 0)} | {fixed(now, 1)} | {fixed(high, 0)} |")
    return "\n".join(rows)
