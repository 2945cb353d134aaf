"""Grasps beside each other, in words and tables. No display code here."""

from __future__ import annotations

from ..grasp.grasp import Grasp
from ..values import number_text
from .text import task_words
from .verdict_card import headline


def compare_table(one: Grasp, other: Grasp) -> str:
    """Return two grasps side by side (Markdown)."""
    rows = ["| | shown | pinned |", "|---|--:|--:|"]
    rows.append(f"| verdict | {'✔' if one.feasible else '✘'} | {'✔' if other.feasible else '✘'} |")
    rows.append(f"| synergies | {one.problem.n_synergies} | {other.problem.n_synergies} |")
    rows.append(f"| task | {task_words(one.problem.tasks[0])} | {task_words(other.problem.tasks[0])} |")
    for (symbol, left, _), (_, right, _) in zip(headline(one), headline(other), strict=True):
        rows.append(f"| {symbol} | {left} | {right} |")
    for i, frame in enumerate(one.problem.frames):
        names = [entry.name for entry in other.problem.frames]
        right = number_text(float(other.normal_forces[names.index(frame.name)])) if frame.name in names else "–"
        rows.append(f"| f_n {frame.name} | {number_text(float(one.normal_forces[i]))} N | {right} N |")
    return "\n".join(rows)
