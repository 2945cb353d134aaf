"""The page of a synergy study: success and load against the number of synergies, and what predicts it."""

from __future__ import annotations

import html
import math
import statistics
from collections.abc import Callable, Sequence
from pathlib import Path

from ..drawing.page_parts import html_images, html_page, html_table, markdown_table
from ..files.writing import write_bytes, write_text
from ..judge.margins import UNBOUNDED
from .study_margins import MARGINS
from .study_rows import StudyRow
from .study_statistics import prediction
from .survival_tables import (
    CERTIFICATE,
    CERTIFICATE_COLUMNS,
    SURVIVAL,
    SURVIVAL_COLUMNS,
    certificate_rows,
    survival_rows,
)
from .synergy_study import StudySettings
from .synergy_study_plots import group_of, margin_figure, roc_figure, synergy_figure

TITLE = "Physics against the number of synergies"
HONESTY = (
    "Every problem is a random object of its kind (cylinders of 20–45 mm radius, spheres of 25–45 mm, boxes of "
    "40–80 mm edges, …) of 200 g and a random force direction, planned once; found: the best feasible grasp. It "
    "passes if the object stays within 5 cm and 15° under each of six pushes; load is the largest force held in "
    "the weakest of these directions; it and F are medians; the share that passed is that of the grasps found. "
    "The hand is moved by its n_s references and its joint springs alone, its palm is fixed; nothing limits its "
    "motors in the simulation. Grasps refused for overlaps are not simulated: they count as not passed, and are "
    "left out of medians, rest and correlations. Grasps lost before any push count with 0 N."
)
REST = (
    "At rest, before any push, over the grasps that were simulated, median and worst: displacement of the object from "
    "its planned pose, and error: the difference of simulated and planned normal forces relative to F. The shares "
    "count objects within 1 mm and errors within 10 %. “lost” is beyond 5 cm or 15°."
)
PREDICTION = (
    "Every static margin, of the grasp as simulated, against the weakest load held (Spearman) and against passing (area"
    " under the ROC: the chance that it is larger for a grasp that passed than for one that failed), over all rows. "
    f"“Passive” holds the references; “re-squeezed” lets the synergies answer. What nothing bounds counts as "
    f"{UNBOUNDED:g}."
)
GROUP_COLUMNS = ("set", "object", "n_s")
COUNT_COLUMNS = (*GROUP_COLUMNS, "all", "found", "%", "refused", "passed", "%", "load [N]", "F [N]")
REST_COLUMNS = (*GROUP_COLUMNS, "tested", "moved [mm]", "worst", "% ≤ 1 mm", "error", "worst", "% ≤ 10 %")
MARGIN_COLUMNS = ("static margin", "grasps", "passed", "Spearman ρ", "p", "area under ROC")
SMALL_MOTION, SMALL_ERROR = 1e-3, 0.1
"""What counts as resting as planned [m], [1]."""


def write_study(folder: Path, rows: Sequence[StudyRow], settings: StudySettings) -> None:
    """Write ``study.md``, ``study.html`` and the figures into the folder of a study.

    Args:
        folder: The folder.
        rows: All rows.
        settings: What was studied.

    Raises:
        FileFormatError: If the folder can't be written.
    """
    figures = {"synergies": synergy_figure(rows, settings), "roc": roc_figure(rows), "margins": margin_figure(rows)}
    about = settings_text(settings)
    lines = [f"# {TITLE}", "", about, "", HONESTY, ""]
    body = f"<p>{html.escape(about)}</p><p>{html.escape(HONESTY)}</p>"
    parts: tuple[tuple[str, str, tuple[str, ...], tuple[str, ...], list[list[str]]], ...] = (
        ("What holds", "", ("synergies",), COUNT_COLUMNS, count_rows(rows, settings)),
        ("At rest", REST, (), REST_COLUMNS, rest_rows(rows, settings)),
        ("What predicts the load that is lost", PREDICTION, ("roc", "margins"), MARGIN_COLUMNS, prediction_rows(rows)),
    )
    if settings.errors:
        parts += (
            ("What closing survives", SURVIVAL, (), SURVIVAL_COLUMNS, survival_rows(rows, settings)),
            (
                "What the certificate of closing says of it",
                CERTIFICATE,
                (),
                CERTIFICATE_COLUMNS,
                certificate_rows(rows),
            ),
        )
    for title, text, images, columns, table in parts:
        lines += [f"## {title}", "", *([text, ""] if text else []), *markdown_table(columns, table), ""]
        lines += [line for name in images for line in (f"![{name}]({name}.png)", "")]
        body += f"<h2>{title}</h2><p>{html.escape(text)}</p>{html_table(columns, table)}"
        body += html_images({name: figures[name] for name in images})
    for name, data in figures.items():
        write_bytes(folder / f"{name}.png", data)
    write_text(folder / "study.md", "\n".join(lines))
    write_text(folder / "study.html", html_page(TITLE, body))


def settings_text(settings: StudySettings) -> str:
    """Return the settings in a few sentences."""
    test = settings.test
    what = "links keep clear" if settings.clearance else "no clearance: only fingertips collide"
    contacts = settings.contact_set or "the default"
    plans = "with the standard load cases" if settings.loads else "without load cases"
    if settings.friction_safety is not None:
        plans += f", cones of μ/{settings.friction_safety:g}"
    if settings.joint_compliance is not None:
        plans += f", joints of {settings.joint_compliance:g} rad/(N m)"
    plans += ", by the paper's force law and weights" if settings.paper else ""
    plans += ", objects on a table" if settings.table else ""
    closing = settings.error_test
    errors = f"; with errors protocol {closing.name}, {closing.firmness:g} times" if settings.errors else ""
    limits = [f"{settings.starts} starts, {settings.enough} feasible ones enough"]
    for limit, kind in ((settings.time_limit_s, "wall"), (settings.cpu_limit_s, "processor")):
        limits += [] if limit is None else [f"{limit:g} s of {kind} time"]
    return (
        f"Hand {settings.hand}, contact set {contacts}, {what}; planned {plans}, at most {' and '.join(limits)} a "
        f"search; {settings.problems} problems each; protocol {test.name} with pushes of {test.force:g} N, squeeze × "
        f"{settings.squeeze:g}, motors squeezing to {test.firmness:g} times the planned efforts{errors}."
    )


def count_rows(rows: Sequence[StudyRow], settings: StudySettings) -> list[list[str]]:
    """Return the texts of the table of what holds, a row for each set, kind of object and number of synergies."""
    table = []
    for name, group in _groups(rows, settings):
        found = [row for row in group if row.feasible]
        tested = [row for row in found if not row.refused]
        table.append(
            [
                *name,
                str(len(group)),
                str(len(found)),
                _share(len(found), len(group)),
                str(len(found) - len(tested)),
                str(sum(bool(row.passed) for row in found)),
                _share(sum(bool(row.passed) for row in found), len(found)),
                _over([row.weakest_force for row in tested], statistics.median, "{:.2f}"),
                _over([(row.margins or {}).get("F [N]") for row in tested], statistics.median, "{:.2f}"),
            ]
        )
    return table


def rest_rows(rows: Sequence[StudyRow], settings: StudySettings) -> list[list[str]]:
    """Return the texts of the table of what was seen at rest."""
    table = []
    for name, group in _groups(rows, settings):
        tested = [row for row in group if row.rest_held is not None]
        # An object that was lost is infinitely far away, and so are its forces from the plan.
        ways = [1e3 * _at_rest(row, row.rest_displacement) for row in tested]
        errors = [100.0 * _at_rest(row, row.normal_force_error) for row in tested]
        table.append(
            [
                *name,
                str(len(tested)),
                _over(ways, statistics.median, "{:.3f}"),
                _over(ways, max, "{:.3f}"),
                _share(sum(value <= 1e3 * SMALL_MOTION for value in ways), len(tested)),
                _over(errors, statistics.median, "{:.1f} %"),
                _over(errors, max, "{:.1f} %"),
                _share(sum(value <= 100.0 * SMALL_ERROR for value in errors), len(tested)),
            ]
        )
    return table


def prediction_rows(rows: Sequence[StudyRow]) -> list[list[str]]:
    """Return the texts of the table of margins, in their order."""
    table = []
    for name in MARGINS:
        found = prediction(rows, name)
        numbers = [_number(found.rho, "+.2f"), _number(found.p_value, ".1e"), _number(found.roc_area, ".2f")]
        table.append([name, str(found.grasps), str(found.passed), *numbers])
    return table


def _groups(rows: Sequence[StudyRow], settings: StudySettings) -> list[tuple[list[str], list[StudyRow]]]:
    """Return name and rows of every set, kind of object and number of synergies."""
    return [
        ([name, kind, str(count)], group_of(rows, name, kind, count))
        for name in settings.synergy_sets
        for kind in settings.object_kinds
        for count in settings.counts
    ]


def _at_rest(row: StudyRow, value: float | None) -> float:
    """Return what was seen at rest; infinite if the object was lost."""
    return value if row.rest_held and value is not None else math.inf


def _over(values: Sequence[float | None], measure: Callable[[list[float]], float], form: str) -> str:
    """Return a measure of the values there are; "lost" where it is infinite."""
    known = [value for value in values if value is not None]
    if not known:
        return "–"
    value = measure(known)
    return form.format(value) if math.isfinite(value) else "lost"


def _share(count: int, total: int) -> str:
    """Return a share in percent."""
    return f"{100 * count / total:.0f}" if total else "–"


def _number(value: float, form: str) -> str:
    """Return a number, or that it is undefined."""
    return format(value, form) if math.isfinite(value) else "undefined"
