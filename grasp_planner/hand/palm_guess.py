"""A guess at the palm of a plain URDF, from how its fingers move when they close."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..spatial import Array
from .urdf_file import UrdfFile

HALF_CLOSED = 0.4
"""Share of its range at which each joint is when fingers are half closed."""
SYMMETRIC = 0.1
"""Joints whose limits differ by less than this share of their range move sideways: they do not close."""
COMMON_MOTION = 0.5
"""Least share of the fingertips' motion that is common to them if the fingers close to one side."""


@dataclass(frozen=True)
class PalmGuess:
    """The palm frame P as guessed from how the fingers move, in P.

    Attributes:
        link: Link the fingers start from.
        normal: Direction the tips take when the fingers close, of shape (3,).
        closing_axis: Axis the fingers close around, of shape (3,).
        grasp_centre: Middle of the half-closed fingertips [m], of shape (3,).
    """

    link: str
    normal: Array
    closing_axis: Array
    grasp_centre: Array


def guess_palm(urdf: UrdfFile, tips: list[int]) -> PalmGuess:
    """Return the palm as guessed from the fingertips with open and with half-closed fingers.

    Fingers close towards the farther end of their joints' ranges. If they close to one side, as those of a human
    hand, that side is the palm's; if from all sides, the palm looks along the fingers.

    Args:
        urdf: The URDF.
        tips: Indices of the fingertips' frames.

    Returns:
        The palm.
    """
    model = urdf.model
    joints = [joint for joint in range(1, model.njoints) if model.parents[joint] == 0]
    bases = [model.frames[model.getFrameId(model.names[joint], pin.FrameType.JOINT)] for joint in joints]
    carrier = model.frames[bases[0].parentFrame]
    root = carrier.placement.inverse()
    lower, upper = model.lowerPositionLimit, model.upperPositionLimit
    open_q = np.clip(np.zeros(model.nq), lower, upper)
    closing = np.abs(upper + lower) >= SYMMETRIC * (upper - lower)
    goal = np.where(upper >= -lower, upper, lower)
    half_q = np.where(closing, open_q + HALF_CLOSED * (goal - open_q), open_q)
    open_tips, half_tips = (_points(urdf, q, tips, root) for q in (open_q, half_q))
    base_points = np.array([root.act(base.placement.translation) for base in bases])
    along = _unit(open_tips.mean(axis=0) - base_points.mean(axis=0))
    motion = half_tips - open_tips
    motion -= np.outer(motion @ along, along)
    toward, centre = motion.mean(axis=0), half_tips.mean(axis=0)
    if np.linalg.norm(toward) < COMMON_MOTION * np.linalg.norm(motion, axis=1).mean():
        spread = np.linalg.svd(base_points - base_points.mean(axis=0))[2]
        across = spread[1] - (spread[1] @ along) * along
        return PalmGuess(carrier.name, along, _unit(across), centre)
    normal = _unit(toward)
    return PalmGuess(carrier.name, normal, _unit(np.cross(along, normal)), centre)


def _points(urdf: UrdfFile, q: Array, frames: list[int], root: pin.SE3) -> Array:
    """Return the origins of frames at a configuration, in P [m]."""
    data = urdf.model.createData()
    pin.framesForwardKinematics(urdf.model, data, q)
    return np.array([root.act(data.oMf[frame].translation) for frame in frames])


def _unit(vector: Array) -> Array:
    """Return a vector scaled to length one; +z if it has none."""
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-9 else np.array([0.0, 0.0, 1.0])
