"""Where a finger whose last link is a mesh touches: the ball that fits its surface on the side that closes.

The contact sits where the link's surface is farthest out in the direction that closes, so that the link lies behind
the plane of contact; its radius is that of the largest ball within the link that touches there.
"""

from __future__ import annotations

from typing import Any

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import cKDTree

from ..spatial import Array
from .closing import Closing, unit
from .fingers import Finger
from .fingertips import Fingertip, round_fingertip, rounded

TILTS = (0.0, 15.0, 30.0, 45.0)
"""Angles towards the finger's end by which the closing direction is tilted until the pad lies far out [degrees]."""
FAR_OUT = 0.55
"""Share of the last link's length from which on a pad lies far out."""
FLAT = 3e-4
"""Depth below the outermost point up to which surface counts as one flat pad [m]."""
OFF_SURFACE = 2e-4
"""Most that a contact's ball may stand out of the link [m]."""
RADII = np.geomspace(0.0015, 0.03, 28)
"""Radii of balls tried [m]."""
WIDTH = 0.35
"""Distance of two contacts of one pad from its middle, as a share of its width."""
LEAST_WIDTH = 0.006
"""Width of a pad from which on it gives two contacts [m]."""


def find_fingertips(closing: Closing, index: int, *, double: bool = False) -> tuple[Fingertip, ...]:
    """Return the contacts of a finger.

    Args:
        closing: How the hand closes.
        index: Which of its fingers.
        double: Whether a wide pad gives two contacts, side by side along the axis the finger closes about.

    Returns:
        One contact, or two.
    """
    finger, model = closing.fingers[index], closing.motion.model
    kinds = [type(entry.geometry) for entry in finger.geometries]
    if coal.Sphere in kinds or not any(issubclass(kind, (coal.BVHModelBase, coal.Box)) for kind in kinds):
        return (round_fingertip(model, finger),)
    pose = closing.motion.poses(closing.posture(closing.holding))[finger.joint]
    back = np.array(pose.rotation).T
    axis, closes = back @ closing.flexion_axes()[index], back @ closing.pad_directions()[index]
    normal, points = _pad(finger.points, unit(finger.end), closes, axis, double)
    return tuple(_fitted(model, finger, point, normal) for point in points)


def _pad(points: Array, end: Array, closes: Array, axis: Array, double: bool) -> tuple[Array, list[Array]]:
    """Return the outward normal of a pad and one or two points on it, in the frame of the joint."""
    along = unit(end - (end @ axis) * axis)
    inward = unit(closes - (closes @ along) * along - (closes @ axis) * axis)
    reach = float((points @ along).max())
    for tilt in np.radians(TILTS):
        normal = np.cos(tilt) * inward + np.sin(tilt) * along
        heights = points @ normal
        flat = points[heights > heights.max() - FLAT]
        spans = flat @ np.array([along, axis]).T
        middle = 0.5 * (spans.min(axis=0) + spans.max(axis=0))
        if middle[0] > FAR_OUT * reach:
            break
    width = float(np.ptp(spans[:, 1]))
    sides = (-WIDTH * width, WIDTH * width) if double and width > LEAST_WIDTH else (0.0,)
    wanted = [middle + np.array([0.0, side]) for side in sides]
    return normal, [flat[int(np.argmin(np.linalg.norm(spans - place, axis=1)))] for place in wanted]


def _fitted(model: Any, finger: Finger, point: Array, normal: Array) -> Fingertip:
    """Return the contact of the largest ball that touches a surface point from within."""
    tree = cKDTree(finger.points)
    centres = point - RADII[:, None] * normal
    inside = RADII - tree.query(centres)[0]
    fits = np.flatnonzero(inside < OFF_SURFACE)
    radius = float(RADII[fits[-1]] if fits.size else RADII[0])
    frame = next(f for f in model.frames if f.parentJoint == finger.joint and f.type == pin.FrameType.BODY)
    centre = frame.placement.actInv(point - radius * normal)
    outward = rounded(frame.placement.rotation.T @ normal)
    why = "ball that fits the pad's surface"
    return Fingertip(frame.name, frame.name, rounded(centre), round(radius, 6), why, outward)
