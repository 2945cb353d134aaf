"""Make a hand's synergy set ``native_clear``: grasps that keep clear, hold load cases, and together span little.

Several grasps of every object are planned with all joints free, then moved towards each other within their
constraints (grasp_planner.synergy_design.compact). Then every object is planned again with fewer and fewer synergies of
the set so far, what is found joins the candidates, and grasps are moved again. No object is ever dropped: one that
few synergies do not grasp keeps pulling at the set.

Usage: python scripts/make_compact_synergies.py [--hand NAME] [--counts 8,5,3] [--objects N] [--output FILE]
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from make_native_synergies import fully_actuated

import grasp_planner as gp
from grasp_planner.studies.benchmark_problems import BenchmarkCase
from grasp_planner.synergy_design import compact as compact

HAND = "dlr_hit_ii_right"
FORCE_WEIGHT = 1e-4
KINDS = ("sphere", "cylinder", "box", "sphere", "cylinder", "capsule", "ellipsoid")
"""Kinds of random objects in turn; spheres and cylinders, which few synergies miss most, twice."""
FIRST_SEED = 20000
"""Far from the seeds of the benchmark, so that no set is fitted to its problems."""
CANDIDATES, FREE_STARTS, STARTS = 3, 25, 15
"""Grasps of every object to choose from; most starts with all joints free and with few synergies."""
FIRST_ROUNDS = (0.15, 0.12, 0.09, 0.07, 0.05, 0.035, 0.025)
NEXT_ROUNDS = (0.05, 0.03, 0.02, 0.01)
"""ε of the rounds [rad], at first and after planning anew."""
LEAST = 0.015
"""Spread from which a direction that the grasps share counts [rad]."""


PARAMETERS = gp.GraspParameters(force_weight=FORCE_WEIGHT, force_law="controllable")
"""Grasps move together with their δσ, which eq. (17) needs."""


def problem_of(hand: str, contacts: str | None, seed: int, space: gp.SynergySpace) -> gp.GraspProblem:
    """Return a training problem."""
    kind = KINDS[seed % len(KINDS)]
    case = BenchmarkCase(
        seed, space.n_synergies, hand, object_kind=kind, contact_set=contacts, clearance=True, loads=True
    )
    return replace(case.problem(), synergy_space=space, parameters=PARAMETERS)


def plan_some(job: tuple[str, str | None, int, gp.SynergySpace, int, int]) -> list[compact.FreeGrasp]:
    """Return feasible grasps of one object."""
    hand, contacts, seed, space, starts, enough = job
    found: list[compact.FreeGrasp] = []

    def keep(grasp: gp.Grasp) -> None:
        if grasp.feasible:
            found.append(compact.free_grasp(grasp))

    options = gp.PlannerOptions(starts=starts, enough=enough)
    gp.plan_grasp(problem_of(hand, contacts, seed, space), seed=seed, options=options, result_callback=keep)
    return found


def move(job: tuple[str, str | None, int, compact.FreeGrasp, compact.Scatter, float]) -> compact.FreeGrasp:
    """Move one grasp towards the others."""
    hand, contacts, seed, grasp, scatter, epsilon = job
    problem = problem_of(hand, contacts, seed, fully_actuated(gp.load_hand(hand)))
    return compact.moved_closer(problem, grasp, scatter, epsilon)


class Design:
    """The objects, their candidates, and the scatter of the best of each."""

    def __init__(self, pool: ProcessPoolExecutor, hand: str, contacts: str | None, objects: int) -> None:
        self.pool, self.hand_name, self.contacts = pool, hand, contacts
        self.hand = gp.load_hand(hand)
        self.free = fully_actuated(self.hand)
        self.scale = compact.displacement_scale(problem_of(hand, contacts, FIRST_SEED, self.free))
        seeds = range(FIRST_SEED, FIRST_SEED + objects)
        found = self._plan(seeds, self.free, FREE_STARTS, CANDIDATES)
        self._count("all joints free", dict(zip(seeds, found, strict=True)))
        self.postures = np.array([grasp.reference for grasps in found for grasp in grasps[:1]])
        self.candidates = {seed: grasps for seed, grasps in zip(seeds, found, strict=True) if grasps}
        # Displacements of least force are far apart in directions that press on nothing: at first postures alone.
        self.scatter = self._scatter(0.0)

    def rounds(self, epsilons: tuple[float, ...]) -> None:
        """Move all candidates, keep the closest of each object, fewer every second round, and take the scatter anew."""
        for k, epsilon in enumerate(epsilons):
            pairs = [(seed, grasp) for seed, grasps in self.candidates.items() for grasp in grasps]
            jobs = [(self.hand_name, self.contacts, seed, grasp, self.scatter, epsilon) for seed, grasp in pairs]
            moved: dict[int, list[compact.FreeGrasp]] = defaultdict(list)
            for (seed, _), grasp in zip(pairs, self.pool.map(move, jobs, chunksize=2), strict=True):
                moved[seed].append(grasp)
            kept = max(1, CANDIDATES - k // 2)
            for seed, grasps in moved.items():
                self.candidates[seed] = sorted(grasps, key=lambda grasp: grasp.distance)[:kept]
            self.scatter = self._scatter(self.scale)
            spreads = np.sqrt(np.maximum(np.linalg.eigvalsh(self.scatter.covariance)[::-1], 0.0))
            print(f"  ε = {epsilon:g}: spreads [rad] {', '.join(f'{each:.3f}' for each in spreads[:9])}", flush=True)

    def plan_again(self, n_synergies: int) -> None:
        """Plan every object with the first synergies of the set so far, and add what is found to its candidates."""
        space = self.space().truncated(n_synergies)
        seeds = list(self.candidates)
        found = dict(zip(seeds, self._plan(seeds, space, STARTS, 1), strict=True))
        self._count(f"n_s = {n_synergies}", found)
        for seed, grasps in found.items():
            self.candidates[seed] = [*self.candidates[seed], *grasps]

    def space(self) -> gp.SynergySpace:
        """Return the set so far."""
        return compact.spanning_synergies(self.hand.joint_names, self.scatter, self.postures, LEAST)

    def _plan(
        self, seeds: Iterable[int], space: gp.SynergySpace, starts: int, enough: int
    ) -> list[list[compact.FreeGrasp]]:
        jobs = [(self.hand_name, self.contacts, seed, space, starts, enough) for seed in seeds]
        return list(self.pool.map(plan_some, jobs))

    def _scatter(self, displacement_scale: float) -> compact.Scatter:
        return compact.scatter_of([grasps[0] for grasps in self.candidates.values()], displacement_scale)

    def _count(self, title: str, found: dict[int, list[compact.FreeGrasp]]) -> None:
        counts: dict[str, list[bool]] = defaultdict(list)
        for seed, grasps in found.items():
            counts[KINDS[seed % len(KINDS)]].append(bool(grasps))
        print(f"{title}: " + ", ".join(f"{kind} {sum(c)}/{len(c)}" for kind, c in counts.items()), flush=True)


def main() -> None:
    """Plan, move and plan again; write the set after every step."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hand", default=HAND, help="name of the hand, or its description file")
    parser.add_argument("--contact-set", default=None, help="contact set; the hand's first if left out")
    parser.add_argument("--objects", type=int, default=84, help="random objects")
    parser.add_argument("--counts", default="8,5,3", help="numbers of synergies to plan again with, in turn")
    parser.add_argument("--workers", type=int, default=None)
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

    def write() -> None:
        gp.save_synergies(replace(design.space(), name="native_clear", provenance=provenance), output)

    with ProcessPoolExecutor(arguments.workers, mp_context=get_context("spawn")) as pool:
        design = Design(pool, arguments.hand, arguments.contact_set, arguments.objects)
        design.rounds(FIRST_ROUNDS)
        write()
        for n_synergies in counts:
            design.plan_again(n_synergies)
            design.rounds(NEXT_ROUNDS)
            write()
    print(f"wrote {output}")


if __name__ == "__main__":
    main()
