"""The published results of [Mavrogiannis2014], tables I and II, as numbers to compare with.

Its synergies come from glove data that is not public; ours are others (see the synergy set's provenance). The
numbers can be compared in kind and in value, not digit by digit.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PaperCell:
    """One cell of the paper's tables.

    Attributes:
        table: 1 (number of synergies × direction) or 2 (ratios of weights).
        direction: ``y`` or ``x``, the direction of the force task.
        n_synergies: n_s.
        weight_ratio: w_F/w_C.
        force_norm: F [N].
        alignment_angle_deg: Angle between task and major axis of the force ellipsoid [degrees].
        iterations: Iterations of its solver.
    """

    table: int
    direction: str
    n_synergies: int
    weight_ratio: float
    force_norm: float
    alignment_angle_deg: float
    iterations: int


PAPER_CELLS = (
    PaperCell(1, "y", 1, 1e-6, 26.06, 63.62, 42),
    PaperCell(1, "y", 2, 1e-6, 22.09, 56.27, 54),
    PaperCell(1, "y", 3, 1e-6, 15.04, 13.95, 72),
    PaperCell(1, "y", 15, 1e-6, 1.97, 3.43, 192),
    PaperCell(1, "x", 1, 1e-5, 27.0, 67.85, 46),
    PaperCell(1, "x", 2, 1e-5, 14.89, 48.83, 103),
    PaperCell(1, "x", 3, 1e-5, 12.96, 17.22, 119),
    PaperCell(1, "x", 15, 1e-5, 2.36, 1.77, 197),
    PaperCell(2, "y", 3, 1e-9, 67.30, 7.86, 97),
    PaperCell(2, "y", 3, 1e-6, 31.77, 22.38, 439),
    PaperCell(2, "y", 3, 1.0, 1.98, 47.13, 217),
)
"""All cells: table I by direction and n_s, then table II by ratio."""

DIRECTIONS = {"y": (0.0, 1.0, 0.0), "x": (1.0, 0.0, 0.0)}
"""Task directions in O."""
