"""Make a hand's synergy set ``native_clear``: grasps that keep clear, hold load cases, and together span little.

Several grasps of every object are planned with all joints free, then moved towards each other within their
constraints (grasp_planner.synergy_design). Then every object is planned again with fewer and fewer synergies of the set
so far, what is found joins the candidates, and grasps are moved again. Forces follow from δσ by eq. (17), so that the
set serves that law as well; ``grasp-planner synergies design`` makes a set for a number of motors by springs alone.

Usage: python scripts/make_compact_synergies.py [--hand NAME] [--counts 8,5,3] [--objects N] [--output FILE]
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import grasp_planner as gp
from grasp_planner.synergy_design.design import FIRST_ROUNDS, FIRST_SEED, FREE_STARTS, NEXT_ROUNDS, Design, Progress
from grasp_planner.synergy_design.training import FORCE_WEIGHT, Training

HAND = "dlr_hit_ii_right"
KINDS = ("sphere", "cylinder", "box", "sphere", "cylinder", "capsule", "ellipsoid")
"""Kinds of random objects in turn; spheres and cylinders, which few synergies miss most, twice."""
LEAST = 0.015
"""Spread from which a direction that the grasps share counts [rad]."""


def show(what: Progress | str) -> None:
    """Print the line at the end of a stage."""
    if isinstance(what, str):
        print(what, flush=True)


def main() -> None:
    """Plan, move and plan again; write the set after every step."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hand", default=HAND, help="name of the hand, or its description file")
    parser.add_argument(
        "--contact-set", default=None, help="contact set; the hand's default with clear links if left out"
    )
    parser.add_argument("--objects", type=int, default=84, help="random objects")
    parser.add_argument("--counts", default="8,5,3", help="numbers of synergies to plan again with, in turn")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--output", type=Path, default=None, help="CSV file; beside the hand's description if left out")
    arguments = parser.parse_args()
    counts = [int(each) for each in arguments.counts.split(",") if each]
    hand = gp.load_hand(arguments.hand)
    output = arguments.output or hand.folder / "synergies" / "native_clear.csv"
    contacts = f" --contact-set {arguments.contact_set}" if arguments.contact_set else ""
    provenance = "\n".join(
        [
            f"fingertip grasps of the {hand.description.title or hand.name} planned by this package, one of each of "
            f"{arguments.objects} random objects, links clear of the object and of each other, standard load cases, "
            "moved within their constraints until together they span few dimensions (log-det heuristic)",
            "further synergies: principal components of grasps planned with all joints free, normal to the first",
            "variances: of the grasps planned with all joints free, along the synergies",
            f"objects: {', '.join(sorted(set(KINDS)))} as in the benchmark, of other seeds; random force tasks; "
            f"w_F/w_C = {FORCE_WEIGHT:g}",
            f"made by scripts/make_compact_synergies.py --hand {arguments.hand}{contacts} --objects "
            f"{arguments.objects} --counts {arguments.counts}; not human data",
        ]
    )

    with TemporaryDirectory() as folder:
        training = Training(
            arguments.hand, Path(folder), arguments.contact_set, KINDS, force_law="controllable", patience=FREE_STARTS
        )
        seeds = range(FIRST_SEED, FIRST_SEED + arguments.objects)
        design = Design(training, seeds, arguments.workers, show)
        design.rounds(FIRST_ROUNDS)
        for n_synergies in counts:
            design.plan_again(design.full_space(LEAST).truncated(n_synergies))
            design.rounds(NEXT_ROUNDS)
        made = replace(design.full_space(LEAST), name="native_clear", provenance=provenance)
    gp.save_synergies(made, output)
    print(f"wrote {output}")


if __name__ == "__main__":
    main()
