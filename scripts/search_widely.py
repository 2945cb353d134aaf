"""Which requirement leaves no grasp: many random starts of phase one with one more requirement held at a time.

Contacts on the surface, balance, friction cones, springs and joint limits are always held; the columns say what is held
besides. A zero where the column of nothing has none tells what stands in the way. Prints a Markdown table.

Usage: python scripts/search_widely.py [--objects TEXT;TEXT] [--synergy-set NAME] [--counts 1,2,3] [--starts N]
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

import grasp_planner as gp
from grasp_planner.multistart.pool import Pool
from grasp_planner.multistart.problem_rows import BatchedProblem
from grasp_planner.planning.pooled_starts import WIDTH, pressing_states
from grasp_planner.planning.starts import random_start

PLAIN, NO_LOADS = gp.ClearanceOptions.off(), gp.LoadCases.off()
HELD = {
    "nothing": (PLAIN, NO_LOADS),
    "loads": (PLAIN, gp.LoadCases()),
    "tips": (replace(PLAIN, tip_patch=True), NO_LOADS),
    "links and object": (replace(PLAIN, link_object="geometry"), NO_LOADS),
    "links and links": (replace(PLAIN, self_collision=True), NO_LOADS),
    "all": (gp.ClearanceOptions(), gp.LoadCases()),
}
"""What is held besides, by what the columns are called."""


def found(problem: gp.GraspProblem, starts: int, seed: int) -> int:
    """Return how many of so many random starts phase one makes feasible."""
    batched, rng = BatchedProblem(problem), np.random.default_rng(seed)
    pool = Pool(batched, WIDTH)
    for _ in pool.search(
        lambda number: pressing_states(batched, [random_start(problem, rng) for _ in range(number)]),
        starts,
        lambda: None,
    ):
        pass
    return pool.count.found


def main() -> None:
    """Search and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--objects", default="cylinder:radius=0.03", help="objects, separated by semicolons")
    parser.add_argument("--hand", default="dlr_hit_ii_right")
    parser.add_argument("--synergy-set", default="santello")
    parser.add_argument("--counts", default="3")
    parser.add_argument("--starts", type=int, default=480)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    hand = gp.load_hand(arguments.hand)
    print(f"| object | n_s | {' | '.join(HELD)} |")
    print("|---" * (2 + len(HELD)) + "|")
    for text in arguments.objects.split(";"):
        for count in arguments.counts.split(","):
            cells = []
            for clearance, loads in HELD.values():
                problem = gp.GraspProblem(
                    hand,
                    gp.parse_object(text),
                    n_synergies=int(count),
                    synergy_set=arguments.synergy_set,
                    clearance=clearance,
                    loads=loads,
                )
                cells.append(f"{found(problem, arguments.starts, arguments.seed)}/{arguments.starts}")
            print(f"| {text} | {count} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
