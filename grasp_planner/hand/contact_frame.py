"""A place of the hand that may touch the object."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from ..checks import unit_vector
from ..exceptions import NameNotFoundError
from ..values import Value
from .description import ContactDescription


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


def find_contact_frame(model: Any, name: str, described: ContactDescription) -> ContactFrame:
    """Look a contact frame up in the model."""
    frame = described.frame
    index = frame_index(model, frame)
    if index is None:
        raise NameNotFoundError("frame", frame, (f.name for f in model.frames if f.name != "universe"))
    entry = model.frames[index]
    link = _carrying_link(model, entry)
    x, y, z = entry.placement.act(np.array(described.offset)).tolist()
    normal = None
    if described.normal is not None:
        a, b, c = (entry.placement.rotation @ unit_vector(f"normal of contact {name}", described.normal)).tolist()
        normal = (a, b, c)
    centre = (x, y, z)
    return ContactFrame(name, frame, link, described.radius, index, entry.parentJoint, centre, described.offset, normal)


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
