"""Make the synergy set ``thumb_and_fingers`` of a hand: one motor for its thumb, one for all other fingers.

The first synergy of ``native_clear`` closes the whole hand with one motor. Here its thumb has a motor of its own, as in
many hands that are built: two columns, each with the joints of one side. The references of one synergy of
``native_clear`` are among those of this set, and so are all that the thumb's own share adds.

Usage: python scripts/make_motor_sets.py [--check]      (--check compares with the files instead of writing them)
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import grasp_planner as gp

ROOT = Path(__file__).resolve().parents[1]
HANDS = {
    "dlr_hit_ii_right": ("dlr_hit_ii", ("thumb_abd", "thumb_mcp", "thumb_pip")),
    "allegro_right": ("allegro", ("joint_12.0", "joint_13.0", "joint_14.0", "joint_15.0")),
}
"""Folder of a hand below ``urdf/``, and the joints of its thumb."""


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
    provenance = "the first synergy of native_clear cut in two: the thumb's joints, and those of all other fingers"
    first = [line for line in whole.provenance.splitlines() if not line.startswith(("further synergies", "variances"))]
    return replace(
        whole,
        basis=columns / np.linalg.norm(columns, axis=0),
        variance=None,
        name="thumb_and_fingers",
        provenance="\n".join([provenance, "made by scripts/make_motor_sets.py; not human data", *first]),
    )


def main() -> int:
    """Write the sets, or compare them with what is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare only; exit code 1 where a file differs")
    check = parser.parse_args().check
    differing = 0
    for name, (folder, thumb_joints) in HANDS.items():
        made = thumb_and_fingers(gp.load_hand(name), thumb_joints)
        path = ROOT / "urdf" / folder / "synergies" / f"{made.name}.csv"
        if not check:
            gp.save_synergies(made, path)
        elif not np.allclose(gp.load_synergies(path).basis, made.basis, atol=1e-12):
            print(f"{path.relative_to(ROOT)} differs from what this script makes")
            differing += 1
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
