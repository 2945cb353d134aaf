"""The page of ``reproduce``: tables, redrawn figures, convergence and trade-off, as Markdown and as one HTML file."""

from __future__ import annotations

import html
import json
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..drawing.page_parts import html_images, html_page, html_table, markdown_table, new_figure, png
from ..drawing.picture import show_scene
from ..drawing.solids import grasp_scene
from ..files.writing import make_folder, write_bytes, write_text
from .reproduce import CellResult, ParetoPoint

HONESTY = (
    "The paper's synergies come from glove data that is not public. Ours are other sets, human ones first, so the "
    "numbers are comparable in kind and in value, not digit by digit. Each cell is the best of several starts; 'single "
    "runs' says how many runs from one random infeasible point end feasible. Iterations are those of both phases from "
    "the start that gave the grasp, and of all starts together; in table I every number of synergies is also started "
    "from the grasps with fewer. Times are of the whole search. An angle is undefined where the force ellipsoid has no "
    "longest axis: with one or two synergies it is unbounded along a plane or a line, and with more where the search "
    "drives α to infinity; the hand resists there with its structure and not with its motors. Along n_s F need not "
    "fall at every step: C sums over synergies, and the weights trade F for C. The paper itself gives one case twice "
    "(y, three synergies, 1e-6): 15.04 N and 13.95° in table I, 31.77 N and 22.38° in table II. It prints C_q = 0.1 "
    "with the unit of a stiffness; read here as 0.1 rad/(N m), while 0.1 N m/° would be 0.17 rad/(N m)."
)
PLAIN = "As in the paper nothing keeps the links out of the object here; plan does by default."
CLEAR = (
    "Remarks 1 and 2 are on, unlike in the tables of the paper: abduction angles keep their order, and the real "
    "geometry of every link keeps clear of the object, of the other fingers and of the palm by {margin:g} mm, but for "
    "the last links around the point fingertips; these touch with the ends of their tips only."
)
COLUMNS = (
    "table",
    "task",
    "n_s",
    "w_F/w_C",
    "F [N] paper",
    "F [N] ours",
    "floor [N]",
    "angle [°] paper",
    "angle [°] ours",
    "it. paper",
    "it. ours",
    "all starts",
    "feasible starts",
    "single runs",
    "time [s]",
    "max violation",
    "feasible",
)


def write_reproduction(
    folder: Path, cells: Sequence[CellResult], front: Sequence[ParetoPoint], *, seed: int, settings: str
) -> None:
    """Write ``reproduce.json``, ``reproduce.md``, ``reproduce.html`` and the figures into a folder.

    Args:
        folder: Folder to write into; made if needed.
        cells: Results of the tables, set of synergies by set; the figures show the first.
        front: The trade-off curve.
        seed: Seed of the run.
        settings: One line that names the settings.

    Raises:
        FileFormatError: If the folder can't be written.
    """
    first = by_synergies(cells)[0]
    figures = {
        "figure_2_y": _scenes(first, "y", "task: force along y (as Fig. 2)"),
        "figure_3_x": _scenes(first, "x", "task: force along x (as Fig. 3)"),
        "convergence": _convergence(first),
        "pareto": _pareto(front),
    }
    make_folder(folder)
    rows = json.dumps([cell.row() for cell in cells], indent=1, allow_nan=False)
    write_text(folder / "reproduce.json", rows + "\n")
    for name, data in figures.items():
        write_bytes(folder / f"{name}.png", data)
    write_text(folder / "reproduce.md", _markdown(cells, front, figures, seed, settings))
    write_text(folder / "reproduce.html", _html(cells, front, figures, seed, settings))


def by_synergies(cells: Sequence[CellResult]) -> list[list[CellResult]]:
    """Return the results of each set of synergies, in the order given."""
    found: dict[str, list[CellResult]] = {}
    for cell in cells:
        found.setdefault(cell.grasp.problem.synergies.name, []).append(cell)
    return list(found.values())


def set_title(cells: Sequence[CellResult]) -> str:
    """Return the name of the synergies and where they come from."""
    synergies = cells[0].grasp.problem.synergies
    return f"{synergies.name}: {' '.join(synergies.provenance.splitlines())}"


def page_notes(cells: Sequence[CellResult]) -> str:
    """Return what a reader has to know about the numbers: how ours differ, and whether links keep clear."""
    clearance = cells[0].grasp.problem.clearance
    note = CLEAR.format(margin=1e3 * clearance.margin) if clearance.needs_geometry and clearance.remark1 else PLAIN
    return f"{HONESTY} {note}"


def table_cells(result: CellResult) -> list[str]:
    """Return the texts of a row, in the order of :data:`COLUMNS`."""
    row, cell, search = result.row(), result.cell, result.grasp.search
    assert search is not None
    return [
        "I" if cell.table == 1 else "II",
        cell.direction,
        str(cell.n_synergies),
        f"{cell.weight_ratio:g}",
        f"{cell.force_norm:.2f}",
        f"{result.grasp.force_norm:.2f}",
        f"{result.grasp.force_norm_floor:.2f}",
        f"{cell.alignment_angle_deg:.2f}",
        "undefined" if result.angle is None else f"{result.angle:.2f}",
        str(cell.iterations),
        str(search.iterations + search.phase_one_iterations),
        str(result.all_iterations),
        f"{search.starts_feasible}/{search.starts_tried}",
        f"{result.single.feasible}/{result.single.tried}",
        f"{row['time_s']:.2f}",
        f"{row['max_violation']:.1e}",
        "yes" if result.grasp.feasible else "no",
    ]


def _front_rows(front: Sequence[ParetoPoint]) -> list[list[str]]:
    """Return the texts of the trade-off table."""
    return [
        [
            f"{point.weight_ratio:.2g}",
            f"{point.grasp.force_norm:.3f}",
            f"{point.grasp.task_index:.3g}",
            "undefined" if point.grasp.alignments[0][1] else f"{point.grasp.alignments[0][0]:.2f}",
        ]
        for point in front
    ]


def _markdown(
    cells: Sequence[CellResult], front: Sequence[ParetoPoint], figures: dict[str, bytes], seed: int, settings: str
) -> str:
    """Return the Markdown page."""
    lines = ["# The paper's tables, beside ours", "", f"{settings}; seed {seed}.", "", page_notes(cells), ""]
    for group in by_synergies(cells):
        lines += [f"**{set_title(group)}**", "", *markdown_table(COLUMNS, [table_cells(cell) for cell in group]), ""]
    for name in figures:
        lines += ["", f"![{name}]({name}.png)"]
    lines += ["", "## Trade-off between F and C, y task, three synergies", ""]
    lines += markdown_table(("w_F/w_C", "F [N]", "C", "angle [°]"), _front_rows(front))
    return "\n".join(lines) + "\n"


def _html(
    cells: Sequence[CellResult], front: Sequence[ParetoPoint], figures: dict[str, bytes], seed: int, settings: str
) -> str:
    """Return the page as one self-contained HTML file."""
    tables = "".join(
        f"<h2>{html.escape(set_title(group))}</h2>{html_table(COLUMNS, [table_cells(cell) for cell in group])}"
        for group in by_synergies(cells)
    )
    body = (
        f"<p>{html.escape(settings)}; seed {seed}.</p><p>{html.escape(page_notes(cells))}</p>"
        f"{tables}{html_images(figures)}"
        "<h2>Trade-off between F and C, y task, three synergies</h2>"
        f"{html_table(('w_F/w_C', 'F [N]', 'C', 'angle [°]'), _front_rows(front))}"
    )
    return html_page("The paper's tables, beside ours", body)


def _scenes(cells: Sequence[CellResult], direction: str, title: str) -> bytes:
    """Return the grasps of table I for one direction, with task and force ellipsoid."""
    chosen = [cell for cell in cells if cell.cell.table == 1 and cell.cell.direction == direction]
    figure = new_figure((16.0, 4.8))
    for column, result in enumerate(chosen):
        axes = figure.add_subplot(1, len(chosen), column + 1)
        palm = result.grasp.palm_pose.act(result.grasp.problem.hand.palm_in_root.translation)
        side = np.array([-palm[1], palm[0], 0.45 * math.hypot(palm[0], palm[1])])
        show_scene(axes, grasp_scene(result.grasp), side)
        angle = "no angle" if result.angle is None else f"{result.angle:.1f}°"
        axes.set_title(f"n_s = {result.cell.n_synergies}: F = {result.grasp.force_norm:.2f} N, {angle}", fontsize=10)
    figure.suptitle(title)
    return png(figure)


def _convergence(cells: Sequence[CellResult]) -> bytes:
    """Return objective and largest violation over the iterations of both phases, for table I."""
    figure = new_figure((14.0, 5.0))
    left, right = figure.subplots(1, 2)
    for result in (cell for cell in cells if cell.cell.table == 1):
        history = result.grasp.search.history if result.grasp.search else ()
        label = f"{result.cell.direction}, n_s = {result.cell.n_synergies}"
        style = "-" if result.cell.direction == "y" else "--"
        left.semilogy([max(record.objective, 1e-12) for record in history], style, label=label)
        violations = [max(max(record.violations.values()), 1e-12) for record in history]
        right.semilogy(violations, style, label=label)
    left.set(xlabel="iteration (phase one, then two)", ylabel="z", title="objective")
    right.set(xlabel="iteration (phase one, then two)", ylabel="largest violation [SI]", title="violation")
    right.axhline(1e-6, color="black", linewidth=0.8)
    left.legend(fontsize=8)
    return png(figure)


def _pareto(front: Sequence[ParetoPoint]) -> bytes:
    """Return F against C and against the angle over the ratio of weights."""
    figure = new_figure((14.0, 5.0))
    left, right = figure.subplots(1, 2)
    force = [point.grasp.force_norm for point in front]
    left.loglog([max(point.grasp.task_index, 1e-16) for point in front], force, "o-")
    left.set(xlabel="C", ylabel="F [N]", title="trade-off over w_F/w_C (y task, n_s = 3)")
    right.semilogy([point.grasp.alignments[0][0] for point in front], force, "o-")
    right.set(xlabel="angle between task and ellipsoid [°]", ylabel="F [N]", title="F against the angle")
    return png(figure)
