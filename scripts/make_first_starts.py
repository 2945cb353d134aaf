"""Write the grasps that the viewer may open with, best first: grasp_planner/viewer/first_starts.json.

Usage: python scripts/make_first_starts.py [seeds ...]      (0 1 by default)

They are grasps of the default problem; the viewer opens with the first of them that is feasible.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import grasp_planner
from grasp_planner import Cylinder, Grasp, GraspProblem, PlannerOptions, load_hand, plan_grasp
from grasp_planner.viewer.first_grasp import start_entry

ENOUGH = 24
"""Grasps planned for each seed."""
TARGET = Path(grasp_planner.__file__).parent / "viewer" / "first_starts.json"


def main() -> None:
    """Plan grasps for every seed and keep the gentlest of each."""
    grasps = []
    for seed in [int(text) for text in sys.argv[1:]] or [0, 1]:
        found: list[Grasp] = []
        options = PlannerOptions(starts=200, enough=ENOUGH)
        plan_grasp(GraspProblem(load_hand(), Cylinder()), seed=seed, options=options, result_callback=found.append)
        feasible = [grasp for grasp in found if grasp.feasible]
        if feasible:
            grasps.append(min(feasible, key=lambda grasp: grasp.force_norm))
            print(f"seed {seed}: F = {grasps[-1].force_norm:.3g} N, the least of {len(feasible)}")
    entries = [start_entry(grasp) for grasp in sorted(grasps, key=lambda grasp: grasp.force_norm)]
    TARGET.write_text(json.dumps(entries, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
