"""Contacts from elsewhere as JSON: points and normals, and what is known of forces, hand and stiffness."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from pydantic import Field, ValidationError

from ..analysis.measured_contacts import ContactSet
from ..exceptions import FileFormatError, InvalidValueError, NameNotFoundError, shown
from ..files.text import read_text_file
from ..model.contact_model import parse_contact_model
from ..model.quasi_static import compliant_grasp
from ..spatial import Array
from .layout import Record

MAX_BYTES = 10_000_000
LARGEST = 1e6
"""Largest coordinate [m], force [N] and moment [N m]."""
NO_DISTANCE = 1e-9
"""Distance below which a contact is at the centre [m]."""
UNIT_TOLERANCE = 1e-3
"""How far a normal may be from unit length."""
Rows = list[list[float]]


class ContactFile(Record):
    """A plain file of contacts; SI units, one frame."""

    points: list[tuple[float, float, float]] = Field(min_length=1, description="contact points [m]")
    normals: list[tuple[float, float, float]] = Field(description="unit normals into the object")
    friction: float = Field(ge=1e-6, le=1e3, description="coefficient of friction")
    centre: tuple[float, float, float] = Field(default=(0.0, 0.0, 0.0), description="centre of mass [m]")
    contact_model: str = Field(default="hard", description="hard, soft:torsion=0.003 or frictionless")
    forces: Rows | None = Field(default=None, description="on the object [N], three numbers, or d intensities, each")
    wrench: tuple[float, float, float, float, float, float] | None = Field(
        default=None, description="external wrench about the centre [N, N m]"
    )
    J: Rows | None = Field(default=None, description="hand Jacobian, d n_c rows, d = 3 for hard fingers")
    S: Rows | None = Field(default=None, description="synergies, n_q rows; the identity if left out")
    contact_stiffness: float | list[float] | Rows | None = Field(default=None, description="number, diagonal or matrix")
    joint_stiffness: float | list[float] | Rows | None = None
    synergy_stiffness: float | list[float] | Rows | None = None


def is_contact_file(path: Path) -> bool:
    """Return whether a file holds contacts and not a grasp of this package: a JSON object with the key ``points``."""
    try:
        content = json.loads(read_text_file(path, MAX_BYTES))
    except (FileFormatError, ValueError, RecursionError):
        return False
    return isinstance(content, dict) and "points" in content


def read_contact_file(path: Path) -> ContactSet:
    """Read contacts from elsewhere.

    Args:
        path: JSON file, see :class:`ContactFile`.

    Returns:
        The contacts.

    Raises:
        FileFormatError: If it can't be read or breaks the contract; the reason names the key.
    """
    try:
        found = ContactFile.model_validate_json(read_text_file(path, MAX_BYTES))
        return _contacts(found)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise FileFormatError(path, f"key {shown(key)}: {first['msg']}") from None
    except (InvalidValueError, NameNotFoundError) as error:
        raise FileFormatError(path, str(error)) from None


def _contacts(found: ContactFile) -> ContactSet:
    """Return the contacts of a file, checked for sizes."""
    points, normals = np.array(found.points), np.array(found.normals).reshape(-1, 3)
    for name, rows in (("normals", normals), ("forces", found.forces)):
        if rows is not None and len(rows) != len(points):
            raise InvalidValueError(name, f"{len(rows)} of them", f"one for each of the {len(points)} points")
    if (np.abs(np.linalg.norm(normals, axis=1) - 1.0) > UNIT_TOLERANCE).any():
        raise InvalidValueError("normals", normals.tolist(), "of length 1")
    centre, springs, model = np.array(found.centre), None, parse_contact_model(found.contact_model)
    for name, values in (("points", points), ("centre", centre), ("forces", found.forces), ("wrench", found.wrench)):
        if values is not None and any(abs(value) > LARGEST for value in np.hstack([*values]).ravel()):
            raise InvalidValueError(name, np.array(values).tolist(), f"numbers up to {LARGEST:g} in size")
    if np.abs(points - centre).max() < NO_DISTANCE:
        raise InvalidValueError("points", points.tolist(), "not all at the centre of mass")
    if found.J is not None:
        jacobian = _matrix("J", found.J)
        basis = np.eye(jacobian.shape[1]) if found.S is None else _matrix("S", found.S)
        springs = compliant_grasp(
            model.grasp_matrix(points - centre, normals),
            jacobian,
            basis,
            contact_stiffness=found.contact_stiffness,
            joint_stiffness=found.joint_stiffness,
            synergy_stiffness=found.synergy_stiffness,
        )
        if found.contact_stiffness is None and found.joint_stiffness is None:
            raise InvalidValueError("contact_stiffness", "missing", "given where J is, or joint_stiffness")
    forces = None if found.forces is None else _matrix("forces", found.forces)
    if forces is not None and forces.shape[1] != model.dimension:
        raise InvalidValueError("forces", f"{forces.shape[1]} numbers each", f"{model.dimension} for {model.text}")
    wrench = None if found.wrench is None else np.array(found.wrench)
    return ContactSet(points, normals, np.full(len(points), found.friction), centre, forces, wrench, springs, model)


def _matrix(name: str, rows: Rows) -> Array:
    """Return rows of numbers as a matrix."""
    if not rows or len({len(row) for row in rows}) != 1 or not rows[0]:
        raise InvalidValueError(name, rows, "rows of one length")
    return np.array(rows)
