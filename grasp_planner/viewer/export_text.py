"""What is laid over an exported scene: verdict, story, legend, tables and the grasp's JSON, as HTML."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Sequence

from ..grasp.grasp import Grasp
from ..grasp.joint_rows import joint_rows
from ..problem.settings import text_of_numbers
from ..records.grasp_files import grasp_json
from .legend import LEGEND
from .narrow_script import PHONE
from .text import CARD, fixed, object_words, story, task_words
from .verdict_card import verdict_card

STYLE = (
    "#grasp-numbers{position:fixed;left:12px;top:12px;z-index:1000;width:340px;max-height:calc(100vh - 90px);"
    "overflow:auto;font-family:system-ui,sans-serif;font-size:13px;line-height:1.45;border-radius:10px;"
    "background:rgba(255,255,255,.92);box-shadow:0 2px 12px rgba(0,0,0,.12)}"
    "#grasp-numbers summary{cursor:pointer;font-weight:700;padding:10px 14px}"
    "#grasp-numbers p{margin:6px 14px}#grasp-numbers table{width:100%;font-size:12px;text-align:left}"
    f"@media (max-width:{PHONE}px){{#grasp-numbers{{left:6px;right:6px;top:6px;width:auto;max-height:70vh}}}}"
)
"""The numbers stand at the left; on a phone only their heading, until it is touched."""
FOLDED = f"if(innerWidth<={PHONE})document.getElementById('grasp-numbers').removeAttribute('open')"


def export_overlay(grasp: Grasp, title: str) -> str:
    """Return the HTML that is laid over an exported scene; everything that is not from here is escaped."""
    problem = grasp.problem
    tasks = ", ".join(task_words(task) for task in problem.tasks)
    facts = f"{tasks} · {problem.n_synergies} synergies · μ = {text_of_numbers(problem.parameters.friction)}"
    file = base64.b64encode(grasp_json(grasp).encode()).decode()
    contacts = [
        (frame.name, f"{fixed(float(grasp.normal_forces[i]), 3)} N", f"{fixed(float(grasp.friction_margins[i]), 3)} N")
        for i, frame in enumerate(problem.frames)
    ]
    paragraphs = "".join(f"<p>{_inline(part)}</p>" for part in story(grasp).split("\n\n"))
    return (
        f"<style>{STYLE}</style><details id='grasp-numbers' open><summary>{html.escape(title)}</summary>"
        f"<p style='overflow-wrap:break-word'>{html.escape(object_words(problem.grasp_object))}<br>"
        f"{html.escape(facts)}</p>"
        f"{verdict_card(grasp)}{LEGEND}{paragraphs}"
        f"<div style='{CARD}'>{_table(('contact', 'normal force', 'friction margin'), contacts)}</div>"
        f"<details style='{CARD}'><summary style='padding:0'>Joints</summary>"
        f"{_table(('joint', 'q °', 'q_r °', 'τ mN m'), _joints(grasp))}</details>"
        f"<p><a download='grasp.json' href='data:application/json;base64,{file}'>The grasp as JSON</a>, "
        "for grasp-planner view</p></details>"
        f"<script>{FOLDED}</script>"
    )


def _joints(grasp: Grasp) -> list[tuple[str, ...]]:
    """Return name, angle, reference and torque of every joint, as they are told."""
    return [(row.name, fixed(row.angle, 1), fixed(row.reference, 1), fixed(row.torque, 0)) for row in joint_rows(grasp)]


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table; every text is escaped."""
    head = "".join(f"<th>{html.escape(column)}</th>" for column in columns)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(word)}</td>" for word in row) + "</tr>" for row in rows)
    return f"<table><tr>{head}</tr>{body}</table>"


def _inline(words: str) -> str:
    """Return a paragraph of Markdown as HTML: bold and code, all else escaped."""
    escaped = html.escape(words)
    return re.sub(r"`(.+?)`", r"<code>\1</code>", re.sub(r"\*\*(.+?)\*\*", r"<b>\1</b>", escaped))
