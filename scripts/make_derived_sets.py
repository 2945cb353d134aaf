"""Make the synergy sets that are derived from other sets of a hand.

* ``thumb_and_fingers``: the first synergy of ``native_clear`` closes the whole hand with one motor. Here the thumb has
  a motor of its own, as in many hands that are built: two columns, each with the joints of one side. The references of
  one synergy of ``native_clear`` are among those of this set.
* ``santello_recentred``, ``uji_recentred``: the synergies of a human set, exactly, about the mean posture of
  ``native_clear``. How joints move together is human, where the springs rest is not: a fingertip that is carried over
  says little about how a thumb of other proportions has to bend.

Usage: python scripts/make_derived_sets.py [--check]      (--check compares with the files instead of writing them)
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import grasp_planner as gp

ROOT = Path(__file__).resolve().parents[1]
THUMBS = {
    "dlr_hit_ii_right": ("thumb_abd", "thumb_mcp", "thumb_pip"),
    "allegro_right": ("joint_12.0", "joint_13.0", "joint_14.0", "joint_15.0"),
}
"""Joints of the thumb, by hand."""
HUMAN = {"dlr_hit_ii_right": ("santello", "uji")}
"""Human sets, by hand."""
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


def derived_sets() -> Iterator[tuple[str, gp.SynergySpace]]:
    """Yield every set with its hand's name."""
    for name, thumb_joints in THUMBS.items():
        hand = gp.load_hand(name)
        yield name, thumb_and_fingers(hand, thumb_joints)
        for human in HUMAN.get(name, ()):
            yield name, recentred(hand, human)


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
        if not (np.allclose(there.basis, made.basis, atol=1e-12) and np.allclose(there.mean, made.mean, atol=1e-12)):
            print(f"{path.relative_to(ROOT)} differs from what this script makes")
            differing += 1
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
