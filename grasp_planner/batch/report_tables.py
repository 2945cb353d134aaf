"""Numbers and tables of a report."""

from __future__ import annotations

import html
import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from .rows import Row

Z_95 = 1.959964
"""Quantile of the normal distribution for an interval of 95 %."""


@dataclass(frozen=True)
class Share:
    """A share of successes.

    Attributes:
        successes: How many.
        total: Of how many.
    """

    successes: int
    total: int

    @property
    def value(self) -> float:
        """The share."""
        return self.successes / self.total if self.total else 0.0

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's interval of 95 %."""
        n, p = self.total, self.value
        if not n:
            return 0.0, 1.0
        centre = (p + Z_95**2 / (2 * n)) / (1 + Z_95**2 / n)
        half = Z_95 / (1 + Z_95**2 / n) * math.sqrt(p * (1 - p) / n + Z_95**2 / (4 * n * n))
        return max(0.0, centre - half), min(1.0, centre + half)


def groups(rows: Sequence[Row], column: str) -> dict[str, list[Row]]:
    """Return rows by the value of a column, sorted by that value."""
    found: dict[object, list[Row]] = {}
    for values in rows:
        found.setdefault(values[column], []).append(values)
    return {str(key): found[key] for key in sorted(found, key=lambda key: (isinstance(key, str), key))}


def share_of(rows: Sequence[Row]) -> Share:
    """Return the share of feasible rows."""
    return Share(sum(bool(values["feasible"]) for values in rows), len(rows))


def numbers(rows: Iterable[Row], column: str, *, feasible: bool = True) -> list[float]:
    """Return the numbers of a column, of feasible rows unless said otherwise."""
    return [float(v[column]) for v in rows if v[column] is not None and (v["feasible"] or not feasible)]


def group_table(rows: Sequence[Row], column: str, title: str) -> str:
    """Return a table of success, F, angle and time by the values of a column."""
    lines = []
    for name, some in groups(rows, column).items():
        share = share_of(some)
        low, high = share.interval
        lines.append(
            [
                name,
                str(share.total),
                str(share.successes),
                f"{100 * share.value:.1f} % ({100 * low:.0f}–{100 * high:.0f})",
                median(numbers(some, "force_norm")),
                median(numbers(some, "alignment_angle_deg")),
                median(numbers(some, "time_s", feasible=False)),
            ]
        )
    head = [title, "cases", "feasible", "share (95 % interval)", "median F [N]", "median angle [°]", "median time [s]"]
    return table(head, lines)


def failure_table(rows: Sequence[Row]) -> str:
    """Return a table of what was not met, by status and reason."""
    counts = Counter((str(v["status"]), str(v["reason"])) for v in rows if not v["feasible"])
    example = {(str(v["status"]), str(v["reason"])): v for v in reversed(rows) if not v["feasible"]}
    if not counts:
        return "<p>None.</p>"
    lines = [
        [status, reason, str(count), str(example[status, reason]["row"]), str(example[status, reason]["message"])]
        for (status, reason), count in counts.most_common()
    ]
    return table(["status", "reason (worst violation)", "cases", "for instance row", "message"], lines)


def median(values: Sequence[float]) -> str:
    """Return the median as text."""
    return f"{np.median(values):.3g}" if values else "–"


def table(head: Sequence[str], lines: Iterable[Sequence[str]], cell: Callable[[str], str] = html.escape) -> str:
    """Return an HTML table; every text is escaped."""
    top = "".join(f"<th>{html.escape(text)}</th>" for text in head)
    body = "".join("<tr>" + "".join(f"<td>{cell(text)}</td>" for text in line) + "</tr>" for line in lines)
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
