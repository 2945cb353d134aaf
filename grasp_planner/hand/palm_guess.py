"""The palm of a plain URDF: where it looks, what it closes around and where it holds, from how its fingers close."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from ..spatial import Array
from .closing import Closing, unit

HALF_CLOSED = 0.4
"""Share of closing by which it is seen where the fingertips go."""
COMMON_MOTION = 0.5
"""Least share of the fingertips' motion that is common to them if the fingers close to one side."""
BEFORE_TIPS = 0.2
"""Share of the way from the fingertips to the palm that an object sits deeper than them, between fingers that face."""


@dataclass(frozen=True)
class PalmGuess:
    """The palm frame P as derived from how the fingers move, in P.

    Attributes:
        link: Link the fingers start from.
        normal: Direction out of the palm, of shape (3,).
        closing_axis: Axis the fingers close around, of shape (3,).
        grasp_centre: Middle of the holding fingertips [m], of shape (3,).
    """

    link: str
    normal: Array
    closing_axis: Array
    grasp_centre: Array


def guess_palm(closing: Closing) -> PalmGuess:
    """Return the palm of a hand.

    Fingers that close to one side, as those of a human hand, have their palm on that side; where fingers stand face
    to face, the palm looks along them.

    Args:
        closing: How it closes.

    Returns:
        The palm.
    """
    link, in_root = palm_link(closing)
    root = in_root.inverse()
    turn = np.array(root.rotation)
    shares = (0.0, HALF_CLOSED, closing.holding)
    open_ends, half_ends, held_ends = (_acted(root, closing.ends(share)) for share in shares)
    bases = _acted(root, base_points(closing))
    axes = replace(closing, rest=closing.motion.open).flexion_axes()  # not spread
    axis = turn @ unit(axes[1:].sum(axis=0) if len(axes) > 1 else axes[0])
    centre = _middle(held_ends)
    along = unit(_middle(open_ends) - _middle(bases))
    motion = half_ends - open_ends
    motion = motion - np.outer(motion @ along, along)
    if _one_sided(motion):
        others = slice(1 if len(motion) > 1 else 0, None)
        along = unit((open_ends - bases)[others].mean(axis=0))
        normal = motion[others].mean(axis=0)
        normal = normal - (normal @ along) * along
    else:
        normal = centre - _middle(bases)
        across = held_ends[1:].mean(axis=0) - held_ends[0] if len(held_ends) > 1 else held_ends[0] - bases[0]
        across = unit(across - (across @ axis) * axis)
        normal = normal - (normal @ across) * across
        centre = centre - BEFORE_TIPS * (centre - _middle(bases)) @ unit(normal) * unit(normal)
    normal = unit(normal - (normal @ axis) * axis)
    return PalmGuess(link, normal, axis, centre)


def palm_link(closing: Closing) -> tuple[str, pin.SE3]:
    """Return the link that the fingers branch off from, and its pose in the root frame."""
    model = closing.motion.model
    first = [model.getFrameId(model.names[finger.chain[0]], pin.FrameType.JOINT) for finger in closing.fingers]
    lines = [_links_above(model, frame) for frame in first]
    shared = next(frame for frame in lines[0] if all(frame in line for line in lines))
    return model.frames[shared].name, pin.SE3(model.frames[shared].placement)


def base_points(closing: Closing) -> Array:
    """Return where the fingers start to bend: their first joints that flex, in the root frame [m], (n_f, 3)."""
    poses = closing.motion.poses(closing.rest)
    rates = closing.motion.coupling @ closing.directions
    first = (next((k for k in finger.chain if rates[k - 1] != 0.0), finger.chain[0]) for finger in closing.fingers)
    return np.array([poses[joint].translation for joint in first])


def _links_above(model: pin.Model, frame: int) -> list[int]:
    """Return the links above a frame that are fixed to the root, nearest first."""
    found = []
    while frame > 0:
        frame = model.frames[frame].parentFrame
        if model.frames[frame].type == pin.FrameType.BODY and model.frames[frame].parentJoint == 0:
            found.append(frame)
    return found


def _one_sided(motion: Array) -> bool:
    """Return whether most of the fingertips' motion across the fingers, of shape (n_f, 3), is common to them."""
    common = np.linalg.norm(motion.mean(axis=0))
    return bool(common > COMMON_MOTION * np.linalg.norm(motion, axis=1).mean())


def _middle(points: Array) -> Array:
    """Return the middle between the first point and the mean of the others [m], of shape (3,)."""
    return 0.5 * (points[0] + points[1:].mean(axis=0)) if len(points) > 1 else points[0]


def _acted(pose: pin.SE3, points: Array) -> Array:
    """Return points moved by a pose [m]."""
    return points @ np.array(pose.rotation).T + pose.translation
