"""The card on top of the page and of exported pages: the ladder of the verdict and the main numbers, as HTML."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence

from ..analysis.ladder import CLEAR, RUNGS, Rung, height, verdict_ladder
from ..grasp.grasp import Grasp
from ..problem.term import own_costs
from ..values import number_text
from .live import contact_share
from .text import AMBER, CARD, GREEN, RED, degrees, quantity, readable, reasons

HEADLINES = (
    "Does not meet the model",
    "Meets the model only",
    "Clear of all links",
    "Holds a push",
    "Closes and holds",
)
"""What the card is headed by, by the number of rungs that are met one after the other …"""
TOP = "Closes and holds, errors included"
"""… and with all of them."""
GREY = "#7b8494"


def verdict_card(grasp: Grasp, note: str = "", rungs: Sequence[Rung] | None = None) -> str:
    """Return the card: how high the grasp stands on the ladder, what stops it, and the main numbers.

    Args:
        grasp: The grasp shown.
        note: A line below, for instance which result it is.
        rungs: The rungs as far as they are known; all of them, computed now, if left out.

    Returns:
        HTML; everything that is not from here is escaped.
    """
    found = verdict_ladder(grasp) if rungs is None else rungs
    up = height(found)
    colour = RED if up == 0 else AMBER if up < 3 else GREEN
    lines = "".join(_line(rung, index < up) for index, rung in enumerate(found))
    lines += "".join(f"<div style='color:{RED}'>• {html.escape(line)}</div>" for line in _why(grasp))
    cells = "".join(_cell(*entry) for entry in headline(grasp))
    below = f"<div style='opacity:.75;margin-top:6px'>{html.escape(note)}</div>" if note else ""
    model = "met" if grasp.feasible else "broken"
    title = TOP if up == len(RUNGS) else HEADLINES[up]
    return (
        f"<div style='{CARD}border-left:6px solid {colour}' data-model='{model}' data-rungs='{up}'>"
        f"<div style='font-weight:700;font-size:15px;color:{colour}'>{title}</div>{lines}"
        f"<div style='display:flex;flex-wrap:wrap;gap:6px;margin-top:8px'>{cells}</div>{below}</div>"
    )


def headline(grasp: Grasp) -> list[tuple[str, str, str]]:
    """Return the main numbers of a grasp, and the user's own costs: symbol, value with unit, and what it is."""
    angle, degenerate = grasp.alignments[0]
    task = grasp.problem.tasks[0]
    symbol = "β" if task.is_motion else "α"
    flag = " (the ellipsoid is degenerate)" if degenerate else ""
    force = floor = "–"
    if contact_share(grasp) > 0.0:
        force = f"{number_text(grasp.force_norm)} N"
        floor = f"{number_text(grasp.force_norm_floor)} N" if math.isfinite(grasp.force_norm_floor) else "none"
    return [
        ("F", force, "size of all normal forces"),
        ("floor", floor, "least F any hand could do with at these contacts"),
        ("C", number_text(grasp.task_index, 2), "task index, small is good"),
        ("angle", degrees(angle) + ("*" if degenerate else ""), "task against the ellipsoid's long axis" + flag),
        (symbol, number_text(grasp.transmission_ratios[0]), "transmission along the task per unit of synergy effort"),
        *(
            (readable(each.cost.name), quantity(each.cost.clear_value(grasp), each.cost.unit), "a cost of your own")
            for each in own_costs(grasp.problem.costs)
        ),
    ]


def _why(grasp: Grasp) -> list[str]:
    """Return at most three reasons why the model is not met, in words."""
    return [] if grasp.feasible else reasons(grasp)[:3]


def _line(rung: Rung, reached: bool) -> str:
    """Return one rung: green where all below are met too, red where not met, grey where open."""
    good = AMBER if rung.met and not reached else GREEN
    colour = GREY if rung.met is None else good if rung.met else (AMBER if rung.name == CLEAR else RED)
    said = "" if rung.name == RUNGS[0] and not rung.met else f": {html.escape(rung.text)}"
    return f"<div><b style='color:{colour}'>{rung.mark} {rung.name}</b><span style='opacity:.85'>{said}</span></div>"


def _cell(symbol: str, value: str, meaning: str) -> str:
    """Return one number of the card."""
    return (
        f"<div title='{html.escape(meaning)}' style='flex:1;text-align:center;border-radius:7px;padding:4px 2px;"
        "background:var(--mantine-color-body,#fff)'>"
        f"<div data-cell style='font-size:11px;opacity:.65'>{html.escape(symbol)}</div>"
        f"<div style='font-weight:650;white-space:nowrap;font-size:12px'>{html.escape(value)}</div></div>"
    )
