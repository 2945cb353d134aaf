"""Which fingers hold something between them, and how wide it is: their contacts' normals balance each other best.

Every finger more is a contact more that has to meet the object with the same few synergies; a thumb and two fingers
are what a grasp needs. Chosen are those whose normals, as far as their patches turn, come closest to equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pinocchio as pin
from scipy.optimize import nnls

from ..spatial import Array
from .closing import SHARES, Closing
from .fingertips import Fingertip

MOST = 3
"""Fingers that hold something, where a hand has more."""
AS_GOOD = 0.05
"""How much farther from balance fingers may be that stand closer together."""
UNPATCHED = 0.6
"""Angle to both sides by which the normal of a contact without a patch is taken to turn [rad]."""
NARROW = 0.012
"""Least gap between the surfaces of opposed contacts that counts as a grasp [m]."""
FACING = 0.5
"""Least cosine between the first contact's normal and the way to the others; beyond, fingers have passed each other."""
LEVER = 0.03
"""Length by which moments of normals are compared with their sum [m]."""
PART_OF_GAP = 0.55
"""Radius of a first object by the gap, which contacts to the side of a round object make the smaller."""
RADII = (0.012, 0.04)
"""Least and largest radius of a first object [m]."""


@dataclass(frozen=True)
class Opposition:
    """Fingers that oppose each other.

    Attributes:
        fingers: Which of the hand's, the opposing one first.
        share: Share of closing at which they do best.
        gap: Mean distance there between the surface of the first one's contact and those of the others [m].
        balance: What remains of the sum of their normals, from 0 to 1.
    """

    fingers: tuple[int, ...]
    share: float
    gap: float
    balance: float

    def first_object(self) -> str:
        """Return a cylinder that fits between them, as text: what a first grasp is planned of."""
        radius = round(float(np.clip(PART_OF_GAP * self.gap, *RADII)), 3)
        return f"cylinder:radius={radius:g},height=0.12,mass=0.1"


def find_opposition(closing: Closing, tips: list[tuple[Fingertip, ...]]) -> Opposition:
    """Return the fingers, at most three, that hold something between them.

    Args:
        closing: How the hand closes.
        tips: The contacts of each of its fingers.

    Returns:
        The fingers and where they oppose each other best.
    """
    count = len(tips)
    found = [_at(closing, tips, share, tuple(range(count))) for share in SHARES]
    if count > MOST:
        sets = [(0, *others) for others in combinations(range(1, count), MOST - 1)]
        found = [_at(closing, tips, share, chosen) for share in SHARES for chosen in sets]
    wide = [each for each in found if each.gap >= NARROW] or found
    least = min(each.balance for each in wide)
    good = [each for each in wide if each.balance <= least + AS_GOOD]
    return min(good, key=lambda each: (round(each.gap, 6), each.balance))


def _at(closing: Closing, tips: list[tuple[Fingertip, ...]], share: float, chosen: tuple[int, ...]) -> Opposition:
    """Return how well chosen fingers oppose each other at a share of closing."""
    poses, moves = closing.motion.poses(closing.posture(share)), closing.pad_directions(share)
    model = closing.motion.model
    middles, columns = [], []
    for index in chosen:
        on_finger = []
        for tip in tips[index]:
            # Asked for as a link: a joint may have the same name.
            frame = model.frames[model.getFrameId(tip.frame, pin.FrameType.BODY)]
            pose = poses[closing.fingers[index].joint] * frame.placement
            normals = _normals(tip, np.array(pose.rotation), moves[index])
            points = pose.act(np.array(tip.offset)) + tip.radius * normals
            on_finger.append(points[0])
            columns += list(zip(normals, points, strict=True))
        middles.append(np.mean(on_finger, axis=0))
    apart = np.mean(middles[1:], axis=0) - middles[0] if len(middles) > 1 else np.zeros(3)
    centre = np.mean(middles, axis=0)
    wrenches = np.array([np.append(n, np.cross(p - centre, n) / LEVER) for n, p in columns]).T
    system = np.vstack([wrenches, np.full((1, len(columns)), 10.0)])
    shares, _ = nnls(system, np.append(np.zeros(6), 10.0))
    left = float(np.linalg.norm(wrenches @ shares)) / max(float(shares.sum()), 1e-9)
    gaps = [float(np.linalg.norm(middle - middles[0])) for middle in middles[1:]]
    gap = float(np.mean(gaps)) if any(apart) else 0.0
    facing = float(apart @ columns[0][0]) > FACING * float(np.linalg.norm(apart))
    return Opposition(chosen, share, gap if facing else 0.0, left)


def _normals(tip: Fingertip, rotation: Array, move: Array) -> Array:
    """Return outward normals of a contact in the root frame, the middle one first, of shape (5, 3)."""
    if tip.normal is not None and tip.patch is not None:
        normal, across = rotation @ np.array(tip.normal), rotation @ np.array(tip.patch.across)
        bend, side = tip.patch.bend, tip.patch.side
    else:
        normal, bend, side = move, UNPATCHED, UNPATCHED
        across = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
        across /= np.linalg.norm(across)
    along = np.cross(across, normal)
    turned = [
        np.cos(s) * (np.cos(b) * normal + np.sin(b) * along) + np.sin(s) * across
        for b in (-bend, bend)
        for s in (-side, side)
    ]
    return np.array([normal, *turned])
