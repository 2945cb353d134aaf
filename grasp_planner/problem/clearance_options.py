"""Which collisions a planned grasp has to avoid: Remarks 1 and 2 of [Mavrogiannis2014] and what goes beyond them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from ..exceptions import NameNotFoundError
from ..values import Value
from .settings import check_settings, setting

LinkObjectMode = Literal["geometry", "joint_centres", "off"]
LINK_OBJECT_MODES: tuple[LinkObjectMode, ...] = ("geometry", "joint_centres", "off")
CLEARANCES = ("links", "joint_centres", "none")
"""Ready-made options: links of the object and of each other; joint centres of the object, the paper's own; nothing."""


@dataclass(frozen=True, eq=False, repr=False)
class ClearanceOptions(Value):
    """What has to keep clear of what; everything is on unless switched off, Remark 1 and the ground excepted.

    Attributes:
        link_object: Remark 2: the links' real ``geometry`` stays outside the object, only their ``joint_centres``
            do (the paper's own form), or ``off``.
        self_collision: Whether fingers keep clear of each other and of the palm.
        tip_patch: Whether a touching finger may touch with the end of its tip only: n·a ≥ 0 with n the contact
            normal into the object and a the axis of the last link towards its tip. A spherical fingertip that is
            the end cap of its link's capsule then keeps the whole link outside a convex object.
        remark1: Whether the abduction angles of the fingers keep their order (Remark 1), the paper's stand-in for
            fingers that keep clear of each other: it forbids them to come nearer towards their tips, which small
            objects ask for.
        margin: Distance kept by everything that must not touch [m].
        ground: Height of a half-space no link may enter, along the direction opposite to gravity in O [m];
            None for no ground.
    """

    settings_group: ClassVar[str] = "clearance."

    link_object: LinkObjectMode = setting(
        "geometry",
        "Remark 2: what keeps clear of the object, the links' real geometry, their joint centres only, or nothing.",
        choices=LINK_OBJECT_MODES,
    )
    self_collision: bool = setting(True, "Whether fingers keep clear of each other and of the palm.")
    tip_patch: bool = setting(True, "Whether a finger may touch with the end of its tip only.")
    remark1: bool = setting(False, "Remark 1: whether the abduction angles of the fingers keep their order.")
    margin: float = setting(
        5e-4,
        "Distance kept by everything that must not touch.",
        unit="m",
        low=0.0,
        high=0.05,
        step=1e-4,
        option="--clearance-margin",
    )
    ground: float | None = setting(
        None,
        "Height of a table no link may enter, opposite to gravity from the object's centre.",
        kind="number",
        unit="m",
        low=-10.0,
        high=10.0,
        none="no table",
    )

    def __post_init__(self) -> None:
        check_settings(self)

    @classmethod
    def named(cls, name: str) -> ClearanceOptions:
        """Return the options of one of :data:`CLEARANCES`.

        Raises:
            NameNotFoundError: If there is none of that name.
        """
        if name not in CLEARANCES:
            raise NameNotFoundError("clearance", str(name), CLEARANCES)
        if name == "none":
            return cls.off()
        return cls() if name == "links" else cls(link_object="joint_centres", remark1=True)

    @classmethod
    def off(cls) -> ClearanceOptions:
        """Return the options of the paper's plain problem (29)–(32): nothing is avoided."""
        return cls(link_object="off", self_collision=False, tip_patch=False)

    @property
    def needs_geometry(self) -> bool:
        """Whether anything beyond the abduction order is asked for."""
        return self.link_object != "off" or self.self_collision or self.tip_patch or self.ground is not None
