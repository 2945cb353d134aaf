"""Write the grasps that the viewer may open with, best first: grasp_planner/viewer/first_starts.json.

Usage: python scripts/make_first_starts.py [synergies ...]      (5 15 by default)

The viewer opens with the first of them that is feasible.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import grasp_planner
from grasp_planner import (
    ClearanceOptions,
    Cylinder,
    GraspParameters,
    GraspProblem,
    PlannerOptions,
    load_hand,
    plan_grasp,
)
from grasp_planner.viewer.first_grasp import start_entry

SYNERGY_SET = "native_clear"
FORCE_WEIGHT = 1e-4
"""Weight of F, larger than the paper's, so that the page opens with a gentle grasp."""
TARGET = Path(grasp_planner.__file__).parent / "viewer" / "first_starts.json"


def main() -> None:
    """Plan a grasp for every number of synergies and keep the feasible ones."""
    entries = []
    for n_synergies in [int(text) for text in sys.argv[1:]] or [5, 15]:
        problem = GraspProblem.paper(
            load_hand(),
            Cylinder(),
            n_synergies=n_synergies,
            synergy_set=SYNERGY_SET,
            parameters=GraspParameters(force_weight=FORCE_WEIGHT),
            clearance=ClearanceOptions(),
        )
        grasp = plan_grasp(problem, options=PlannerOptions(starts=200, enough=4))
        print(f"{n_synergies} synergies: {grasp.verdict}, F = {grasp.force_norm:.3g} N")
        if grasp.feasible:
            entries.append(start_entry(grasp))
    TARGET.write_text(json.dumps(entries, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
