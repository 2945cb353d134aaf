"""The page of a synergy study: success and load against the number of synergies, and what predicts it."""

from __future__ import annotations

import html
import math
import statistics
from collections.abc import Sequence
from pathlib import Path

from .exceptions import FileFormatError
from .page_parts import html_images, html_page, html_table, markdown_table, new_figure, png
from .synergy_study import MARGINS, StudyRow, StudySettings, area_under_roc, rank_correlation, simulated_pairs

TITLE = "Physics against the number of synergies"
HONESTY = (
    "Every problem is a cylinder of 20–45 mm radius and a random force direction, planned once; the first feasible "
    "grasp is taken. A grasp passes if the object stays within 5 cm and 15° under each of six pushes; the weakest load "
    "is the largest force held in the weakest of these directions. The hand is moved by its n_s references and its "
    "joint springs alone, its palm is fixed; neither plan nor simulation limits what its motors can give. In the "
    "table, share is that of the feasible grasps that passed; load (weakest, N), F (N), moved (of the object at rest, "
    "mm) and error (of the normal forces at rest, relative to F) are medians over the feasible ones. Grasps refused "
    "for overlaps are counted as not passed and left out of the correlations; grasps lost before any push count with "
    "0 N."
)
COUNT_COLUMNS = ("set", "n_s", "all", "feasible", "refused", "passed", "share", "load", "F", "moved", "error")
MARGIN_COLUMNS = ("static margin", "Spearman ρ", "p", "grasps", "area under ROC")


def write_study(folder: Path, rows: Sequence[StudyRow], settings: StudySettings) -> None:
    """Write ``study.md``, ``study.html`` and the figures into the folder of a study.

    Args:
        folder: The folder.
        rows: All rows.
        settings: What was studied.

    Raises:
        FileFormatError: If the folder can't be written.
    """
    figures = {"synergies": synergy_figure(rows, settings), "margins": margin_figure(rows)}
    about = settings_text(settings)
    counts, margins = count_rows(rows, settings), margin_rows(rows)
    lines = [f"# {TITLE}", "", about, "", HONESTY, "", "![synergies](synergies.png)", ""]
    lines += [*markdown_table(COUNT_COLUMNS, counts), "", "## What predicts the load that is lost", ""]
    lines += [*markdown_table(MARGIN_COLUMNS, margins), "", "![margins](margins.png)", ""]
    body = (
        f"<p>{html.escape(about)}</p><p>{html.escape(HONESTY)}</p>"
        f"{html_images({'synergies': figures['synergies']})}{html_table(COUNT_COLUMNS, counts)}"
        f"<h2>What predicts the load that is lost</h2>{html_table(MARGIN_COLUMNS, margins)}"
        f"{html_images({'margins': figures['margins']})}"
    )
    try:
        for name, data in figures.items():
            (folder / f"{name}.png").write_bytes(data)
        (folder / "study.md").write_text("\n".join(lines), encoding="utf-8")
        (folder / "study.html").write_text(html_page(TITLE, body), encoding="utf-8")
    except OSError as error:
        raise FileFormatError(folder, f"can't be written: {error.strerror}") from None


def settings_text(settings: StudySettings) -> str:
    """Return the settings in one sentence."""
    test = settings.test
    what = "links keep clear" if settings.clearance else "no clearance: only fingertips collide"
    contacts = settings.contact_set or "the first"
    return (
        f"Hand {settings.hand}, contact set {contacts}, {what}; {settings.problems} problems each; protocol "
        f"{test.name} with pushes of {test.force:g} N, squeeze × {settings.squeeze:g}."
    )


def count_rows(rows: Sequence[StudyRow], settings: StudySettings) -> list[list[str]]:
    """Return the texts of the table of counts."""
    table = []
    for name in settings.synergy_sets:
        for count in settings.counts:
            mine = [row for row in rows if row.synergy_set == name and row.n_synergies == count]
            found = [row for row in mine if row.feasible]
            passed = sum(bool(row.passed) for row in found)
            table.append(
                [
                    name,
                    str(count),
                    str(len(mine)),
                    str(len(found)),
                    str(sum(bool(row.refused) for row in found)),
                    str(passed),
                    f"{100 * passed / len(found):.0f} %" if found else "–",
                    _median([row.weakest_force for row in found], "{:.2f}"),
                    _median([(row.margins or {}).get("F") for row in found], "{:.2f}"),
                    _median([_times(1e3, row.rest_displacement) for row in found], "{:.3f}"),
                    _median([_times(100.0, row.normal_force_error) for row in found], "{:.1f} %"),
                ]
            )
    return table


def margin_rows(rows: Sequence[StudyRow]) -> list[list[str]]:
    """Return the texts of the table of margins."""
    table = []
    for name in MARGINS:
        rho, p_value, count = rank_correlation(rows, name)
        area = area_under_roc(rows, name)
        table.append([name, _number(rho, "+.2f"), _number(p_value, ".1e"), str(count), _number(area, ".2f")])
    return table


def synergy_figure(rows: Sequence[StudyRow], settings: StudySettings) -> bytes:
    """Return success and weakest load against the number of synergies, one line for each set, as PNG."""
    figure = new_figure((14.0, 5.0))
    left, right = figure.subplots(1, 2)
    for name in settings.synergy_sets:
        counts, feasible, passed, load = [], [], [], []
        for count in settings.counts:
            mine = [row for row in rows if row.synergy_set == name and row.n_synergies == count]
            if not mine:
                continue
            loads = [row.weakest_force for row in mine if row.weakest_force is not None]
            counts.append(count)
            feasible.append(sum(row.feasible for row in mine) / len(mine))
            passed.append(sum(bool(row.passed) for row in mine) / len(mine))
            load.append(statistics.median(loads) if loads else math.nan)
        (line,) = left.plot(counts, passed, "o-", label=f"{name}: six pushes held")
        left.plot(counts, feasible, "--", color=line.get_color(), label=f"{name}: feasible plan")
        right.plot(counts, load, "o-", label=name)
    left.set(xlabel="number of synergies", ylabel="share of all problems", ylim=(-0.02, 1.02))
    right.set(xlabel="number of synergies", ylabel="median of the weakest load held [N]")
    right.set_ylim(bottom=0.0)
    left.legend(fontsize=8)
    right.legend(fontsize=8)
    return png(figure)


def margin_figure(rows: Sequence[StudyRow]) -> bytes:
    """Return the weakest load against every static margin, as PNG."""
    columns = 3
    lines = math.ceil(len(MARGINS) / columns)
    figure = new_figure((14.0, 4.2 * lines))
    for index, name in enumerate(MARGINS):
        axes = figure.add_subplot(lines, columns, index + 1)
        for passed, colour in ((True, "tab:blue"), (False, "tab:red")):
            points = [(value, load) for value, load, held in simulated_pairs(rows, name) if held == passed]
            label = "passed" if passed else "failed"
            axes.plot([x for x, _ in points], [y for _, y in points], ".", color=colour, label=label)
        axes.set(xlabel=name, ylabel="weakest load held [N]")
        axes.legend(fontsize=8)
    return png(figure)


def _median(values: Sequence[float | None], form: str) -> str:
    """Return the median of the values there are."""
    known = [value for value in values if value is not None]
    return form.format(statistics.median(known)) if known else "–"


def _times(factor: float, value: float | None) -> float | None:
    """Return a multiple of a value, if there is one."""
    return None if value is None else factor * value


def _number(value: float, form: str) -> str:
    """Return a number, or a dash where it is undefined."""
    return format(value, form) if math.isfinite(value) else "–"
