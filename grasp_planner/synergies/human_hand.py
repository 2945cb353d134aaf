"""A simple human hand: Santello's fifteen joint angles to fingertips, and whether the thumb opposes the fingers.

Sources:

* [Buchholz1992] B. Buchholz, T. J. Armstrong, S. A. Goldstein, "Anthropometric data for describing the kinematics
  of the human hand", Ergonomics 35(3), 1992: lengths of the segments as fractions of the hand's length, places of
  the joints in the palm as fractions of its length and breadth. The bone lengths measured by A. Buryanov and
  V. Kotiuk, "Proportions of hand segments", Int. J. Morphol. 28(3), 2010, agree within a few millimetres.
* [Greiner1991] T. M. Greiner, "Hand anthropometry of U.S. Army personnel", 1991: a hand of about 19 cm by 8.5 cm.
* [Santello1998] M. Santello, M. Flanders, J. F. Soechting, "Postural hand synergies for tool use",
  J. Neurosci. 18(23), 1998: the joint angles; the thumb rotates about the line from its base to the index MCP.

What is approximate: joints are hinges with crossing axes, the palm is flat and stiff, the fingers are parallel
when straight and flex in planes normal to the palm (no convergence), DIP = 2/3 PIP, and the plane in which the
thumb flexes turns with its rotation, except for the constant ``thumb_pronation``.

Palm frame, right hand, as for the robot hand: origin at the wrist, z along the straight fingers, x out of the
palm, y to the thumb's side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..checks import positive
from ..exceptions import InvalidValueError
from ..spatial import Array, skew

HUMAN_FINGERS = ("thumb", "index", "middle", "ring", "little")
"""Order of the fingertips."""

HUMAN_JOINTS = (
    "thumb_rotation",
    "thumb_mcp",
    "thumb_ip",
    "thumb_abduction",
    "index_middle_abduction",
    "middle_ring_abduction",
    "ring_little_abduction",
    *(f"{finger}_{joint}" for joint in ("mcp", "pip") for finger in HUMAN_FINGERS[1:]),
)
"""Order of the joint angles: flexion +, internal rotation of the thumb +, fingers apart +  [Santello1998]."""

# [Buchholz1992]. Index, middle, ring, little; the MCP joints: along z in hand lengths, along y in hand breadths.
_MCP_Z = np.array([0.447, 0.446, 0.409, 0.368])
_MCP_Y = np.array([0.251, 0.0, -0.206, -0.402])
# Proximal, middle, distal phalanx, in hand lengths.
_PHALANGES = np.array([[0.245, 0.143, 0.097], [0.266, 0.170, 0.108], [0.244, 0.165, 0.107], [0.204, 0.117, 0.093]])
# The thumb's carpometacarpal joint, and its metacarpal, proximal and distal phalanx in hand lengths.
_THUMB_Z, _THUMB_Y = 0.073, 0.196
_THUMB_SEGMENTS = np.array([0.251, 0.196, 0.158])
_DIP_OF_PIP = 2.0 / 3.0


@dataclass(frozen=True)
class HumanHand:
    """Sizes of a right hand.

    Attributes:
        length: Hand length, wrist to middle fingertip [m]; [Greiner1991].
        breadth: Hand breadth over the metacarpals [m]; [Greiner1991].
        thumb_base_depth: How far the thumb's base lies in front of the plane of the other metacarpals, in hand
            breadths. Not measured by [Buchholz1992].
        thumb_pronation: Constant turn of the thumb's plane of flexion about its metacarpal [rad], + towards the
            fingers' pulps. With 0 the thumb flexes in the plane of its metacarpal and the axis of its rotation.
    """

    length: float = 0.19
    breadth: float = 0.085
    thumb_base_depth: float = 0.05
    thumb_pronation: float = 0.5

    def __post_init__(self) -> None:
        positive("length", self.length, unit="m")
        positive("breadth", self.breadth, unit="m")
        for name in ("thumb_base_depth", "thumb_pronation"):
            value = getattr(self, name)
            if not np.isfinite(value):
                raise InvalidValueError(name, value, "a finite number")

    @property
    def finger_bases(self) -> Array:
        """MCP joints of index, middle, ring and little finger [m], palm frame, of shape (4, 3)."""
        return np.column_stack([np.zeros(4), self.breadth * _MCP_Y, self.length * _MCP_Z])

    @property
    def finger_lengths(self) -> Array:
        """Lengths of the four straight fingers, MCP joint to tip [m], of shape (4,)."""
        return self.length * _PHALANGES.sum(axis=1)

    @property
    def thumb_base(self) -> Array:
        """The thumb's carpometacarpal joint [m], palm frame, of shape (3,)."""
        depth, side = self.breadth * self.thumb_base_depth, self.breadth * _THUMB_Y
        return np.array([depth, side, self.length * _THUMB_Z])

    @property
    def thumb_frame(self) -> Array:
        """Columns in the palm frame: axis of the thumb's rotation (to the index MCP), radial, palmar; (3, 3)."""
        axis = self.finger_bases[0] - self.thumb_base
        axis /= np.linalg.norm(axis)
        radial = np.array([0.0, 1.0, 0.0]) - axis[1] * axis
        radial /= np.linalg.norm(radial)
        return np.column_stack([axis, radial, np.cross(radial, axis)])


@dataclass(frozen=True)
class HumanFingertips:
    """Fingertips of human postures, in the palm frame; order of :data:`HUMAN_FINGERS`.

    Attributes:
        position: Ends of the distal phalanges [m], of shape (..., 5, 3).
        pulp: Unit normals out of the pulps (palmar sides of the distal phalanges), of shape (..., 5, 3).
    """

    position: Array
    pulp: Array

    def opposition(self) -> tuple[Array, Array]:
        """Return how far the thumb is from the index and middle fingers, and how much their pulps face it.

        Returns:
            The distance from the thumb's tip to the point halfway between the tips of index and middle finger [m],
            of shape (...); and the smaller of two cosines, of shape (...): between the thumb's pulp normal and the
            direction to that point, and between the mean pulp normal of both fingers and the way back. It is 1 for
            pulps that face each other squarely, and negative where one looks away.
        """
        across = self.position[..., 1:3, :].mean(axis=-2) - self.position[..., 0, :]
        distance = np.linalg.norm(across, axis=-1)
        direction = across / np.maximum(distance, 1e-12)[..., None]
        fingers = self.pulp[..., 1:3, :].sum(axis=-2)
        fingers /= np.maximum(np.linalg.norm(fingers, axis=-1), 1e-12)[..., None]
        thumb_cosine = (self.pulp[..., 0, :] * direction).sum(axis=-1)
        finger_cosine = -(fingers * direction).sum(axis=-1)
        return distance, np.minimum(thumb_cosine, finger_cosine)


def human_fingertips(hand: HumanHand, postures: Array) -> HumanFingertips:
    """Return the fingertips of human postures.

    Args:
        hand: Sizes of the hand.
        postures: Joint angles [rad] in the order of :data:`HUMAN_JOINTS`, of shape (..., 15). Thumb abduction is
            the angle between the thumb's metacarpal and the axis of its rotation; a thumb rotation of 0 puts the
            metacarpal into the plane of the palm, of 90° straight in front of it.

    Returns:
        Tips and pulp normals, palm frame.

    Raises:
        InvalidValueError: If the last axis is not 15 long.
    """
    angles = np.asarray(postures, dtype=float)
    if angles.ndim == 0 or angles.shape[-1] != len(HUMAN_JOINTS):
        raise InvalidValueError("postures", angles.shape, f"an array of shape (..., {len(HUMAN_JOINTS)})")
    thumb_tip, thumb_pulp = _thumb(hand, angles)
    finger_tips, finger_pulps = _four_fingers(hand, angles)
    return HumanFingertips(
        np.concatenate([thumb_tip[..., None, :], finger_tips], axis=-2),
        np.concatenate([thumb_pulp[..., None, :], finger_pulps], axis=-2),
    )


def thumb_metacarpal(hand: HumanHand, rotation: Array, abduction: Array) -> Array:
    """Return the direction of the thumb's metacarpal.

    Args:
        hand: Sizes of the hand.
        rotation: Thumb rotation [rad], of shape (...).
        abduction: Thumb abduction [rad], of shape (...).

    Returns:
        Unit vectors, palm frame, of shape (..., 3).
    """
    cosine, sine = np.cos(abduction), np.sin(abduction)
    local = np.stack([cosine, sine * np.cos(rotation), sine * np.sin(rotation)], axis=-1)
    return local @ hand.thumb_frame.T


def thumb_from_carpometacarpal(rest: tuple[float, float], flexion: Array, abduction: Array) -> tuple[Array, Array]:
    """Turn flexion and palmar abduction of the thumb's base into Santello's rotation and abduction.

    Flexion moves the metacarpal towards the little finger parallel to the palm, palmar abduction away from the
    palm: longitude and latitude, where [Santello1998] has the polar angles about the axis to the index MCP.

    Args:
        rest: Santello's (rotation, abduction) [rad] where flexion and palmar abduction are counted from.
        flexion: Flexion from there [rad], of shape (...).
        abduction: Palmar abduction from there [rad], of shape (...).

    Returns:
        Rotation and abduction [rad], each of shape (...).
    """
    rotation, polar = rest
    latitude = np.arcsin(np.sin(polar) * np.sin(rotation)) + abduction
    longitude = np.arctan2(np.sin(polar) * np.cos(rotation), np.cos(polar)) - flexion
    axial, radial = np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude)
    return np.arctan2(np.sin(latitude), radial), np.arccos(np.clip(axial, -1.0, 1.0))


def _thumb(hand: HumanHand, angles: Array) -> tuple[Array, Array]:
    """Return tip and pulp normal of the thumb, each of shape (..., 3)."""
    rotation, mcp, ip, abduction = (angles[..., k] for k in range(4))
    axis, radial, palmar = hand.thumb_frame.T
    metacarpal = thumb_metacarpal(hand, rotation, abduction)
    outwards = np.cos(rotation)[..., None] * radial + np.sin(rotation)[..., None] * palmar
    # Flexion turns the metacarpal's direction towards the axis; pronation turns that hinge about the metacarpal.
    hinge = _rotate(np.cross(outwards, axis), metacarpal, np.asarray(hand.thumb_pronation))
    proximal = _rotate(metacarpal, hinge, mcp)
    distal = _rotate(metacarpal, hinge, mcp + ip)
    segments = hand.length * _THUMB_SEGMENTS
    tip = hand.thumb_base + segments[0] * metacarpal + segments[1] * proximal + segments[2] * distal
    return tip, np.cross(hinge, distal)


def _four_fingers(hand: HumanHand, angles: Array) -> tuple[Array, Array]:
    """Return tips and pulp normals of index, middle, ring and little finger, each of shape (..., 4, 3)."""
    index_middle, middle_ring, ring_little = (angles[..., k] for k in range(4, 7))
    # The middle finger is the reference; + is towards the thumb's side.
    side = np.stack([index_middle, np.zeros_like(index_middle), -middle_ring, -middle_ring - ring_little], axis=-1)
    mcp, pip = angles[..., 7:11], angles[..., 11:15]
    flexion = np.stack([mcp, mcp + pip, mcp + (1.0 + _DIP_OF_PIP) * pip], axis=-1)
    phalanges = hand.length * _PHALANGES
    forwards = (phalanges * np.sin(flexion)).sum(axis=-1)
    along = (phalanges * np.cos(flexion)).sum(axis=-1)
    tips = hand.finger_bases + np.stack([forwards, along * np.sin(side), along * np.cos(side)], axis=-1)
    last = flexion[..., -1]
    pulps = np.stack([np.cos(last), -np.sin(last) * np.sin(side), -np.sin(last) * np.cos(side)], axis=-1)
    return tips, pulps


def _rotate(vectors: Array, axes: Array, angles: Array) -> Array:
    """Turn vectors about unit axes (Rodrigues' formula); shapes (..., 3), (..., 3), (...)."""
    hat = skew(axes)
    once = (hat @ vectors[..., None])[..., 0]
    twice = (hat @ once[..., None])[..., 0]
    return vectors + np.sin(angles)[..., None] * once + (1.0 - np.cos(angles))[..., None] * twice
