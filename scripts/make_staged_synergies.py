"""Make a hand's synergy set ``native_clear``: principal components of grasps that keep clear and hold load cases.

The grasps of the first stage are planned with every joint free. Further stages plan again with fewer and fewer
synergies of the last stage's set, so that what every object needs gathers in the first components.

Usage: python scripts/make_staged_synergies.py [--hand NAME] [--stages 10,8,6] [--grasps N] [--output FILE]
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import repeat
from pathlib import Path

import numpy as np
from make_native_synergies import fully_actuated

import grasp_planner as gp
from grasp_planner.benchmark_problems import BenchmarkCase

HAND = "dlr_hit_ii_right"
FORCE_WEIGHT = 1e-4
KINDS = ("sphere", "cylinder", "box", "sphere", "capsule", "ellipsoid")
"""Kinds of random objects in turn; spheres, which hands of few synergies miss most, twice."""
STARTS = 15
"""Most starts for each grasp."""
FIRST_SEED = 10000
"""Far from the seeds of the benchmark, so that no set is fitted to its problems."""


def plan_one(hand: str, space: gp.SynergySpace, seed: int) -> tuple[str, np.ndarray | None]:
    """Return the kind of object and the reference posture of one planned grasp, None if none was found."""
    kind = KINDS[seed % len(KINDS)]
    case = BenchmarkCase(seed, space.n_synergies, hand, object_kind=kind, clearance=True, loads=True)
    problem = replace(case.problem(), synergy_space=space, parameters=gp.GraspParameters(force_weight=FORCE_WEIGHT))
    grasp = gp.plan_grasp(problem, seed=seed, options=gp.PlannerOptions(starts=STARTS, enough=1))
    return kind, grasp.reference_joint_angles if grasp.feasible else None


def refitted(space: gp.SynergySpace, references: np.ndarray, n_synergies: int) -> gp.SynergySpace:
    """Return a full set: the principal components of references, then the old set's directions normal to them.

    Args:
        space: Full set whose first synergies the references lie in, S of shape (n_q, n_q).
        references: Reference postures q_r = q̄ + S σ [rad], of shape (n, n_q).
        n_synergies: How many synergies the references were planned with.
    """
    mean = references.mean(axis=0)
    _, sizes, directions = np.linalg.svd(references - mean, full_matrices=False)
    found = directions[:n_synergies][sizes[:n_synergies] > 1e-9 * sizes[0]].T
    found *= np.where(found.sum(axis=0) < 0.0, -1.0, 1.0)
    both = np.hstack([found, space.basis])
    orthonormal, triangle = np.linalg.qr(both)
    orthonormal *= np.where(np.diag(triangle) < 0.0, -1.0, 1.0)
    share = np.cumsum(sizes**2) / np.sum(sizes**2)
    print(f"  cumulative variance {', '.join(f'{each:.3f}' for each in share[:6])}")
    return gp.SynergySpace(space.joint_names, mean, orthonormal)


def run_stage(
    pool: ProcessPoolExecutor, hand: str, space: gp.SynergySpace, n_synergies: int, grasps: int
) -> np.ndarray:
    """Plan grasps with the first synergies of a full set and return their reference postures, of shape (n, n_q)."""
    seeds = range(FIRST_SEED, FIRST_SEED + grasps)
    planned = list(pool.map(plan_one, repeat(hand), repeat(space.truncated(n_synergies)), seeds))
    counts = {kind: [found is not None for each, found in planned if each == kind] for kind in sorted(set(KINDS))}
    print(f"n_s = {n_synergies}: " + ", ".join(f"{kind} {sum(c)}/{len(c)}" for kind, c in counts.items()), flush=True)
    references = [found for _, found in planned if found is not None]
    if len(references) <= n_synergies:
        raise SystemExit(f"only {len(references)} grasps found with {n_synergies} synergies: too few to go on")
    return np.array(references)


def main() -> None:
    """Plan the grasps of every stage, and write the last stage's principal components."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hand", default=HAND, help="name of the hand, or its description file")
    parser.add_argument("--grasps", type=int, default=72, help="objects, the same in every stage")
    parser.add_argument("--stages", default="", help="numbers of synergies of the further stages, such as 10,8,6")
    parser.add_argument("--workers", type=int, default=None)
    parser.add_argument("--output", type=Path, default=None, help="CSV file; beside the hand's description if left out")
    arguments = parser.parse_args()
    hand = gp.load_hand(arguments.hand)
    output = arguments.output or hand.folder / "synergies" / "native_clear.csv"
    stages = [hand.n_joints, *(int(each) for each in arguments.stages.split(",") if each)]
    space, free = fully_actuated(hand), None
    kinds = ", ".join(sorted(set(KINDS)))
    provenance = [
        f"PCA over reference postures of fingertip grasps of the {hand.description.title or hand.name} planned by this "
        "package, links clear of the object and of each other, standard load cases",
        "variances: of the first stage's postures along the synergies",
        f"{arguments.grasps} random objects, planned again and again with {', '.join(map(str, stages))} synergies",
        f"objects: {kinds} as in the benchmark, of other seeds; random force tasks; w_F/w_C = {FORCE_WEIGHT:g}",
        f"made by scripts/make_staged_synergies.py --hand {arguments.hand} --grasps {arguments.grasps} "
        f"--stages {arguments.stages}; not human data",
    ]
    with ProcessPoolExecutor(arguments.workers) as pool:
        for n_synergies in stages:
            references = run_stage(pool, arguments.hand, space, n_synergies, arguments.grasps)
            free = references if free is None else free
            space = refitted(space, references, n_synergies)
            variance = np.var(free @ space.basis, axis=0, ddof=1)
            named = replace(space, name="native_clear", provenance="\n".join(provenance), variance=variance)
            gp.save_synergies(named, output)
    print(f"wrote {output}")


if __name__ == "__main__":
    main()
