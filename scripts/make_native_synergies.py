"""Make the robot-native synergy set of a hand: PCA over fully actuated grasps planned on many objects.

Usage: python scripts/make_native_synergies.py [--hand NAME] [--grasps N] [--seed S] [--spare FROM TO] [--output FILE]
``native_apart`` was made with ``--spare 0.025 0.035``: no cylinder near the paper's is among its objects.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from pathlib import Path

import numpy as np

import grasp_planner as gp
from grasp_planner.synergy_design.training import fully_actuated

HAND = "dlr_hit_ii_right"
FORCE_WEIGHT = 1e-4


def random_object(rng: np.random.Generator, spared: tuple[float, float]) -> gp.GraspObject:
    """Return a sphere, a cylinder or a box of random size; no cylinder has a radius [m] within the spared range."""
    kind = rng.integers(3)
    if kind == 0:
        return gp.Sphere(radius=rng.uniform(0.025, 0.045))
    if kind == 1:
        radius = rng.uniform(0.02, 0.045)
        while spared[0] < radius < spared[1]:
            radius = rng.uniform(0.02, 0.045)
        return gp.Cylinder(radius=radius, height=rng.uniform(0.10, 0.18))
    x, y = rng.uniform(0.04, 0.07, 2)
    return gp.Box(x=x, y=y, z=rng.uniform(0.08, 0.16), edge=0.01)


def plan_one(hand_name: str, spared: tuple[float, float], seed: int) -> list[float] | None:
    """Return the posture of one planned grasp, or None if none was found."""
    rng = np.random.default_rng(seed)
    hand = gp.load_hand(hand_name)
    problem = gp.GraspProblem.paper(
        hand=hand,
        grasp_object=random_object(rng, spared),
        tasks=(gp.force_task(rng.normal(size=3)),),
        n_synergies=hand.n_joints,
        parameters=gp.GraspParameters(force_weight=FORCE_WEIGHT, torque_model="total"),
        synergy_space=fully_actuated(hand),
    )
    start = gp.random_start(problem, rng)
    grasp = gp.plan_grasp(problem, seed=seed, start=start, options=gp.PlannerOptions(starts=6, enough=1))
    return grasp.joint_angles.tolist() if grasp.feasible else None


def main() -> None:
    """Plan the grasps, and write their principal components."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hand", default=HAND, help="name of the hand, or its description file")
    parser.add_argument("--grasps", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--spare", type=float, nargs=2, default=(0.0, 0.0), metavar=("FROM", "TO"), help="radii of no cylinder [m]"
    )
    parser.add_argument("--workers", type=int, default=None)
    parser.add_argument("--output", type=Path, default=None, help="CSV file; beside the hand's description if left out")
    arguments = parser.parse_args()
    hand = gp.load_hand(arguments.hand)
    output = arguments.output or hand.folder / "synergies" / "native.csv"
    spared = (arguments.spare[0], arguments.spare[1])
    seeds = range(arguments.seed, arguments.seed + arguments.grasps)
    with ProcessPoolExecutor(arguments.workers) as pool:
        planned = pool.map(plan_one, repeat(arguments.hand), repeat(spared), seeds, chunksize=4)
        postures = [posture for posture in planned if posture is not None]
    provenance = [
        f"PCA over {len(postures)} fully actuated fingertip grasps of the {hand.description.title or hand.name} "
        "planned by this package",
        f"spheres r 25-45 mm, cylinders r 20-45 mm, boxes 40-70 mm; random force tasks; w_F/w_C = {FORCE_WEIGHT:g}",
        f"made by scripts/make_native_synergies.py --grasps {arguments.grasps} --seed {arguments.seed}; not human data",
    ]
    if spared[1] > spared[0]:
        provenance.append(f"no cylinder of radius {1e3 * spared[0]:g} to {1e3 * spared[1]:g} mm: --spare")
    text = "\n".join(provenance)
    space = gp.synergies_from_postures(hand.joint_names, postures, name=output.stem, provenance=text)
    gp.save_synergies(space, output)
    shares = ", ".join(f"{share:.3f}" for share in space.explained_variance()[:5])
    print(f"{len(postures)} of {arguments.grasps} grasps; cumulative variance {shares}; wrote {output}")


if __name__ == "__main__":
    main()
