"""Grasps beside each other and over an exported scene, in words and tables. No display code here."""

from __future__ import annotations

import html

from ..grasp.grasp import Grasp
from ..problem.settings import text_of_numbers
from .text import CARD, fixed, number
from .verdict_card import headline, verdict_card


def compare_table(one: Grasp, other: Grasp) -> str:
    """Return two grasps side by side (Markdown)."""
    rows = ["| | shown | pinned |", "|---|--:|--:|"]
    rows.append(f"| verdict | {'✔' if one.feasible else '✘'} | {'✔' if other.feasible else '✘'} |")
    rows.append(f"| synergies | {one.problem.n_synergies} | {other.problem.n_synergies} |")
    rows.append(f"| task | {one.problem.tasks[0].text} | {other.problem.tasks[0].text} |")
    for (symbol, left, _), (_, right, _) in zip(headline(one), headline(other), strict=True):
        rows.append(f"| {symbol} | {left} | {right} |")
    for i, frame in enumerate(one.problem.frames):
        names = [entry.name for entry in other.problem.frames]
        right = number(float(other.normal_forces[names.index(frame.name)])) if frame.name in names else "–"
        rows.append(f"| f_n {frame.name} | {number(float(one.normal_forces[i]))} N | {right} N |")
    return "\n".join(rows)


def export_overlay(grasp: Grasp, title: str) -> str:
    """Return the HTML that is laid over an exported scene: title, verdict, numbers."""
    rows = "".join(
        f"<tr><td>{html.escape(frame.name)}</td><td>{fixed(float(grasp.normal_forces[i]), 3)} N</td>"
        f"<td>{fixed(float(grasp.friction_margins[i]), 3)} N</td></tr>"
        for i, frame in enumerate(grasp.problem.frames)
    )
    tasks = html.escape(", ".join(task.text for task in grasp.problem.tasks))
    return (
        "<div id='grasp-numbers' style='position:fixed;left:12px;top:12px;z-index:1000;max-width:340px;"
        "pointer-events:none'>"
        f"<div style='{CARD}overflow-wrap:anywhere'><b>{html.escape(title)}</b><br>"
        f"{html.escape(grasp.problem.grasp_object.text)}<br>"
        f"task {tasks} · {grasp.problem.n_synergies} synergies · "
        f"μ = {text_of_numbers(grasp.problem.parameters.friction)}</div>"
        f"{verdict_card(grasp)}"
        f"<div style='{CARD}'><table style='width:100%;font-size:12px'><tr><th align=left>contact</th>"
        f"<th align=left>normal force</th><th align=left>friction margin</th></tr>{rows}</table></div></div>"
    )
