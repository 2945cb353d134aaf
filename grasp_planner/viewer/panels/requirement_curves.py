"""How the best attempt of a search comes to meet each requirement: curves and a table, each with its unit."""

from __future__ import annotations

import numpy as np
import viser
from viser import uplot

from ...grasp.grasp import FEASIBILITY_TOLERANCE, IterationRecord
from ...problem.problem import GraspProblem
from ...problem.term import Unit
from ...terms.registry import problem_constraints
from ...values import number_text
from ..text import quantity, readable, shown_unit

POINTS = 400
"""Most iterations that curves of a search show."""
MOST = 1e12
"""Largest violation that is drawn, in what is allowed."""
COLOURS = ("#c62839", "#2f6fde", "#118a4e", "#b7791f", "#7b4fd6", "#0b8f9c", "#d0488f", "#6b7280")
SAYS = "Violations of the best attempt so far, as powers of ten of what is allowed: met at 0 and below."


class RequirementCurves:
    """Curves of the attempt that came closest to meeting every requirement.

    Attributes:
        units: Unit of every requirement of the search, from the registry, by its name.
        best: Iterations of the best attempt.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        """Add the folder to the present container; it is shown with the first iteration."""
        self._gui = gui
        self._plot: viser.GuiUplotHandle | None = None
        self.folder = gui.add_folder("Requirements", expand_by_default=False, visible=False)
        with self.folder:
            gui.add_markdown(f"*{SAYS}*")
            self.table = gui.add_markdown("", order=1e9)  # always below the curves
        self.begin(None)

    def begin(self, problem: GraspProblem | None) -> None:
        """Forget what was drawn; a search for this problem begins."""
        wanted = problem_constraints(problem) if problem is not None else ()
        terms = [term for term in wanted if term.judged]
        self._scales = {term.name: term.scale for term in terms}
        self.units: dict[str, Unit] = {term.name: term.unit for term in terms}
        self.best: list[IterationRecord] = []
        self._present: list[IterationRecord] = []
        self._best_merit = self._present_merit = np.inf
        self.folder.visible = False
        if self._plot is not None:
            self._plot.remove()
            self._plot = None

    def add(self, records: list[IterationRecord]) -> None:
        """Take further iterations, and draw if they belong to the best attempt."""
        changed = False
        for record in records:
            if self._present and self._present[-1].start != record.start:
                self._present, self._present_merit = [], np.inf
            self._present.append(record)
            self._present_merit = min(self._present_merit, self._merit(record))
            if self._present_merit <= self._best_merit:
                self._best_merit, self.best, changed = self._present_merit, self._present, True
        if (changed or self.best is self._present) and self.units:
            self._draw()

    def label(self, name: str) -> str:
        """Return a requirement with the unit people read it in."""
        unit = shown_unit(self.units[name])
        return f"{readable(name)} [{unit}]" if unit else readable(name)

    def _merit(self, record: IterationRecord) -> float:
        """Return the largest violation of an iteration, each by what counts alike in its unit."""
        return max((self._scales[name] * record.violations[name] for name in self.units), default=0.0)

    def _draw(self) -> None:
        """Draw the best attempt."""
        shown, names = self.best[-POINTS:], list(self.units)
        steps = np.arange(len(self.best) - len(shown), len(self.best), dtype=float)
        found = np.array([[record.violations[name] for record in shown] for name in names]) / FEASIBILITY_TOLERANCE
        # Below a tenth of the tolerance a curve says nothing.
        data = (steps, *np.log10(np.clip(np.nan_to_num(found, nan=np.inf), 0.1, MOST)))
        if self._plot is None:
            self._plot = self._add_plot(data, names)
        else:
            self._plot.data = data
        self.table.content = self._table(shown[-1])
        self.folder.visible = True

    def _add_plot(self, data: tuple[np.ndarray, ...], names: list[str]) -> viser.GuiUplotHandle:
        """Add the plot, one curve for each requirement."""
        lines = (
            uplot.Series(
                label=self.label(name),
                stroke=COLOURS[index % len(COLOURS)],
                width=2,
                dash=(4.0, 4.0) if index >= len(COLOURS) else (),
            )
            for index, name in enumerate(names)
        )
        scales = {"x": uplot.Scale(time=False, auto=True), "y": uplot.Scale(auto=True)}
        with self.folder:
            return self._gui.add_uplot(data, (uplot.Series(label="iteration"), *lines), scales=scales, aspect=1.6)

    def _table(self, last: IterationRecord) -> str:
        """Return what the best attempt violates now, beside what is allowed (Markdown)."""
        rows = ["| requirement | off by | allowed | |", "|---|--:|--:|---|"]
        for name, unit in self.units.items():
            value = last.violations[name]
            mark = "✔" if value <= FEASIBILITY_TOLERANCE else "✘"
            # What is far below the tolerance is zero to a person.
            off = quantity(value, unit) if value > 0.01 * FEASIBILITY_TOLERANCE else "0"
            rows.append(f"| {readable(name)} | {off} | {quantity(FEASIBILITY_TOLERANCE, unit)} | {mark} |")
        return "\n".join([*rows, "", f"*Start {last.start + 1}, {number_text(len(self.best), 6)} iterations.*"])
