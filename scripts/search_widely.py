"""Which requirement leaves no grasp: many random starts of phase one with one more requirement, or one less.

Contacts on the surface, balance, friction cones, springs and joint limits are always held; the columns say what is held
besides, or with ``--but`` what is left out of all. Prints a Markdown table of how many starts became feasible.

Usage: python scripts/search_widely.py [--objects TEXT;TEXT] [--synergy-set NAME] [--counts 1,2,3] [--starts N] [--but]
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
ALL = gp.ClearanceOptions(remark1=True)
HELD = {
    "nothing": (PLAIN, NO_LOADS),
    "loads": (PLAIN, gp.LoadCases()),
    "tips": (replace(PLAIN, tip_patch=True), NO_LOADS),
    "links and object": (replace(PLAIN, link_object="geometry"), NO_LOADS),
    "links and links": (replace(PLAIN, self_collision=True), NO_LOADS),
    "order (Remark 1)": (replace(PLAIN, remark1=True), NO_LOADS),
    "all": (ALL, gp.LoadCases()),
}
"""What is held besides, by what the columns are called."""
LEFT_OUT = {
    "nothing": (ALL, gp.LoadCases()),
    "loads": (ALL, NO_LOADS),
    "tips": (replace(ALL, tip_patch=False), gp.LoadCases()),
    "links and object": (replace(ALL, link_object="off"), gp.LoadCases()),
    "links and links": (replace(ALL, self_collision=False), gp.LoadCases()),
    "order (Remark 1)": (replace(ALL, remark1=False), gp.LoadCases()),
}
"""What is left out of all."""


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
    parser.add_argument("--but", action="store_true", help="all but what the column says")
    arguments = parser.parse_args()
    hand, columns = gp.load_hand(arguments.hand), LEFT_OUT if arguments.but else HELD
    print(f"| object | n_s | {' | '.join(columns)} |")
    print("|---" * (2 + len(columns)) + "|")
    for text in arguments.objects.split(";"):
        for count in arguments.counts.split(","):
            cells = []
            for clearance, loads in columns.values():
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
