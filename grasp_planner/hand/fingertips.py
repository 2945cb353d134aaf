"""Where a finger of a plain URDF is likely to touch an object: a named tip frame, or the end of its last link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from ..spatial import Array
from .description import PatchDescription
from .fingers import Finger

TIP_WORDS = ("tip", "pad", "end")
"""Words in the name of a frame that marks a fingertip."""
DEFAULT_RADIUS = 0.01
"""Radius of a fingertip whose geometry does not say it [m]."""


@dataclass(frozen=True)
class Fingertip:
    """A likely contact.

    Attributes:
        frame: URDF link whose frame carries it.
        link: Link that moves it.
        offset: Its centre in the frame [m].
        radius: Radius of the sphere around it [m].
        reason: What it was derived from.
        normal: Outward normal of the link's surface where it touches, in the frame; None if it may touch anywhere.
        patch: Where around the normal the sphere is the surface; None if it is everywhere.
    """

    frame: str
    link: str
    offset: tuple[float, float, float]
    radius: float
    reason: str
    normal: tuple[float, float, float] | None = None
    patch: PatchDescription | None = None


def round_fingertip(model: Any, finger: Finger) -> Fingertip:
    """Return the fingertip of a finger whose last link is made of balls, rods or boxes, or has no geometry.

    Args:
        model: Pinocchio model.
        finger: The finger.

    Returns:
        The sphere of a tip frame if there is one, a bare tip frame, or the far end of the last link's geometry.
    """
    joint, geometries = finger.joint, list(finger.geometries)
    frames = [frame for frame in model.frames if frame.parentJoint == joint and frame.type == pin.FrameType.BODY]
    link = frames[0].name
    named = [frame for frame in frames[1:] if any(word in frame.name.lower() for word in TIP_WORDS)]
    ordered = sorted(named or frames[1:], key=lambda frame: -float(np.linalg.norm(frame.placement.translation)))
    for frame in ordered:
        for entry in geometries:
            if isinstance(entry.geometry, coal.Sphere) and model.frames[entry.parentFrame].name == frame.name:
                centre = (frame.placement.inverse() * entry.placement).translation
                return Fingertip(frame.name, link, rounded(centre), float(entry.geometry.radius), "sphere of the tip")
    if geometries:
        return _end_of_geometry(frames[0], geometries)
    if ordered:
        return Fingertip(ordered[0].name, link, (0.0, 0.0, 0.0), DEFAULT_RADIUS, "tip frame; radius assumed")
    return Fingertip(link, link, (0.0, 0.0, 0.0), DEFAULT_RADIUS, "last joint: it has no tip frame and no geometry")


def _end_of_geometry(frame: Any, geometries: list[Any]) -> Fingertip:
    """Return the sphere that fills the far end of the last link's collision geometry."""
    boxes = [_bounds(frame.placement.inverse() * entry.placement, entry.geometry) for entry in geometries]
    low, high = np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)
    reach = np.where(high > -low, high, low)
    axis = int(np.argmax(np.abs(reach)))
    across = np.delete(high - low, axis)
    radius = float(np.clip(across.min() / 2, 0.002, 0.03))
    centre = (low + high) / 2
    centre[axis] = reach[axis] - np.sign(reach[axis]) * radius
    return Fingertip(frame.name, frame.name, rounded(centre), round(radius, 5), "far end of the last link")


def _bounds(placement: Any, geometry: Any) -> tuple[Array, Array]:
    """Return the corners of the bounding box of a placed geometry [m]."""
    geometry.computeLocalAABB()
    centre, extent = np.array(geometry.aabb_center), np.array(geometry.aabb_local.max_) - np.array(geometry.aabb_center)
    rotation = np.abs(np.array(placement.rotation))
    middle = placement.act(centre)
    return middle - rotation @ extent, middle + rotation @ extent


def rounded(point: Array) -> tuple[float, float, float]:
    """Return a point to a micrometre [m]."""
    x, y, z = (round(float(value), 6) + 0.0 for value in point)
    return x, y, z
