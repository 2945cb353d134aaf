"""Figures of a synergy study: success against the number of synergies, and margins against the load that is lost."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence

from ..drawing.page_parts import new_figure, png
from .study_margins import MARGINS
from .study_rows import StudyRow
from .study_statistics import prediction, roc_curve, simulated
from .synergy_study import StudySettings

Measure = Callable[[Sequence[StudyRow]], float]
SHOWN = 6
"""Margins that are drawn: those that predict best."""


def feasible_share(rows: Sequence[StudyRow]) -> float:
    """Return the share of problems with a feasible plan; nan without problems."""
    return sum(row.feasible for row in rows) / len(rows) if rows else math.nan


def passed_share(rows: Sequence[StudyRow]) -> float:
    """Return the share of the feasible plans that held all six pushes; nan without any."""
    found = [row for row in rows if row.feasible]
    return sum(bool(row.passed) for row in found) / len(found) if found else math.nan


def median_load(rows: Sequence[StudyRow]) -> float:
    """Return the median of the weakest load held [N] over the grasps that were simulated; nan without any."""
    loads = [row.weakest_force for row in rows if row.weakest_force is not None]
    return statistics.median(loads) if loads else math.nan


MEASURES: tuple[tuple[str, Measure], ...] = (
    ("share of problems with a feasible plan", feasible_share),
    ("share of feasible plans that held six pushes", passed_share),
    ("median weakest load held [N]", median_load),
)
"""What is drawn against the number of synergies."""


def synergy_figure(rows: Sequence[StudyRow], settings: StudySettings) -> bytes:
    """Return :data:`MEASURES` against the number of synergies, a row for each kind of object, as PNG."""
    figure = new_figure((15.0, 4.2 * len(settings.object_kinds)))
    grid = figure.subplots(len(settings.object_kinds), len(MEASURES), squeeze=False)
    for kind, line in zip(settings.object_kinds, grid, strict=True):
        for axes, (label, measure) in zip(line, MEASURES, strict=True):
            for name in settings.synergy_sets:
                groups = [group_of(rows, name, kind, count) for count in settings.counts]
                axes.plot(settings.counts, [measure(group) for group in groups], "o-", label=name)
            axes.set(xlabel="number of synergies", ylabel=label, title=kind)
            top = {} if measure is median_load else {"top": 1.02}
            axes.set_ylim(bottom=-0.02, **top)
            axes.legend(fontsize=8)
    return png(figure)


def group_of(rows: Sequence[StudyRow], synergy_set: str, kind: str, n_synergies: int) -> list[StudyRow]:
    """Return the rows of a synergy set, kind of object and number of synergies."""
    wanted = (synergy_set, kind, n_synergies)
    return [row for row in rows if row.key[:3] == wanted]


def best_margins(rows: Sequence[StudyRow]) -> list[str]:
    """Return the margins with the largest rank correlation, either sign, at most :data:`SHOWN`."""
    strength = {name: abs(prediction(rows, name).rho) for name in MARGINS}
    known = [name for name in MARGINS if math.isfinite(strength[name])]
    return sorted(known, key=lambda name: -strength[name])[:SHOWN]


def margin_figure(rows: Sequence[StudyRow]) -> bytes:
    """Return the weakest load against the best margins, as PNG."""
    names = best_margins(rows) or list(MARGINS)[:SHOWN]
    columns = 3
    lines = math.ceil(len(names) / columns)
    figure = new_figure((14.0, 4.2 * lines))
    for index, name in enumerate(names):
        axes = figure.add_subplot(lines, columns, index + 1)
        values, loads, held = simulated(rows, name)
        for chosen, colour, label in ((held, "tab:blue", "passed"), (~held, "tab:red", "failed")):
            axes.plot(values[chosen], loads[chosen], ".", color=colour, label=label)
        if name.startswith(("passive", "re-squeezed")) and len(values):
            reach = min(float(values.max()), float(loads.max()))
            axes.plot([0.0, reach], [0.0, reach], "-", color="0.7", label="equal")
        axes.set(xlabel=name, ylabel="weakest load held [N]")
        axes.legend(fontsize=8)
    return png(figure)


def roc_figure(rows: Sequence[StudyRow]) -> bytes:
    """Return the ROC curves of the best margins, as PNG; without curves if all grasps passed or all failed."""
    figure = new_figure((6.0, 6.0))
    axes = figure.subplots()
    for name in best_margins(rows):
        area = prediction(rows, name).roc_area
        if math.isfinite(area):
            axes.step(*roc_curve(rows, name), where="post", label=f"{name}: {area:.2f}")
    if not axes.lines:
        axes.text(0.5, 0.6, "undefined: all grasps passed, or all failed", ha="center")
    axes.plot([0.0, 1.0], [0.0, 1.0], "--", color="0.7", label="chance: 0.50")
    axes.set(xlabel="share of failing grasps let through", ylabel="share of passing grasps let through")
    axes.legend(fontsize=8, loc="lower right", title="area under the curve", title_fontsize=8)
    return png(figure)
