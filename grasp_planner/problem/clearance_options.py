"""Which collisions a planned grasp has to avoid: Remarks 1 and 2 of [Mavrogiannis2014] and what goes beyond them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from ..checks import positive
from ..exceptions import InvalidValueError, NameNotFoundError
from ..values import Value

LinkObjectMode = Literal["geometry", "joint_centres", "off"]
LINK_OBJECT_MODES: tuple[LinkObjectMode, ...] = ("geometry", "joint_centres", "off")


@dataclass(frozen=True, eq=False, repr=False)
class ClearanceOptions(Value):
    """What has to keep clear of what; everything is on unless switched off, the ground excepted.

    Attributes:
        link_object: Remark 2: the links' real ``geometry`` stays outside the object, only their ``joint_centres``
            do (the paper's own form), or ``off``.
        self_collision: Whether fingers keep clear of each other and of the palm.
        tip_patch: Whether a touching finger may touch with the end of its tip only: n·a ≥ 0 with n the contact
            normal into the object and a the axis of the last link towards its tip. A spherical fingertip that is
            the end cap of its link's capsule then keeps the whole link outside a convex object.
        remark1: Whether the abduction angles of the fingers keep their order (Remark 1).
        margin: Distance kept by everything that must not touch [m].
        ground: Height of a half-space no link may enter, along the direction opposite to gravity in O [m];
            None for no ground.
    """

    link_object: LinkObjectMode = "geometry"
    self_collision: bool = True
    tip_patch: bool = True
    remark1: bool = True
    margin: float = 5e-4
    ground: float | None = None

    def __post_init__(self) -> None:
        if self.link_object not in LINK_OBJECT_MODES:
            raise NameNotFoundError("link_object mode", str(self.link_object), LINK_OBJECT_MODES)
        for name in ("self_collision", "tip_patch", "remark1"):
            if not isinstance(getattr(self, name), bool):
                raise InvalidValueError(f"clearance {name}", getattr(self, name), "true or false")
        if positive("clearance margin", self.margin, zero_allowed=True, unit="m") > 0.05:
            raise InvalidValueError("clearance margin", self.margin, "at most 0.05 m")
        if self.ground is not None and not math.isfinite(self.ground):
            raise InvalidValueError("clearance ground", self.ground, "a finite height [m], or None")

    @classmethod
    def off(cls) -> ClearanceOptions:
        """Return the options of the paper's plain problem (29)–(32): nothing is avoided."""
        return cls(link_object="off", self_collision=False, tip_patch=False, remark1=False)

    @property
    def needs_geometry(self) -> bool:
        """Whether anything beyond the abduction order is asked for."""
        return self.link_object != "off" or self.self_collision or self.tip_patch or self.ground is not None
