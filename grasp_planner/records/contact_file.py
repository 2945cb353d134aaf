"""Contacts from elsewhere as JSON: points and normals, and what is known of forces, hand and stiffness."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, ValidationError

from ..analysis.measured_contacts import ContactSet
from ..exceptions import FileFormatError, InvalidValueError, NameNotFoundError, shown
from ..files.text import read_text_file
from ..model.contact_model import ContactModel, parse_contact_model
from ..model.mixed_contacts import MixedContacts
from ..model.quasi_static import CompliantGrasp, compliant_grasp
from ..spatial import Array
from .layout import Record

MAX_BYTES = 10_000_000
LARGEST = 1e6
"""Largest coordinate [m], force [N] and moment [N m]; of J [m/rad], whose entries are lever arms; of S."""
LEAST_FRICTION, MOST_FRICTION = 1e-6, 1e3
SOFTEST, STIFFEST = 1e-6, 1e12
"""Stiffness of a contact [N/m], joint or motor [N m/rad]: up to what the package's own parameter allows, and down to
where a newton moves a contact by as much as the largest coordinate."""
WORST_CONDITION = 1e10
"""Ratio of the stiffest to the softest direction of a stiffness: of sixteen digits six are left, four are printed."""
NO_DISTANCE = 1e-9
"""Distance below which a contact is at the centre [m]."""
UNIT_TOLERANCE = 1e-3
"""How far a normal may be from unit length."""
Rows = list[list[float]]
Stiffness = float | list[float] | Rows


class ContactFile(Record):
    """A plain file of contacts; SI units, one frame."""

    points: list[tuple[float, float, float]] = Field(min_length=1, description="contact points [m]")
    normals: list[tuple[float, float, float]] = Field(description="unit normals into the object")
    friction: float | list[float] = Field(description="coefficient of friction, one number or one for each contact")
    centre: tuple[float, float, float] = Field(default=(0.0, 0.0, 0.0), description="centre of mass [m]")
    contact_model: str | list[str] = Field(
        default="hard", description="hard, soft:torsion=0.003 or frictionless; one for all or one for each contact"
    )
    forces: Rows | None = Field(default=None, description="on the object [N], three numbers, or d intensities, each")
    wrench: tuple[float, float, float, float, float, float] | None = Field(
        default=None, description="external wrench about the centre [N, N m]"
    )
    tasks: list[tuple[float, float, float, float, float, float]] | None = Field(
        default=None, min_length=1, description="wrenches about the centre that the hand is to exert [N, N m]"
    )
    J: Rows | None = Field(default=None, description="hand Jacobian, d rows a contact, d = 3 for hard fingers")
    S: Rows | None = Field(default=None, description="synergies, n_q rows; the identity if left out")
    contact_stiffness: Stiffness | None = Field(default=None, description="number, diagonal or matrix")
    joint_stiffness: Stiffness | None = None
    synergy_stiffness: Stiffness | None = None


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
    centre = np.array(found.centre)
    for name in ("points", "centre", "forces", "wrench", "tasks"):
        _check_size(name, getattr(found, name))
    if np.abs(points - centre).max() < NO_DISTANCE:
        raise InvalidValueError("points", points.tolist(), "not all at the centre of mass")
    own = _models(found.contact_model, len(points))
    model = own[0] if len(set(own)) == 1 else MixedContacts(own)
    wrench = None if found.wrench is None else np.array(found.wrench)
    tasks = None if found.tasks is None else np.array(found.tasks)
    if tasks is not None and not tasks.any(axis=1).all():
        raise InvalidValueError("tasks", tasks.tolist(), "none of them zero")
    return ContactSet(
        points,
        normals,
        _friction(found.friction, own),
        centre,
        _forces(found.forces, own, model),
        wrench,
        _springs(found, points - centre, normals, model),
        model,
        tasks=tasks,
    )


def _models(given: str | list[str], count: int) -> tuple[ContactModel, ...]:
    """Return the model of every contact."""
    texts = [given] * count if isinstance(given, str) else given
    if len(texts) != count:
        raise InvalidValueError("contact_model", f"{len(texts)} of them", f"one, or one for each of the {count} points")
    return tuple(parse_contact_model(text) for text in texts)


def _friction(given: float | list[float], own: Sequence[ContactModel]) -> Array:
    """Return μ of every contact; 1 where there is none, as any μ > 0 says that such a contact presses."""
    values = np.array(given, dtype=float)
    if values.shape not in ((), (len(own),)):
        raise InvalidValueError("friction", f"{len(values)} of them", f"one, or one for each of the {len(own)} points")
    if not ((values >= LEAST_FRICTION) & (values <= MOST_FRICTION)).all():
        raise InvalidValueError("friction", given, f"{LEAST_FRICTION:g} to {MOST_FRICTION:g}")
    return np.where([model.has_friction for model in own], values, 1.0)


def _forces(rows: Rows | None, own: Sequence[ContactModel], model: ContactModel) -> Array | None:
    """Return the forces or intensities, behind those of a contact's own model zeros where models differ."""
    if rows is None:
        return None
    forces = np.zeros((len(own), model.dimension))
    for i, (row, each) in enumerate(zip(rows, own, strict=True)):
        if len(row) != each.dimension:
            raise InvalidValueError(f"forces.{i}", f"{len(row)} numbers", f"{each.dimension} for {each.text}")
        forces[i, : len(row)] = row
    return forces


def _springs(found: ContactFile, points: Array, normals: Array, model: ContactModel) -> CompliantGrasp | None:
    """Return hand and stiffnesses, where J is given."""
    if found.J is None:
        return None
    if found.contact_stiffness is None and found.joint_stiffness is None:
        raise InvalidValueError("contact_stiffness", "missing", "given where J is, or joint_stiffness")
    jacobian = _matrix("J", found.J)
    basis = np.eye(jacobian.shape[1]) if found.S is None else _matrix("S", found.S)
    grasp = model.grasp_matrix(points, normals)
    stiffnesses = {name: getattr(found, name) for name in ("contact_stiffness", "joint_stiffness", "synergy_stiffness")}
    for name, value in stiffnesses.items():
        _check_stiffness(name, value)
    return compliant_grasp(
        grasp[:, model.used] if isinstance(model, MixedContacts) else grasp, jacobian, basis, **stiffnesses
    )


def _check_size(name: str, values: Sequence[Any] | None) -> None:
    """Refuse numbers, in rows of any length, that are too large."""
    if values is not None and any(not abs(value) <= LARGEST for value in np.hstack([*values]).ravel()):
        raise InvalidValueError(name, values, f"numbers up to {LARGEST:g} in size")


def _check_stiffness(name: str, given: Stiffness | None) -> None:
    """Refuse stiffnesses that are no springs, or of which rounding leaves nothing."""
    if given is None:
        return
    values = np.array(given) if isinstance(given, float) else _table(name, given)
    diagonal = np.diag(values) if values.ndim == 2 else np.atleast_1d(values)
    if not diagonal.size or not ((diagonal >= SOFTEST) & (diagonal <= STIFFEST)).all():
        raise InvalidValueError(name, given, f"{SOFTEST:g} to {STIFFEST:g}")
    worst = np.linalg.cond(values) if values.ndim == 2 else diagonal.max() / diagonal.min()
    if not worst <= WORST_CONDITION:
        raise InvalidValueError(name, given, f"at most {WORST_CONDITION:g} times as stiff one way as another")


def _matrix(name: str, rows: Rows) -> Array:
    """Return rows of numbers as a matrix."""
    found = _table(name, rows)
    if found.ndim != 2:
        raise InvalidValueError(name, rows, "rows of one length")
    _check_size(name, rows)
    return found


def _table(name: str, given: list[float] | Rows) -> Array:
    """Return a list of numbers, or of rows of them, as an array."""
    lengths = {len(each) if isinstance(each, list) else -1 for each in given}
    if len(lengths) != 1 or 0 in lengths:
        raise InvalidValueError(name, given, "rows of one length")
    return np.array(given, dtype=float)
