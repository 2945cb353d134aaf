"""Plan a batch from Python: cases in, rows out, the best grasps back.

Usage: ``python scripts/run_batch.py [--out DIR] [--workers N]``
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from grasp_planner.batch import GraspCase, find_rows, load_grasps, load_table, run_batch


def main(out: Path, workers: int | None) -> None:
    """Plan eight cases and show the three grasps with the smallest contact forces."""
    cases = [
        GraspCase(
            object=f"cylinder:radius={radius}",  # m
            task=(task,),
            n_synergies=n_synergies,
            paper=True,
            settings={"friction": 0.8, "starts": 4, "enough": 1},
            time_limit_s=60.0,
        )
        for radius in (0.025, 0.035)
        for task in ("force:+x", "force:+y")
        for n_synergies in (3, 5)
    ]
    summary = run_batch(cases, out, workers=workers)
    sys.stdout.write(f"{summary.feasible} of {summary.done} cases feasible\n")
    table = load_table(out, ["row", "object", "n_synergies", "status", "force_norm"])
    sys.stdout.write(f"{table.to_pylist()[0]}\n")
    best = find_rows(out, "feasible order by force_norm limit 3")
    for row, grasp in zip(best, load_grasps(out, best), strict=True):
        sys.stdout.write(f"row {row}: F = {grasp.force_norm:.2f} N, q = {grasp.joint_angles.round(2)} rad\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("runs/example"))
    parser.add_argument("--workers", type=int)
    arguments = parser.parse_args()
    main(arguments.out, arguments.workers)
