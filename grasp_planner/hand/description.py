"""The declarative description of a hand: the TOML file that says what a URDF cannot.

It names the palm and its normal, the independent joints, the contact frames with their fingertip radii,
default compliances, the order of the fingers for Remark 1 of [Mavrogiannis2014] and the synergy sets.
"""

from __future__ import annotations

import contextlib
import tomllib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..exceptions import FileFormatError, NameNotFoundError, shown
from ..files.text import read_text_file

MAX_DESCRIPTION_BYTES = 1_000_000
"""Largest description file that is read."""

PACKAGE_FOLDER = Path(__file__).parents[1]

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Vector3 = tuple[Finite, Finite, Finite]


class _Strict(BaseModel):
    """Frozen model that refuses keys it does not know."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class PalmDescription(_Strict):
    """The palm frame P."""

    link: str
    """URDF link whose frame is P; it has to be fixed to the root of the URDF."""
    normal: Vector3
    """Direction out of the palm, in P."""
    closing_axis: Vector3
    """Axis the fingers close around, in P; a long object lies along it."""
    grasp_centre: Vector3
    """Where the middle of a grasped object sits, in P [m]."""


class FingerOrder(_Strict):
    """Remark 1 of [Mavrogiannis2014]: the abduction joints of the fingers opposed to the thumb."""

    abduction_order: tuple[str, ...] = Field(min_length=2)
    sign: Literal[-1, 1] = 1
    """+1 if the abduction angle has to grow along the order, -1 if it has to fall."""


class ComplianceDescription(_Strict):
    """Default compliances of the hand and stiffness of its contacts."""

    joint: NonNegative | dict[str, NonNegative] | tuple[tuple[Finite, ...], ...] = 0.1
    """C_q [rad/(N m)], of joints that slide [m/N]: one number, one for every independent joint by its name, or the rows
    of a symmetric positive definite matrix in the order of the joints."""
    structural: Positive = 0.1
    """C_s [m/N]."""
    contact_stiffness: NonNegative = 1e5
    """K_c [N/m]."""


class TendonDescription(_Strict):
    """A motor that pulls a tendon, or turns joints, by force."""

    arms: dict[str, Finite] = Field(min_length=1)
    """Moment arm of the tendon about every joint it passes [m]; of a motor that turns a joint itself, 1."""
    limit: Positive | None = None
    """Largest tension [N], or torque of a motor that turns a joint [N m]; no limit if left out."""
    two_way: bool = False
    """Whether it pushes as well as it pulls; a tendon only pulls."""


class TendonsDescription(_Strict):
    """Tendons of a hand, pulled by force against the springs that ``compliance.joint`` describes."""

    motors: dict[str, TendonDescription] = Field(min_length=1)
    """The motors by name; the first n are those of n synergies of the set ``tendons``."""
    rest: dict[str, Finite] = Field(default_factory=dict)
    """Posture of the springs without tension [rad]; 0 for a joint that is left out."""
    hold: Literal["length", "tension"] = "length"
    """What a motor keeps against a disturbance: its tendon's length, as geared motors do, or its tension."""


class LimitDescription(_Strict):
    """What the hand can bear beyond the joint limits of its URDF."""

    normal_force: Positive | None = None
    """Largest normal force of a contact [N]; no limit if left out."""


class PatchDescription(_Strict):
    """How far a link may turn on an object until its surface is no longer the ball of its contact."""

    across: Vector3
    """Axis that the finger closes about, in the frame of the contact."""
    bend: Annotated[float, Field(gt=0.0, lt=1.5, allow_inf_nan=False)]
    """Largest angle about that axis between the contact's normal and the link's [rad]."""
    side: Annotated[float, Field(gt=0.0, lt=1.5, allow_inf_nan=False)]
    """Largest angle out of the plane across it [rad]."""


class ContactDescription(_Strict):
    """One contact of the hand: a point fixed to a URDF frame and the radius of the fingertip or link around it."""

    frame: str
    radius: NonNegative = 0.0
    """Fingertip radius [m]; 0 is the point fingertip of [Mavrogiannis2014]."""
    offset: Vector3 = (0.0, 0.0, 0.0)
    """Where the point sits in the frame [m]."""
    normal: Vector3 | None = None
    """Outward normal of the link's surface where it touches, in the frame: the link lies behind that plane."""
    patch: PatchDescription | None = None
    """Around the normal, where the ball is the link's surface to 0.2 mm; without it the ball may touch anywhere."""


class SynergyFiles(_Strict):
    """Named synergy sets; paths are relative to the description file."""

    default: str | None = None
    """One of the sets, ``tendons`` for a hand that has them, or ``motors`` or ``closing``, which every hand has."""
    with_clearance: str | None = None
    """The default where links have to keep clear of the object and of each other."""
    sets: dict[str, str] = Field(default_factory=dict)

    def default_for(self, clearance: bool) -> str | None:
        """Return the default set, where links have to keep clear or not; None if there is none."""
        return (self.with_clearance if clearance else None) or self.default


class CollisionDescription(_Strict):
    """Which links are never checked against each other."""

    ignore: tuple[tuple[str, str], ...] = ()


class CouplingDescription(_Strict):
    """How a joint follows another: by a factor, or by a table that is taken as the line closest to it."""

    joint: str
    """Joint that it follows."""
    ratio: Finite = 1.0
    """Its angle by that joint's; not 0."""
    offset: Finite = 0.0
    """Its angle where that joint is at 0 [rad or m]."""
    table: tuple[tuple[Finite, Finite], ...] = ()
    """Pairs of the other joint's angle and its own, as measured or of a four-bar; instead of ratio and offset."""


class HandDescription(_Strict):
    """Everything the description file says."""

    name: str = Field(min_length=1)
    title: str = ""
    urdf: str
    """URDF file, relative to the description file, or ``example-robot-data:robots/…`` within that package."""
    joints: tuple[str, ...] = Field(min_length=1)
    """Independent joints in the order of q; the others mimic one of these."""
    locked: dict[str, Finite] = Field(default_factory=dict)
    """Joints of the URDF that are fixed, with their values [rad or m]: a wrist or an arm before the palm."""
    couplings: dict[str, CouplingDescription | Literal["free", "fixed"]] = Field(default_factory=dict)
    """What joints follow, in place of their <mimic>: another joint, none (``free``), or they stay still (``fixed``)."""
    palm: PalmDescription
    remark1: FingerOrder | None = None
    compliance: ComplianceDescription = ComplianceDescription()
    limits: LimitDescription = LimitDescription()
    tendons: TendonsDescription | None = None
    contact_sets: dict[str, dict[str, ContactDescription]] = Field(default_factory=dict)
    """Contact sets by name, each with named contacts in order; the first set is the default."""
    contact_set_with_clearance: str | None = None
    """The default where links keep clear by their real geometry, which point fingertips do not have."""
    grasp_centres: dict[str, Vector3] = Field(default_factory=dict)
    """Where the middle of an object sits in P [m], for contact sets that hold it elsewhere than the palm says."""
    synergies: SynergyFiles = SynergyFiles()
    collision: CollisionDescription = CollisionDescription()

    def default_contact_set(self, clearance: bool) -> str | None:
        """Return the name of the contact set of a problem that names none; None for a hand without sets.

        Args:
            clearance: Whether links keep clear by their real geometry.
        """
        clear = self.contact_set_with_clearance if clearance else None
        return clear or next(iter(self.contact_sets), None)


def read_hand_description(path: Path) -> HandDescription:
    """Read and check a hand description.

    Args:
        path: TOML file.

    Returns:
        The description.

    Raises:
        FileFormatError: If the file can't be read, is no TOML or breaks the layout; the reason names the key.
    """
    text = read_text_file(path, MAX_DESCRIPTION_BYTES)
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FileFormatError(path, f"is not valid TOML: {error}") from None
    try:
        return HandDescription.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise FileFormatError(path, f"key {shown(key)}: {first['msg']} (got {shown(first['input'])})") from None


def hand_library() -> dict[str, Path]:
    """Return the hands that come with the package.

    Returns:
        Description file of each hand by name, sorted.
    """
    installed = PACKAGE_FOLDER / "urdf"
    root = installed if installed.is_dir() else PACKAGE_FOLDER.parent / "urdf"
    return {path.stem: path for path in sorted(root.glob("*/*.toml"))}


def find_hand(name_or_path: str | Path) -> Path:
    """Return the description file of a hand.

    Args:
        name_or_path: Name of a hand of the package, or path of a description file or a URDF.

    Returns:
        Path of the file.

    Raises:
        NameNotFoundError: If it is neither; lists the hands that exist.
        FileFormatError: If it looks like a path and there is no such file.
    """
    library = hand_library()
    text = str(name_or_path)
    if text in library:
        return library[text]
    path = Path(name_or_path)
    with contextlib.suppress(OSError):  # a text too long for a name of a file
        if path.is_file():
            return path
    if isinstance(name_or_path, Path) or path.suffix or len(path.parts) > 1:
        raise FileFormatError(path, "no such hand description file or URDF")
    raise NameNotFoundError("hand", text, library)
