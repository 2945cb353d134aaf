"""Grasps that tests start from, read from tests/data (scripts/make_test_grasps.py)."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import grasp_planner as gp

FOLDER = Path(__file__).parent / "data"


TOTAL = gp.GraspParameters(torque_model="total")
"""With these the stored grasps of the paper's problem were planned: all of a force bends the joints, as springs do."""


@cache
def stored(name: str) -> gp.Grasp:
    """Return a stored grasp; feasible."""
    return gp.grasp_from_record(gp.read_grasp_record(FOLDER / f"{name}.json"))


def failures(grasp: gp.Grasp, tolerance: float = 1e-6) -> dict[str, float]:
    """Return the violations above a tolerance."""
    return {name: found.value for name, found in grasp.violations.items() if not found.value <= tolerance}
