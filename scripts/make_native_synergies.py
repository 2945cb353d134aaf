"""Make the robot-native synergy set of the DLR/HIT II: PCA over fully actuated grasps planned on many objects.

Usage: python scripts/make_native_synergies.py [--grasps N] [--seed S] [--output FILE]
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

import grasp_planner as gp

OUTPUT = Path(__file__).parents[1] / "urdf" / "dlr_hit_ii" / "synergies" / "native.csv"
FORCE_WEIGHT = 1e-4


def fully_actuated(hand: gp.Hand) -> gp.SynergySpace:
    """Return a space in which every joint is a synergy, around a half-closed posture."""
    mean = hand.lower + 0.35 * (hand.upper - hand.lower)
    mean[[name.endswith("_abd") for name in hand.joint_names]] = 0.0
    return gp.SynergySpace(hand.joint_names, mean, np.eye(hand.n_joints), name="fully actuated")


def random_object(rng: np.random.Generator) -> gp.GraspObject:
    """Return a sphere, a cylinder or a box of random size."""
    kind = rng.integers(3)
    if kind == 0:
        return gp.Sphere(radius=rng.uniform(0.025, 0.045))
    if kind == 1:
        return gp.Cylinder(radius=rng.uniform(0.02, 0.045), height=rng.uniform(0.10, 0.18))
    x, y = rng.uniform(0.04, 0.07, 2)
    return gp.Box(x=x, y=y, z=rng.uniform(0.08, 0.16), edge=0.01)


def plan_one(seed: int) -> list[float] | None:
    """Return the posture of one planned grasp, or None if none was found."""
    rng = np.random.default_rng(seed)
    hand = gp.load_hand("dlr_hit_ii_right")
    problem = gp.GraspProblem(
        hand=hand,
        grasp_object=random_object(rng),
        tasks=(gp.force_task(rng.normal(size=3)),),
        n_synergies=hand.n_joints,
        parameters=gp.GraspParameters(force_weight=FORCE_WEIGHT),
        synergy_space=fully_actuated(hand),
    )
    for _ in range(6):
        # Always from the same posture: the search changes it no more than it has to, so that noise would stay in.
        start = replace(gp.random_start(problem, rng), joint_angles=problem.synergies.mean)
        grasp = gp.plan_grasp(problem, start=start, options=gp.PlannerOptions(starts=1, enough=1))
        if grasp.feasible:
            return grasp.joint_angles.tolist()
    return None


def main() -> None:
    """Plan the grasps, and write their principal components."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--grasps", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path, default=OUTPUT)
    arguments = parser.parse_args()
    seeds = range(arguments.seed, arguments.seed + arguments.grasps)
    with ProcessPoolExecutor() as pool:
        postures = [posture for posture in pool.map(plan_one, seeds, chunksize=4) if posture is not None]
    space = gp.synergies_from_postures(
        gp.load_hand("dlr_hit_ii_right").joint_names,
        postures,
        name="native",
        provenance=(
            f"PCA over {len(postures)} fully actuated fingertip grasps of the DLR/HIT II planned by this package\n"
            "with Remarks 1 and 2, links clear of the object and of each other\n"
            "spheres r 25-45 mm, cylinders r 20-45 mm, boxes 40-70 mm; "
            f"random force tasks; w_F/w_C = {FORCE_WEIGHT:g}\n"
            f"made by scripts/make_native_synergies.py --grasps {arguments.grasps} --seed {arguments.seed}; "
            "not human data"
        ),
    )
    gp.save_synergies(space, arguments.output)
    shares = ", ".join(f"{share:.3f}" for share in space.explained_variance()[:5])
    print(f"{len(postures)} of {arguments.grasps} grasps; cumulative variance {shares}; wrote {arguments.output}")


if __name__ == "__main__":
    main()
