"""How the fingers of a plain URDF close and which of them opposes the others, from geometry alone.

Joints about the axis of a finger's last joint flex it; the others turn or spread it. A joint closes towards the
farther end of its range from zero; where its range is about the same on both sides, it bends the way the last joint
does. Joints that do not flex stand where the fingers oppose each other most.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..spatial import Array
from .fingers import Finger
from .motion import HandMotion

PARALLEL = 0.7
"""Cosine to the axis of the last joint from which on a joint flexes its finger."""
ONE_SIDED = 0.35
"""Share of its range by which a joint's limits lie to one side of zero if that side is where it closes."""
SHARES = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)
"""Shares of its closing range among which the one at which a hand holds something is chosen."""
WIDE = 0.3
"""Distance between opposed fingertips where a hand holds something, as a share of a finger's length."""
TURNS = 7
"""Positions tried of each joint that does not flex."""
LEAST_TURN = 0.3
"""Rate of turning of a last link below which its finger does not turn [rad per rad of its joints]."""
REST_BONUS = 0.05
"""Opposition that a joint which does not flex has to gain to leave its rest."""


@dataclass(frozen=True)
class Closing:
    """How a hand closes.

    Attributes:
        motion: Its joints.
        fingers: Its fingers, the opposing one first, the others in order along the closing axis.
        directions: Closing direction of each independent joint: +1, −1, or 0 if it does not flex, of shape (n_q,).
        rest: Open posture, with the fingers opposed [rad or m], of shape (n_q,).
        holding: Share of closing at which the fingers hold something: opposed and wide enough apart.
        opposition: There, from −1 (all move the same way) to 1 (straight towards each other).
    """

    motion: HandMotion
    fingers: tuple[Finger, ...]
    directions: Array
    rest: Array
    holding: float
    opposition: float

    def posture(self, share: float) -> Array:
        """Return the posture with every flexing joint at a share of its way to its closed end, of shape (n_q,)."""
        goal = np.where(self.directions > 0.0, self.motion.upper, self.motion.lower)
        return self.rest + np.abs(self.directions) * share * (goal - self.rest)

    def ends(self, share: float) -> Array:
        """Return the ends of the fingers at a share of closing, in the root frame [m], of shape (n_f, 3)."""
        return tips_at(self.motion, self.fingers, self.posture(share))

    def length(self) -> float:
        """Return the mean distance of the fingers' ends from their first joints with the hand open [m]."""
        first = [finger.chain[0] for finger in self.fingers]
        starts = self.motion.points(self.rest, first, np.zeros((len(first), 3)))
        return float(np.linalg.norm(self.ends(0.0) - starts, axis=1).mean())

    def flexion_axes(self) -> Array:
        """Return the axes about which the holding fingers close, in the root frame, of shape (n_f, 3)."""
        q = self.posture(self.holding)
        axes, rates = self.motion.axes(q), self.motion.coupling @ self.directions
        ends, moves, poses = self.ends(self.holding), self.pad_directions(), self.motion.poses(q)
        found = []
        for finger, end, move in zip(self.fingers, ends, moves, strict=True):
            turning = np.sum([rates[k - 1] * axes[k - 1] for k in finger.chain], axis=0)
            if np.linalg.norm(turning) < LEAST_TURN:  # parallel links counter-rotate
                turning = axes[finger.joint - 1] * (np.sign(rates[finger.joint - 1]) or 1.0)
            if np.linalg.norm(turning) < LEAST_TURN:  # it slides: what would turn its end the same way
                turning = LEAST_TURN * np.cross(unit(end - poses[finger.chain[0]].translation), move)
            found.append(unit(turning))
        return np.array(found)

    def pad_directions(self, share: float | None = None, step: float = 0.05) -> Array:
        """Return where the ends move as the hand closes, at a share or where it holds, of shape (n_f, 3)."""
        share = self.holding if share is None else share
        moved = self.ends(min(share + step, 1.0)) - self.ends(max(share - step, 0.0))
        return np.array([unit(row) for row in moved])


def find_closing(motion: HandMotion, fingers: tuple[Finger, ...]) -> Closing:
    """Return how a hand closes.

    Args:
        motion: Its joints.
        fingers: Its fingers, at least one.

    Returns:
        The closing motion.
    """
    flexing = _flexing(motion, fingers)
    directions = _directions(motion, fingers, flexing)
    best = Closing(motion, fingers, directions, motion.open, SHARES[2], -2.0)
    free = [k for k in range(len(motion.joints)) if directions[k] == 0.0 and _moves(motion, fingers, k)]
    best = _scored(best, best.rest)
    for _ in range(2 if len(fingers) > 1 else 0):
        for k in free:
            for value in np.linspace(motion.lower[k], motion.upper[k], TURNS):
                rest = best.rest.copy()
                rest[k] = value
                tried = _scored(best, rest)
                if tried.opposition > best.opposition + REST_BONUS:
                    best = tried
    return _ordered(best)


def tips_at(motion: HandMotion, fingers: tuple[Finger, ...], q: Array) -> Array:
    """Return the ends of fingers in the root frame at q [m], of shape (n_f, 3)."""
    return motion.points(q, [finger.joint for finger in fingers], np.array([finger.end for finger in fingers]))


def unit(vector: Array) -> Array:
    """Return a vector scaled to length one; +z if it has none."""
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])


def _flexing(motion: HandMotion, fingers: tuple[Finger, ...]) -> Array:
    """Return for each joint of the model its finger's flexion: ±1 about the last joint's axis, 0 if it does not."""
    axes, slides = motion.axes(motion.open), motion.slides()
    found = np.zeros(len(axes))
    for finger in fingers:
        last = axes[finger.joint - 1]
        for joint in finger.chain:
            along = float(axes[joint - 1] @ last)
            if slides[joint - 1]:
                found[joint - 1] = 1.0
            elif abs(along) > PARALLEL and found[joint - 1] == 0.0:
                found[joint - 1] = float(np.sign(along))
    return found


def _directions(motion: HandMotion, fingers: tuple[Finger, ...], flexing: Array) -> Array:
    """Return the closing direction of each independent joint."""
    lower, upper = motion.lower, motion.upper
    used = np.abs(motion.coupling.T) @ np.abs(flexing) > 0.0
    towards = np.where(upper >= -lower, 1.0, -1.0) * used
    clear = np.abs(upper + lower) >= ONE_SIDED * (upper - lower)
    for finger in fingers:
        driven = np.flatnonzero(motion.drives(finger.joint))
        senses = np.zeros(len(lower))
        for joint in finger.chain:
            senses += flexing[joint - 1] * motion.coupling[joint - 1]
        sure = [k for k in driven if clear[k] and used[k] and senses[k] != 0.0]
        if not sure:
            continue
        sense = float(np.sign(sum(towards[k] * senses[k] for k in sure)))
        for k in driven:
            if not clear[k] and used[k] and senses[k] != 0.0:
                towards[k] = sense * np.sign(senses[k])
    return towards


def _moves(motion: HandMotion, fingers: tuple[Finger, ...], k: int) -> bool:
    """Return whether an independent joint moves any finger."""
    return any(motion.drives(finger.joint)[k] for finger in fingers)


def _scored(closing: Closing, rest: Array) -> Closing:
    """Return a closing motion with another rest, its opposing finger first, and where it holds."""
    given = replace(closing, rest=rest)
    best, first, holding, quality = -2.0, 0, closing.holding, -np.inf
    starts = given.motion.points(rest, [finger.chain[0] for finger in given.fingers], np.zeros((len(given.fingers), 3)))
    for share in SHARES if len(given.fingers) > 1 else ():
        ends, moves = given.ends(share), given.pad_directions(share)
        length = float(np.linalg.norm(ends - starts, axis=1).mean())
        for t in range(len(ends)):
            others = [f for f in range(len(ends)) if f != t]
            apart = ends[others].mean(axis=0) - ends[t]
            score = 0.5 * float(moves[t] @ unit(apart) - (moves[others] @ unit(apart)).mean())
            wide = float(np.linalg.norm(apart)) / (WIDE * length)
            fit = float(np.exp(-(np.log(max(wide, 1e-6)) ** 2)))
            if score * fit > quality + 1e-9:
                best, first, holding, quality = score, t, share, score * fit
    order = [first, *(f for f in range(len(given.fingers)) if f != first)]
    fingers = tuple(given.fingers[f] for f in order)
    return replace(given, fingers=fingers, holding=holding, opposition=best)


def _ordered(closing: Closing) -> Closing:
    """Return the same with the fingers after the first in order along their mean flexion axis."""
    if len(closing.fingers) < 3:
        return closing
    axes, ends = closing.flexion_axes()[1:], closing.ends(0.0)[1:]
    axis = unit(axes.sum(axis=0))
    order = np.argsort(np.round(ends @ axis, 6), kind="stable")
    fingers = (closing.fingers[0], *(closing.fingers[1 + k] for k in order))
    return replace(closing, fingers=fingers)
