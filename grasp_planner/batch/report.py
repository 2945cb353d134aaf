"""The report of a run: one HTML file with tables, plots and pictures that needs no network."""

from __future__ import annotations

import html
import shlex
from collections.abc import Sequence
from pathlib import Path

from ..analysis.ladder import verdict_ladder
from ..drawing.picture import draw_grasp
from ..exceptions import GraspPlannerError
from ..files.writing import write_text
from .errors import ResultsError
from .report_page import PAGE
from .report_plots import boxes, histograms, png_data, share_bars
from .report_tables import failure_table, group_table, groups, numbers, share_of, table
from .results import load_grasps, load_table
from .rows import Row
from .run_files import RunInfo, read_run_info

MAX_LISTED = 5000
"""Rows listed one by one."""
MAX_GROUPS = 40
"""Most values of a column for a table of its own."""
VIEWER_PORT = 8080
"""Port of the links to the viewer; on the page it can be changed."""
LINK_DIGITS = 16
"""Digits of the run's hash that its links carry, so that no other run's viewer answers."""
_COLUMNS = [
    *("row", "hand", "object", "object_kind", "task", "n_synergies", "seed", "status", "reason", "message"),
    *("feasible", "force_norm", "alignment_angle_deg", "objective", "force_weight", "task_weight", "time_s"),
    "version",
]


def write_report(folder: str | Path, output: Path | None = None, *, pictures: int = 6, hand: str | None = None) -> Path:
    """Write the report of a run.

    Args:
        folder: Folder of the run; it may still be running.
        output: The HTML file; ``report.html`` in the folder if left out.
        pictures: How many of the best grasps to draw.
        hand: Hand to take instead of the one that each case names: name or description file.

    Returns:
        The HTML file.

    Raises:
        ResultsError: If there is no run, it has no rows yet, or the file can't be written.
    """
    folder = Path(folder)
    info = read_run_info(folder)
    rows = load_table(folder, _COLUMNS).to_pylist()
    if not rows:
        raise ResultsError(folder, "no rows yet")
    body = _body(folder, info, rows, pictures, hand)
    text = PAGE.format(title=html.escape(f"Batch {folder.name}"), body=body, run=info.spec_hash[:LINK_DIGITS])
    path = output or folder / "report.html"
    write_text(path, text, ResultsError)
    return path


def view_command(folder: str | Path, row: int) -> str:
    """Return the command that opens a row in the viewer."""
    return f"grasp-planner view {shlex.quote(str(folder))} --row {row}"


def row_link(info: RunInfo, row: int, words: str) -> str:
    """Return an HTML link that shows a row in the viewer of this run, while that runs on this machine."""
    address = f"http://127.0.0.1:{VIEWER_PORT}/?run={info.spec_hash[:LINK_DIGITS]}&amp;row={row}"
    return f'<a data-row="{row}" target="grasp-viewer" href="{address}">{html.escape(words)}</a>'


def best_rows(rows: Sequence[Row], count: int) -> list[Row]:
    """Return the best feasible rows: of each hand, object kind, weights and n_s the one of least objective.

    Objectives compare within such a group only, so the groups take turns.

    Args:
        rows: Rows of a run.
        count: Most rows to return.
    """
    best: dict[tuple[object, ...], Row] = {}
    for values in rows:
        if values["feasible"]:
            names = ("hand", "object_kind", "n_synergies", "force_weight", "task_weight")
            key = tuple(values[name] for name in names)
            if key not in best or values["objective"] < best[key]["objective"]:
                best[key] = values
    return list(best.values())[:count]


def _body(folder: Path, info: RunInfo, rows: Sequence[Row], pictures: int, hand: str | None) -> str:
    """Return the body of the page."""
    parts = [_summary(folder, info, rows), _viewer_note(folder, info), "<h2>Success</h2>"]
    for column, title in (
        ("hand", "hand"),
        ("object_kind", "shape"),
        ("object", "object"),
        ("task", "task"),
        ("n_synergies", "n_s"),
    ):
        found = len({values[column] for values in rows})
        if found <= MAX_GROUPS:
            parts.append(group_table(rows, column, title))
        else:
            parts.append(f"<p>By {title}: {found} different values, not listed.</p>")
    parts += ["<h2>Distributions</h2>", _plots(rows)]
    parts += ["<h2>Failures by reason</h2>", failure_table(rows)]
    parts += ["<h2>Best grasps</h2>", _pictures(folder, info, best_rows(rows, pictures), hand)]
    parts += ["<h2>Rows</h2>", _row_table(folder, info, rows)]
    return "\n".join(parts)


def _summary(folder: Path, info: RunInfo, rows: Sequence[Row]) -> str:
    """Return the heading and what the run is."""
    share = share_of(rows)
    low, high = share.interval
    times = numbers(rows, "time_s", feasible=False)
    versions = ", ".join(sorted({str(values["version"]) for values in rows}))
    facts = [
        ("cases", f"{len(rows)} of {info.cases} done"),
        ("feasible", f"{share.successes} ({100 * share.value:.1f} %, 95 % interval {100 * low:.1f}–{100 * high:.1f})"),
        ("planning time", f"{sum(times):.0f} s in all, {sum(times) / max(len(times), 1):.2f} s a case"),
        ("hash of the cases", info.spec_hash),
        ("grasp_planner", versions),
    ]
    spec = f"<details><summary>Specification</summary><pre>{html.escape(info.spec)}</pre></details>"
    return f"<h1>Batch {html.escape(folder.name)}</h1>{table(['', ''], facts)}{spec if info.spec else ''}"


def _plots(rows: Sequence[Row]) -> str:
    """Return the plots against the number of synergies."""
    by_n = groups(rows, "n_synergies")
    plots = [share_bars({name: share_of(some) for name, some in by_n.items()}, "number of synergies n_s")]
    for column, label in (("force_norm", "F [N]"), ("alignment_angle_deg", "angle to the task [°]"), ("time_s", "")):
        found = {name: numbers(some, column, feasible=column != "time_s") for name, some in by_n.items()}
        found = {name: values for name, values in found.items() if values}
        if not found:
            continue
        if label:
            plots.append(histograms({f"n_s = {name}": values for name, values in found.items()}, label))
        plots.append(boxes(found, "number of synergies n_s", label or "planning time [s]"))
    return '<div class="plots">' + "".join(f"<figure>{plot}</figure>" for plot in plots) + "</div>"


def _pictures(folder: Path, info: RunInfo, rows: Sequence[Row], hand: str | None) -> str:
    """Return drawings of some rows."""
    parts = []
    for values in rows:
        row = int(values["row"])
        try:
            grasp = load_grasps(folder, [row], hand)[0]
        except GraspPlannerError as error:
            parts.append(f"<p>Row {row} can't be drawn: {html.escape(str(error))}</p>")
            continue
        command = html.escape(view_command(folder, row))
        ladder = "".join(f"<br>{html.escape(rung.sentence)}" for rung in verdict_ladder(grasp))
        parts.append(
            f'<figure><img alt="grasp of row {row}" src="{png_data(draw_grasp(grasp))}">'
            f"<figcaption>{row_link(info, row, f'Row {row}')}: <code>{command}</code>{ladder}</figcaption></figure>"
        )
    return "".join(parts) or "<p>None is feasible.</p>"


def _viewer_note(folder: Path, info: RunInfo) -> str:
    """Return how rows are opened in the viewer."""
    command = html.escape(f"grasp-planner view {shlex.quote(str(folder))}")
    return (
        f'<p class="note">The links show a row in the viewer while <code>{command}</code> runs on this machine. '
        f'It prints its address; port <input id="port" type="number" min="1" max="65535" value="{VIEWER_PORT}"> '
        f'if it is another. Row <input id="row" type="number" min="0" max="{info.cases - 1}" value="0"> '
        f"{row_link(info, 0, 'open it').replace('<a ', '<a id=any ')}. With <code>--row K</code> "
        "the command opens row K itself.</p>"
    )


def _row_table(folder: Path, info: RunInfo, rows: Sequence[Row]) -> str:
    """Return the list of rows, each with a link and the command that opens it."""
    head = [
        "row",
        "or open it with",
        "status",
        "F [N]",
        "angle [°]",
        "time [s]",
        "hand",
        "object",
        "task",
        "n_s",
        "seed",
    ]
    lines = []
    for values in rows[:MAX_LISTED]:
        figures = [values[key] for key in ("force_norm", "alignment_angle_deg", "time_s")]
        row = int(values["row"])
        cells = [row_link(info, row, str(row)), f"<code>{html.escape(view_command(folder, row))}</code>"]
        cells += [html.escape(str(values["status"])), *("–" if value is None else f"{value:.3g}" for value in figures)]
        cells += [html.escape(str(values[key])) for key in ("hand", "object", "task", "n_synergies", "seed")]
        lines.append(cells)
    more = "" if len(rows) <= MAX_LISTED else f"<p>Only the first {MAX_LISTED} of {len(rows)} rows are listed.</p>"
    search = '<p><input id="filter" placeholder="filter: words that all have to occur"></p>'
    return f'{search}{more}<div class="rows">{table(head, lines, cell=str)}</div>'
