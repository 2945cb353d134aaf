"""What of closing survives errors in a study, by kind of object and synergies, and whether its certificate knows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..simulate.off_plan import ROWS
from .study_margins import CLOSING_MARGINS
from .study_rows import StudyRow
from .study_statistics import roc_area, spearman
from .synergy_study import StudySettings

SURVIVAL = (
    "Every grasp closes from open around the object once more, with the errors named: simulations in which it then held"
    " all six pushes, or was lifted and shaken, of those tried. Not tried, and counted apart: hands that go through a "
    "table of which the plan says nothing, and objects that do not stand under the plan's gravity."
)
CERTIFICATE = (
    "Margins of the quasi-static closing as planned against simulation, over all grasps: Spearman's ρ (ranks, ties get "
    "their mean rank; ± the standard deviation over 1000 bootstrap samples of the grasps) with the weakest load and"
    " with the share of simulations survived over all rows, and the area under the ROC of surviving all of them. Ties: "
    "the share of grasps whose share survived is the commonest one; the more, the less ρ can say."
)
SHORT = dict(zip(ROWS, ("planned", "palm", "radius", "friction", "mass", "joints", "all", "table"), strict=True))
"""Titles of the columns by the names of the rows of :func:`~grasp_planner.simulate.survival`."""
SURVIVAL_COLUMNS = ("set", "object", "n_s", "found", *SHORT.values(), "no table")
CERTIFICATE_COLUMNS = ("closing certificate", "grasps", "values", "ρ load", "ρ survived", "ties", "area under ROC")
BOOTSTRAPS = 1000
"""Samples of the grasps from which the spread of ρ is told."""


@dataclass(frozen=True)
class Rank:
    """A rank correlation.

    Attributes:
        rho: Spearman's ρ; nan if either has one value only.
        spread: Its standard deviation over bootstrap samples of the grasps; nan where it is undefined in most.
    """

    rho: float
    spread: float

    @property
    def text(self) -> str:
        """In one cell."""
        return f"{self.rho:+.2f} ± {self.spread:.2f}" if math.isfinite(self.rho) else "undefined"


def rank_correlation(values: Sequence[float], others: Sequence[float]) -> Rank:
    """Return Spearman's ρ of pairs of numbers, ties at their mean rank, and how far it is from certain."""
    pairs = np.column_stack([values, others])
    rng = np.random.default_rng(0)
    drawn = (
        [spearman(*pairs[rng.integers(len(pairs), size=len(pairs))].T)[0] for _ in range(BOOTSTRAPS)]
        if len(pairs)
        else []
    )
    known = [rho for rho in drawn if math.isfinite(rho)]
    spread = float(np.std(known)) if len(known) > BOOTSTRAPS / 2 else math.nan
    return Rank(spearman(*pairs.T)[0], spread)


def survived_share(row: StudyRow) -> float | None:
    """Return the share of its simulations that a grasp survived; None if there were none."""
    tried = sum(each.tried for each in row.survival or ())
    return sum(each.survived for each in row.survival or ()) / tried if tried else None


def survival_rows(rows: Sequence[StudyRow], settings: StudySettings) -> list[list[str]]:
    """Return the texts of the table of what survives, a row for each set, kind of object and number of synergies."""
    table = []
    for name in settings.synergy_sets:
        for kind in settings.object_kinds:
            for count in settings.counts:
                group = [row for row in rows if row.key[:3] == (name, kind, count) and row.survival is not None]
                cells = [_survived(group, each) for each in ROWS]
                untried = sum(each.name == ROWS[-1] and not each.tried for row in group for each in row.survival or ())
                table.append([name, kind, str(count), str(len(group)), *cells, str(untried)])
    return table


def certificate_rows(rows: Sequence[StudyRow]) -> list[list[str]]:
    """Return the texts of the table of the closing certificate, a row for each of its margins."""
    table = []
    for margin in CLOSING_MARGINS:
        known = [(row, (row.margins or {}).get(margin), survived_share(row)) for row in rows]
        found = [(row, value, share) for row, value, share in known if value is not None and share is not None]
        loads = [(value, row.weakest_force) for row, value, _ in found if row.weakest_force is not None]
        values, shares = [value for _, value, _ in found], [share for *_, share in found]
        ties = max((shares.count(share) for share in set(shares)), default=0) / max(len(shares), 1)
        area = roc_area(np.array(values), np.array(shares) == 1.0)
        by_load = rank_correlation([value for value, _ in loads], [load for _, load in loads])
        by_share = rank_correlation(values, shares)
        last = [f"{100 * ties:.0f} %", f"{area:.2f}" if math.isfinite(area) else "undefined"]
        table.append([margin, str(len(found)), str(len(set(values))), by_load.text, by_share.text, *last])
    return table


def _survived(group: Sequence[StudyRow], name: str) -> str:
    """Return how many simulations of a row were survived, of how many."""
    entries = [each for row in group for each in row.survival or () if each.name == name]
    tried = sum(each.tried for each in entries)
    return f"{sum(each.survived for each in entries)}/{tried}" if tried else "–"
