"""A place of the hand that may touch the object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from ..checks import unit_vector
from ..exceptions import InvalidValueError, NameNotFoundError
from ..spatial import Array
from ..values import Value
from .description import ContactDescription

SKIN = 2e-4
"""How far the ball of a contact patch may be from the surface of its link [m]."""


@dataclass(frozen=True, eq=False, repr=False)
class ContactPatch(Value):
    """Part of a contact's ball that is the surface of its link, to :data:`SKIN`.

    Attributes:
        normal: Outward normal in its middle, in the frame of the joint, of length one.
        across: Axis the finger closes about, normal to that, of length one.
        bend: Largest angle about the axis between normals of the patch and the one in the middle [rad].
        side: Largest angle between them and the plane across the axis [rad].
    """

    normal: tuple[float, float, float]
    across: tuple[float, float, float]
    bend: float
    side: float

    def walls(self) -> tuple[Array, Array]:
        """Return what bounds the normals n of the patch, each by n·a + b ≥ 0: a, of shape (4, 3), and b, (4,)."""
        normal, across = np.array(self.normal), np.array(self.across)
        along = np.cross(across, normal)
        low, high = (np.sin(self.bend) * normal + sign * np.cos(self.bend) * along for sign in (1.0, -1.0))
        room = float(np.sin(self.side))
        return np.array([low, high, across, -across]), np.array([0.0, 0.0, room, room])


@dataclass(frozen=True, eq=False, repr=False)
class ContactFrame(Value):
    """A place of the hand that may touch the object.

    Attributes:
        name: Its name in the contact set.
        frame: URDF frame that carries it.
        link: Link the frame is fixed to.
        radius: Fingertip radius [m].
        frame_id: Index of the frame in the Pinocchio model.
        joint_id: Index of the joint that carries it.
        centre: The fingertip (radius 0) or the centre of its sphere, in the frame of the joint [m].
        offset: The same in the frame [m].
        normal: Outward normal of the link where it touches, in the frame of the joint; None if it is not known.
        patch: Where its ball is the surface of the link; None if it may touch anywhere.
    """

    name: str
    frame: str
    link: str
    radius: float
    frame_id: int
    joint_id: int
    centre: tuple[float, float, float]
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    normal: tuple[float, float, float] | None = None
    patch: ContactPatch | None = None


def find_contact_frame(model: Any, name: str, described: ContactDescription) -> ContactFrame:
    """Look a contact frame up in the model."""
    frame = described.frame
    index = frame_index(model, frame)
    if index is None:
        raise NameNotFoundError("frame", frame, (f.name for f in model.frames if f.name != "universe"))
    entry = model.frames[index]
    link = _carrying_link(model, entry)
    x, y, z = entry.placement.act(np.array(described.offset)).tolist()
    normal, patch = _skin(entry.placement.rotation, name, described)
    centre = (x, y, z)
    placed = (index, entry.parentJoint, centre, described.offset)
    return ContactFrame(name, frame, link, described.radius, *placed, normal, patch)


def _skin(
    rotation: Array, name: str, described: ContactDescription
) -> tuple[tuple[float, float, float] | None, ContactPatch | None]:
    """Return normal and patch of a contact in the frame of its joint, as far as they are described."""
    if described.normal is None:
        if described.patch is not None:
            raise InvalidValueError(f"normal of contact {name}", None, "the normal in the middle of its patch")
        return None, None
    normal = rotation @ unit_vector(f"normal of contact {name}", described.normal)
    a, b, c = normal.tolist()
    if described.patch is None:
        return (a, b, c), None
    across = rotation @ unit_vector(f"patch.across of contact {name}", described.patch.across)
    upright = across - (across @ normal) * normal
    u, v, w = unit_vector(f"patch.across of contact {name}, not along its normal", upright).tolist()
    return (a, b, c), ContactPatch((a, b, c), (u, v, w), described.patch.bend, described.patch.side)


def frame_index(model: Any, name: str) -> int | None:
    """Return the index of a frame; a link goes before a joint of the same name. None if there is none."""
    kinds = (pin.FrameType.BODY, pin.FrameType.OP_FRAME, pin.FrameType.FIXED_JOINT, pin.FrameType.JOINT)
    return next((model.getFrameId(name, kind) for kind in kinds if model.existFrame(name, kind)), None)


def _carrying_link(model: Any, frame: Any) -> str:
    """Return the nearest link with mass at or above a frame: tip frames belong to the phalanx that carries them."""
    while frame.inertia.mass == 0.0 and frame.parentFrame > 0:
        parent = model.frames[frame.parentFrame]
        if parent.type == pin.FrameType.JOINT:
            break
        frame = parent
    return frame.name
