"""Where a finger whose last link is a mesh or a box touches: a ball that is its surface over a range of normals.

A convex body is its support function h(n), the farthest it reaches in each direction; that of a ball, n·c + r, is
linear in centre and radius, so that the ball that fits a range of normals best follows by linear least squares. The
range, a patch, is as wide as the surface allows: fingertips are often round about one axis and flat along it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import coal
import numpy as np
import pinocchio as pin
from scipy.spatial import ConvexHull

from ..spatial import Array
from .closing import Closing, unit
from .contact_frame import SKIN
from .description import PatchDescription
from .fingers import Finger
from .fingertips import Fingertip, round_fingertip, rounded
from .hull_fit import surface_distance

TILTS = tuple(range(0, 80, 10))
"""Angles of a patch's middle from the direction that closes towards the finger's end [degrees]."""
BENDS = (1, 2, 3, 5, 7, 10, 13, 16, 20, 25, 30, 35, 40, 45)
"""Angles of a patch to both sides of its middle, about the axis its finger closes about [degrees]."""
SIDES = (10, 5, 3, 2)
"""Angles to both sides along that axis [degrees]."""
WANTED, TURNED = (-10.0, 10.0), 60.0
"""Tilts that a patch is to hold as many of as possible, and how much farther for a link that turns [degrees]."""
ALIKE, SAME = 0.85, 1.0
"""Cosine to the axis that a finger closes about of others that are tried; how much better they have to be."""
PARALLEL_MOTION = 0.1
"""Turn of a last link in right angles up to which its finger moves in parallel, straight at the others."""
FITS = 1.6e-4
"""Most that a patch may differ from its ball [m]."""
RADII = (5e-4, 0.03)
"""Least and largest radius of a contact's ball [m]."""
WIDTH = 0.35
"""Share of a wide pad's width to each side that one of its two contacts has."""


@dataclass(frozen=True)
class _Patch:
    """A ball that is the surface of a link over a range of normals.

    Attributes:
        centre: Its centre in the frame of the joint [m].
        radius: Its radius [m].
        normal: The normal in the middle.
        bend: Range about the axis to both sides [degrees].
        side: Range along it to both sides [degrees].
        worth: How good it is, more is better.
    """

    centre: Array
    radius: float
    normal: Array
    bend: float
    side: float
    worth: float


def find_fingertips(closing: Closing, index: int, *, double: bool = False) -> tuple[Fingertip, ...]:
    """Return the contacts of a finger.

    Args:
        closing: How the hand closes.
        index: Which of its fingers.
        double: Whether a pad gives two contacts, side by side along the axis the finger closes about.

    Returns:
        One contact, or two.
    """
    finger, model = closing.fingers[index], closing.motion.model
    kinds = [type(entry.geometry) for entry in finger.geometries]
    if coal.Sphere in kinds or not any(issubclass(kind, (coal.BVHModelBase, coal.Box)) for kind in kinds):
        return (round_fingertip(model, finger),)
    frame = next(f for f in model.frames if f.parentJoint == finger.joint and f.type == pin.FrameType.BODY)
    points = finger.points[ConvexHull(finger.points).vertices]
    back = np.array(closing.motion.poses(closing.posture(closing.holding))[finger.joint].rotation).T
    turn = _turn(closing, finger)
    closes = back @ (closing.pad_directions()[index] if turn > PARALLEL_MOTION else _across(closing, index))
    wanted = WANTED[0], WANTED[1] + TURNED * min(1.0, turn)
    choices = []
    for axis in _axes(closing, index, back, points):
        inward, along = _plane(finger.end, closes, axis, turn)
        parts = _halves(points, axis) if double else (points,)
        choices.append((axis, [_best_patch(finger, part, inward, along, wanted) for part in parts]))
    axis, patches = max(
        choices, key=lambda choice: min(patch.worth for patch in choice[1]) + SAME * (choice is choices[0])
    )
    return tuple(_fingertip(frame, finger, patch, axis) for patch in patches)


def _turn(closing: Closing, finger: Finger) -> float:
    """Return by how much a finger's last link turns as the hand closes, in right angles."""
    first, last = (closing.motion.poses(closing.posture(share))[finger.joint].rotation for share in (0.0, 1.0))
    return float(np.linalg.norm(pin.log3(first.T @ last))) / (0.5 * np.pi)


def _across(closing: Closing, index: int) -> Array:
    """Return the direction from a finger's end to the others' where the hand holds something."""
    ends = closing.ends(closing.holding)
    others = [k for k in range(len(ends)) if k != index]
    return unit(ends[others].mean(axis=0) - ends[index]) if others else closing.pad_directions()[index]


def _plane(end: Array, closes: Array, axis: Array, turn: float) -> tuple[Array, Array]:
    """Return the direction that closes and the one towards the finger's end, normal to each other and to an axis."""
    if turn > PARALLEL_MOTION:
        along = unit(end - (end @ axis) * axis)
        return unit(closes - (closes @ along) * along - (closes @ axis) * axis), along
    inward = unit(closes - (closes @ axis) * axis)
    return inward, unit(end - (end @ axis) * axis - (end @ inward) * inward)


def _axes(closing: Closing, index: int, back: Array, points: Array) -> list[Array]:
    """Return axes along which a fingertip may be flat: the one its finger closes about, its joint's, its shape's."""
    finger, flexion = closing.fingers[index], back @ closing.flexion_axes()[index]
    spread = points - points.mean(axis=0)
    own = back @ closing.motion.axes(closing.posture(closing.holding))[finger.joint - 1]
    others = (own, *np.linalg.eigh(spread.T @ spread)[1].T)
    return [flexion, *(axis * np.sign(axis @ flexion) for axis in others if abs(axis @ flexion) > ALIKE)]


def _halves(points: Array, axis: Array) -> tuple[Array, Array]:
    """Return the points of both sides of a pad that is as wide along an axis as its points are."""
    along = points @ axis
    low, high = float(along.min()), float(along.max())
    return points[along < low + WIDTH * (high - low)], points[along > high - WIDTH * (high - low)]


def _best_patch(finger: Finger, points: Array, inward: Array, along: Array, wanted: tuple[float, float]) -> _Patch:
    """Return the patch that serves best among those that lie on the surface of a finger's last link.

    Args:
        finger: The finger.
        points: Corners of the convex body that touches [m], of shape (n, 3).
        inward: Direction that closes, in the frame of the joint.
        along: Direction towards the finger's end, normal to it.
        wanted: Tilts that it is to hold [degrees].
    """
    found = [
        patch for tilt in TILTS for side in SIDES for patch in _widest(points, (inward, along), tilt, side, wanted)
    ]
    found.sort(key=lambda patch: -patch.worth)
    for patch in found:
        across = np.cross(patch.normal, along)
        normals = patch_normals(patch.normal, unit(np.cross(across, patch.normal)), patch.bend, patch.side)
        touching = patch.centre + patch.radius * normals
        if max(surface_distance(finger.geometries, point) for point in touching) < SKIN:
            return patch
    return found[0]


def _widest(
    points: Array, plane: tuple[Array, Array], tilt: float, side: float, wanted: tuple[float, float]
) -> list[_Patch]:
    """Return the widest patch about a tilt of the normal with a range along the axis, if any fits."""
    (inward, along), t = plane, np.radians(tilt)
    normal, onward = np.cos(t) * inward + np.sin(t) * along, np.cos(t) * along - np.sin(t) * inward
    best: list[_Patch] = []
    for bend in BENDS:
        normals = patch_normals(normal, onward, bend, side)
        centre, radius, error = fitted_ball(points, normals)
        if error > FITS:
            break
        held = max(0.0, min(tilt + bend, wanted[1]) - max(tilt - bend, wanted[0]))
        best = [_Patch(centre, radius, normal, bend, side, held * np.sqrt(side))]
    return best


def patch_normals(normal: Array, onward: Array, bend: float, side: float) -> Array:
    """Return normals spread over a patch, of shape (n, 3)."""
    across = np.cross(normal, onward)
    b, s = np.radians(bend) * np.linspace(-1.0, 1.0, 9), np.radians(side) * np.linspace(-1.0, 1.0, 3)
    bent = np.cos(b)[:, None] * normal + np.sin(b)[:, None] * onward
    return np.vstack([np.cos(turn) * bent + np.sin(turn) * across for turn in s])


def fitted_ball(points: Array, normals: Array) -> tuple[Array, float, float]:
    """Return centre, radius and error of the ball whose support function fits that of points best [m]."""
    reach = (normals @ points.T).max(axis=1)
    found = np.linalg.lstsq(np.column_stack([normals, np.ones(len(normals))]), reach, rcond=None)[0]
    centre, radius = found[:3], float(found[3])
    if not RADII[0] <= radius <= RADII[1]:
        radius = float(np.clip(radius, *RADII))
        centre = np.linalg.lstsq(normals, reach - radius, rcond=None)[0]
    return centre, radius, float(np.abs(reach - normals @ centre - radius).max())


def _fingertip(frame: Any, finger: Finger, patch: _Patch, axis: Array) -> Fingertip:
    """Return the contact of a patch, in the frame of its link."""
    back = frame.placement.rotation.T
    described = PatchDescription(across=rounded(back @ axis), bend=radians(patch.bend), side=radians(patch.side))
    error = surface_distance(finger.geometries, patch.centre + patch.radius * patch.normal)
    return Fingertip(
        frame.name,
        frame.name,
        rounded(frame.placement.actInv(patch.centre)),
        round(patch.radius, 6),
        f"ball that fits ±{patch.bend:g}° × ±{patch.side:g}° of the surface, {1e3 * error:.2f} mm off it",
        rounded(back @ patch.normal),
        described,
    )


def radians(degrees: float) -> float:
    """Return an angle in radians, rounded."""
    return round(float(np.radians(degrees)), 4)
