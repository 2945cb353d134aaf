"""Make the synergy sets that are derived from other sets of a hand.

* ``thumb_and_fingers``: the first synergy of ``native_clear`` closes the whole hand with one motor. Here the thumb has
  a motor of its own, as in many hands that are built: two columns, each with the joints of one side. The references of
  one synergy of ``native_clear`` are among those of this set.
* ``santello_recentred``, ``uji_recentred``: the synergies of a human set, exactly, about the mean posture of
  ``native_clear``. How joints move together is human, where the springs rest is not: a fingertip that is carried over
  says little about how a thumb of other proportions has to bend.
* ``native_free``: the synergies of ``native_clear``, exactly, about a mean posture whose joints rest off their stops.
  Grasps were let move together until they span little, and some joints came to rest on their stops that way, where they
  have no motion left to squeeze with.

Usage: python scripts/make_derived_sets.py [--check]      (--check compares with the files instead of writing them)
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

import grasp_planner as gp
from grasp_planner.hand.kinematics import HandKinematics

ROOT = Path(__file__).resolve().parents[1]
THUMBS = {
    "dlr_hit_ii_right": ("thumb_abd", "thumb_mcp", "thumb_pip"),
    "allegro_right": ("joint_12.0", "joint_13.0", "joint_14.0", "joint_15.0"),
}
"""Joints of the thumb, by hand."""
HUMAN = {"dlr_hit_ii_right": ("santello", "uji")}
"""Human sets, by hand."""
FREED = ("dlr_hit_ii_right",)
"""Hands whose joints rest too near their stops in ``native_clear``."""
OFF_STOPS_DEG, MOST_OF_RANGE = 7.5, 0.4
"""How far from their stops joints rest [degrees], and at most: this share of a joint's range."""
FROM_MEAN = 0.005
"""Weight of a joint angle off the old mean posture against a fingertip off its place [m/rad]."""
MADE_BY = "made by scripts/make_derived_sets.py"


def thumb_and_fingers(hand: gp.Hand, thumb_joints: tuple[str, ...]) -> gp.SynergySpace:
    """Return the set with two motors.

    Args:
        hand: The hand, which has a set ``native_clear``.
        thumb_joints: Names of the joints of its thumb.
    """
    whole = hand.synergies("native_clear").truncated(1)
    closing = whole.basis[:, 0]
    thumb = np.isin(hand.joint_names, thumb_joints)
    columns = np.stack([np.where(thumb, closing, 0.0), np.where(thumb, 0.0, closing)], axis=1)
    cut = "the first synergy of native_clear cut in two: the thumb's joints, and those of all other fingers"
    first = [line for line in whole.provenance.splitlines() if not line.startswith(("further synergies", "variances"))]
    return replace(
        whole,
        basis=columns / np.linalg.norm(columns, axis=0),
        variance=None,
        name="thumb_and_fingers",
        provenance="\n".join([cut, f"{MADE_BY}; not human data", *first]),
    )


def recentred(hand: gp.Hand, human: str) -> gp.SynergySpace:
    """Return a human set about the mean posture of ``native_clear``."""
    space = hand.synergies(human)
    said = f"the synergies of {human} about the mean posture of native_clear: how joints move together is human data"
    return replace(
        space,
        mean=hand.synergies("native_clear").mean,
        name=f"{human}_recentred",
        provenance="\n".join([said, f"the mean posture is not; {MADE_BY}", *space.provenance.splitlines()]),
    )


def freed(hand: gp.Hand) -> gp.SynergySpace:
    """Return ``native_clear`` about a mean posture off the stops, fingertips as near to their places as may be."""
    space = hand.synergies("native_clear")
    kinematics = HandKinematics(hand, hand.contact_frames())
    places = kinematics.compute(space.mean).position
    reserve = np.minimum(np.radians(OFF_STOPS_DEG), MOST_OF_RANGE * (hand.upper - hand.lower))

    def moved(q: np.ndarray) -> np.ndarray:
        tips = kinematics.compute(q).position - places
        return np.concatenate([tips.ravel(), FROM_MEAN * (q - space.mean)])

    lower, upper = hand.lower + reserve, hand.upper - reserve
    inside = np.clip(space.mean, lower + 1e-6, upper - 1e-6)
    mean = least_squares(moved, inside, bounds=(lower, upper), xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    said = f"the synergies of native_clear about a mean posture {OFF_STOPS_DEG:g} degrees off every stop"
    return replace(
        space,
        mean=mean,
        name="native_free",
        provenance="\n".join([said, f"{MADE_BY}; not human data", *space.provenance.splitlines()]),
    )


def derived_sets() -> Iterator[tuple[str, gp.SynergySpace]]:
    """Yield every set with its hand's name."""
    for name, thumb_joints in THUMBS.items():
        hand = gp.load_hand(name)
        yield name, thumb_and_fingers(hand, thumb_joints)
        for human in HUMAN.get(name, ()):
            yield name, recentred(hand, human)
        if name in FREED:
            yield name, freed(hand)


def main() -> int:
    """Write the sets, or compare them with what is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare only; exit code 1 where a file differs")
    check = parser.parse_args().check
    differing = 0
    for name, made in derived_sets():
        path = ROOT / "urdf" / name.removesuffix("_right") / "synergies" / f"{made.name}.csv"
        if not check:
            gp.save_synergies(made, path)
            continue
        there = gp.load_synergies(path)
        if not (np.allclose(there.basis, made.basis, atol=1e-12) and np.allclose(there.mean, made.mean, atol=1e-9)):
            print(f"{path.relative_to(ROOT)} differs from what this script makes")
            differing += 1
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
