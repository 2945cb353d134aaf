"""Statistics of a study: how well a static margin predicts the load at which a grasp is lost, and whether it passes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import mannwhitneyu, spearmanr

from ..spatial import Array
from .study_rows import StudyRow

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class MarginPrediction:
    """How well a margin predicts what happens in simulation. Grasps that were refused count not at all.

    Attributes:
        margin: Name of the margin.
        grasps: Grasps that were simulated and have the margin.
        passed: Those of them that held all six pushes.
        rho: Spearman's ρ of the margin against the weakest force held; nan if undefined. A grasp lost before any push
            counts with 0 N.
        p_value: Its p-value.
        roc_area: Chance that the margin is larger for a grasp that passed than for one that failed; nan unless there
            are both.
    """

    margin: str
    grasps: int
    passed: int
    rho: float
    p_value: float
    roc_area: float


def prediction(rows: Sequence[StudyRow], margin: str) -> MarginPrediction:
    """Return how well a margin predicts what happens in simulation."""
    values, loads, passed = simulated(rows, margin)
    rho, p_value = spearman(values, loads)
    area = roc_area(values, passed)
    return MarginPrediction(margin, len(values), int(passed.sum()), rho, p_value, area)


def spearman(values: Array, others: Array) -> tuple[float, float]:
    """Return Spearman's ρ of pairs of numbers, ties at their mean rank, and its p-value.

    Both are nan of fewer than three pairs, or if either of shape (n,) has one value only.
    """
    if len(values) < 3 or (values == values[0]).all() or (others == others[0]).all():
        return math.nan, math.nan
    result = spearmanr(values, others)
    return float(result.statistic), float(result.pvalue)


def roc_area(values: Array, passed: Mask) -> float:
    """Return the chance that a value of shape (n,) is larger where it passed than elsewhere; nan without both."""
    good, bad = values[passed], values[~passed]
    if not (len(good) and len(bad)):
        return math.nan
    return float(mannwhitneyu(good, bad).statistic) / (len(good) * len(bad))


def roc_curve(rows: Sequence[StudyRow], margin: str) -> tuple[Array, Array]:
    """Return the ROC of "passes if the margin is at least …": false and true positive rates from (0, 0) to (1, 1).

    Args:
        rows: The rows; there have to be grasps that passed and grasps that failed.
        margin: Name of the margin.

    Returns:
        Both rates, of shape (k,).
    """
    values, _, passed = simulated(rows, margin)
    thresholds = np.concatenate([[np.inf], np.unique(values)[::-1]])
    taken = values[None, :] >= thresholds[:, None]
    return taken[:, ~passed].mean(axis=1), taken[:, passed].mean(axis=1)


def simulated(rows: Sequence[StudyRow], margin: str) -> tuple[Array, Array, Mask]:
    """Return margin, weakest force held [N] and whether it passed, of every grasp that was simulated.

    Args:
        rows: The rows.
        margin: Name of the margin.

    Returns:
        Three arrays of shape (n,), the last one of booleans.
    """
    found = []
    for row in rows:
        value = (row.margins or {}).get(margin)
        if row.weakest_force is not None and value is not None:
            found.append((value, row.weakest_force, bool(row.passed)))
    table = np.array(found, dtype=float).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2] > 0.5
