"""Synergies of a hand that comes without: its motors one by one, and a set made from how its fingers close."""

from __future__ import annotations

import numpy as np

from ..spatial import Array, readonly
from ..synergies.space import SynergySpace
from .closing import Closing

MOTORS, CLOSING = "motors", "closing"
"""Names of the sets that every hand has."""
BEFORE_HOLDING = 0.6
"""Share of the way to holding something at which the mean posture is."""
LEAST_NEW = 0.05
"""Length that a direction has to keep beside the ones before it to become a synergy."""


def motor_synergies(joints: tuple[str, ...], mean: Array) -> SynergySpace:
    """Return one synergy for each independent joint.

    Args:
        joints: Their names.
        mean: Mean posture [rad or m], of shape (n_q,).

    Returns:
        The set; its basis is the identity.
    """
    return SynergySpace(joints, readonly(mean), np.eye(len(joints)), name=MOTORS, provenance="one for each joint")


def closing_synergies(closing: Closing) -> SynergySpace:
    """Return synergies from the geometry of closing, orthonormal and as many as there are joints.

    All fingers flex with the thumb opposing; then the thumb alone, the inner joints against the outer ones, the
    joints that turn the thumb, those that spread the fingers, each finger, and what is left.

    Args:
        closing: How the hand closes.

    Returns:
        The set.
    """
    motion = closing.motion
    spans = (motion.upper - motion.lower) * closing.directions
    driven = [motion.drives(finger.joint) for finger in closing.fingers]
    still = closing.directions == 0.0
    outer = np.zeros(len(spans), dtype=bool)
    for finger in closing.fingers:
        outer |= np.abs(motion.coupling[finger.joint - 1]) > 0.0
    thumb, others = driven[0], np.any(driven[1:], axis=0) if len(driven) > 1 else np.zeros_like(driven[0])
    wanted = [spans, spans * thumb, spans * outer, 1.0 * (still & thumb), _spread(closing) * (still & others)]
    wanted += [spans * mask for mask in driven]
    wanted += list(np.eye(len(spans))[np.argsort(-np.abs(spans), kind="stable")])
    basis: list[Array] = []
    for direction in wanted:
        rest = direction / max(float(np.linalg.norm(direction)), 1e-12)
        for column in (*basis, *basis):
            rest = rest - (column @ rest) * column
        length = float(np.linalg.norm(rest))
        if length > LEAST_NEW:
            basis.append(rest / length)
    mean = closing.posture(BEFORE_HOLDING * closing.holding)
    columns = np.column_stack(basis)
    return SynergySpace(motion.joints, readonly(mean), columns, name=CLOSING, provenance="geometry of closing")


def _spread(closing: Closing) -> Array:
    """Return by how much each joint that does not flex moves fingers apart along their common axis, of shape (n_q,)."""
    motion, found = closing.motion, np.zeros(len(closing.directions))
    axis = closing.flexion_axes()[1:].sum(axis=0) if len(closing.fingers) > 1 else closing.flexion_axes()[0]
    rest = closing.ends(closing.holding)
    for k in np.flatnonzero(closing.directions == 0.0):
        moved = closing.posture(closing.holding)
        moved[k] += 1e-3
        shift = motion.points(moved, [f.joint for f in closing.fingers], np.array([f.end for f in closing.fingers]))
        sideways = (shift - rest) @ axis
        places = (rest - rest.mean(axis=0)) @ axis
        found[k] = float(sideways @ places)
    return found
