"""The text form of objects: ``shape:key=value,…``, and for meshes ``mesh:file.stl,key=value,…``."""

from __future__ import annotations

import re
from typing import Any

from ..exceptions import InvalidValueError, NameNotFoundError
from .base import GraspObject
from .ellipsoid import EllipsoidObject
from .mesh_object import MeshObject
from .primitives import Box, Capsule, Cylinder, Sphere

SHAPES: dict[str, type[GraspObject]] = {
    shape.kind: shape for shape in (Sphere, Cylinder, Box, Capsule, EllipsoidObject, MeshObject)
}
"""Shapes by the name used in the text form."""


_NEXT = re.compile(r",(?=\s*[A-Za-z_-]+\s*=)")
"""Commas before a key; others are within a list of numbers, or a file's name."""
_LISTS, _WORDS = ("com", "densities"), ("path", "up", "region", "forbid")
"""Keys whose value is a list of numbers, or a text."""


def parse_object(text: str) -> GraspObject:
    """Return the object of a text such as ``cylinder:radius=0.03,height=0.15`` or ``mesh:mug.stl,scale=0.001``.

    Args:
        text: Shape name, optionally followed by a colon and comma-separated ``key=value`` pairs in SI units; for
            a mesh the first entry is the file.

    Returns:
        The object; keys left out have their defaults.

    Raises:
        NameNotFoundError: If the shape or a key does not exist.
        InvalidValueError: If a value is not a positive number, or a key is given twice.
        FileFormatError: If a mesh can't be read or is no solid.
    """
    kind, _, rest = text.strip().partition(":")
    if kind not in SHAPES:
        raise NameNotFoundError("object shape", kind, SHAPES)
    shape = SHAPES[kind]
    known = shape.text_keys()
    values: dict[str, Any] = {}
    for number, part in enumerate(filter(None, _NEXT.split(rest.rstrip(",")))):
        key, equals, value = (piece.strip() for piece in part.partition("="))
        key = key.replace("-", "_")
        if "path" in known and number == 0 and key not in known:
            key, equals, value = "path", "=", part.strip()
        if not equals:
            raise InvalidValueError(f"object {kind}", part, f"key=value with a key out of {', '.join(known)}")
        if key not in known:
            raise NameNotFoundError(f"key of object {kind}", key, known)
        if key in values:
            raise InvalidValueError(f"object {kind}.{key}", part, "a key given once")
        if key in _LISTS:
            values[key] = tuple(_number(kind, key, each) for each in value.split(","))
        else:
            values[key] = value if key in _WORDS else _number(kind, key, value)
    if "path" in known and "path" not in values:
        raise InvalidValueError(f"object {kind}", text, f"{kind}:FILE, for instance {kind}:mug.stl,scale=0.001")
    return shape.of_values(values)


def _number(kind: str, key: str, text: str) -> float:
    """Return the number of an entry."""
    try:
        return float(text)
    except ValueError:
        raise InvalidValueError(f"object {kind}.{key}", text, "a number in SI units") from None
