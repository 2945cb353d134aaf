"""States of hand and object at rest, and what the next one has to meet."""

from __future__ import annotations

from dataclasses import dataclass

from ..spatial import Array
from .contact_law import Flags


@dataclass(frozen=True)
class RestState:
    """A state of hand and object; frame O, which moves with the object.

    Attributes:
        q: Posture [rad], of shape (n_q,).
        rotation: Of the palm in O, of shape (3, 3).
        translation: Of the palm in O [m], of shape (3,).
        forces: Of the hand on the object [N], of shape (n_c, 3).
        centres: Fingertips, or centres of their spheres [m], of shape (n_c, 3).
        gaps: Distances of the fingertips from the surface [m], of shape (n_c,).
        normals: Unit normals into the object, of shape (n_c, 3).
        slips: Slip of each contact in the step that ended here [m], of shape (n_c,).
    """

    q: Array
    rotation: Array
    translation: Array
    forces: Array
    centres: Array
    gaps: Array
    normals: Array
    slips: Array


@dataclass(frozen=True)
class Anchors:
    """Where the contacts were when the step began, or when they touched within it.

    Attributes:
        centres: Fingertips, or centres of their spheres, in O [m], of shape (n_c, 3).
        postures: Posture of each contact's finger then [rad], of shape (n_c, n_q).
        allowed: Which contacts may touch, of shape (n_c,).
    """

    centres: Array
    postures: Array
    allowed: Flags


@dataclass(frozen=True)
class Conditions:
    """What the next state of rest has to meet.

    Attributes:
        reference: q̄ + S σ of the references [rad], of shape (n_q,).
        anchors: Where the contacts come from.
        wrench: Wrench on the free object at its centre of mass, in axes that don't turn with it [N, N m], of shape
            (6,); None if it is held.
        drag: Force against the object's motion in this step [N/m].
    """

    reference: Array
    anchors: Anchors
    wrench: Array | None = None
    drag: float = 0.0
