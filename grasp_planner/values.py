"""Values: frozen dataclasses that compare and hash by content, print in one line and hold only what can't change."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields
from functools import cached_property
from typing import Any

import numpy as np

LONGEST_PRINT = 250
"""Most characters that a value is printed with …"""
LONGEST_PART = 60
"""… and one of its fields."""
SHOWN_NUMBERS = 6
"""Most numbers of an array, and most entries of a tuple, that are printed; of more only the shape or the first."""
PLAIN = frozenset({str, int, float, bool, type(None)})
"""Kinds of fields that can't be changed anyway."""
_NAMES: dict[type, tuple[str, ...]] = {}
PLAIN_POWER = 5
"""Largest power of ten that people read in plain digits."""
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Value:
    """Base of frozen dataclasses that are values; use it with ``@dataclass(frozen=True, eq=False, repr=False)``.

    Two are equal if they are of one class and all their fields that are compared have the same content; arrays
    count by shape and numbers, 0 and −0 being one. Lists and arrays are copied when given, arrays are read-only.
    A pickle holds the fields and not what was computed from them.
    """

    def __post_init__(self) -> None:
        own = self.__dict__
        for name in _names(type(self)):
            if type(own[name]) not in PLAIN:
                own[name] = _frozen(own[name])

    def _content(self) -> dict[str, Any]:
        """Return what makes two of them equal, by name: the fields that are compared."""
        return {field.name: getattr(self, field.name) for field in _fields(type(self)) if field.compare}

    def _shown(self) -> dict[str, Any]:
        """Return what is printed, by name: the fields that are printed and have no default or another value."""
        values = {field.name: getattr(self, field.name) for field in _fields(type(self)) if field.repr}
        return {name: value for name, value in values.items() if not _is_default(self, name, value)}

    @cached_property
    def _key(self) -> tuple[Any, ...]:
        """The content in a form that compares and hashes."""
        return tuple((name, _comparable(value)) for name, value in self._content().items())

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if type(self) is not type(other):
            return NotImplemented
        return self._key == other._key

    def __hash__(self) -> int:
        return hash((type(self).__name__, self._key))

    def __repr__(self) -> str:
        parts = (f"{name}={clipped(_printed(value), LONGEST_PART)}" for name, value in self._shown().items())
        return f"{type(self).__name__}({clipped(', '.join(parts), LONGEST_PRINT)})"

    def __getstate__(self) -> dict[str, Any]:
        return _own(self)

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)
        self.__dict__.update(state)


def clipped(text: str, length: int) -> str:
    """Return a text in one line of at most a length, its end left out if it is longer."""
    line = " ".join(text.split())
    return line if len(line) <= length else f"{line[: length - 1]}…"


def exact_text(number: float) -> str:
    """Return the shortest text of twelve digits that reads back as the number, or all digits it takes."""
    number = float(number)
    text = f"{number:.12g}"
    return text if float(text) == number else repr(number)


def number_text(value: float, digits: int = 3) -> str:
    """Return a number as people write it, such as 2420 or 1.1·10⁻⁵: ∞ where infinite, – where undefined.

    Args:
        value: The number.
        digits: How many of its digits count.
    """
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    mantissa, _, power = f"{value + 0.0:.{digits}g}".partition("e")  # −0 + 0 is 0
    if power and 0 < int(power) <= PLAIN_POWER:
        mantissa, power = f"{float(f'{mantissa}e{power}'):.0f}", ""
    return mantissa.replace("-", "−") + (f"·10{str(int(power)).translate(RAISED)}" if power else "")


def _fields(kind: type[Value]) -> tuple[Field[Any], ...]:
    """Return the dataclass fields of a class of values."""
    return fields(kind)  # type: ignore[arg-type]  # every value is a dataclass


def _names(kind: type[Value]) -> tuple[str, ...]:
    """Return the names of the fields of a class of values, found once: values are made by the hundred."""
    if kind not in _NAMES:
        _NAMES[kind] = tuple(field.name for field in _fields(kind))
    return _NAMES[kind]


def _own(value: Value) -> dict[str, Any]:
    """Return the fields of a value by name."""
    return {name: getattr(value, name) for name in _names(type(value))}


def _is_default(owner: Value, name: str, value: object) -> bool:
    """Return whether a field of an owner holds its default."""
    field = next(field for field in _fields(type(owner)) if field.name == name)
    if field.default_factory is not MISSING:
        return bool(_comparable(field.default_factory()) == _comparable(value))
    return field.default is not MISSING and bool(_comparable(field.default) == _comparable(value))


def _frozen(value: Any) -> Any:
    """Return a read-only copy of an array, a tuple of a list, the value itself of anything else."""
    if isinstance(value, np.ndarray):
        copy = np.array(value)
        copy.setflags(write=False)
        return copy
    if isinstance(value, list | tuple):
        entries = tuple(_frozen(entry) for entry in value)
        same = isinstance(value, tuple) and all(a is b for a, b in zip(entries, value, strict=True))
        return value if same else entries
    return value


def _comparable(value: Any) -> Any:
    """Return the content of a field in a form that compares and hashes."""
    if isinstance(value, np.ndarray):
        return value.shape, (value + 0).tobytes()  # −0 + 0 is 0
    if isinstance(value, list | tuple):
        return tuple(_comparable(entry) for entry in value)
    if isinstance(value, Mapping):
        return tuple((key, _comparable(entry)) for key, entry in value.items())
    return value


def _printed(value: Any) -> str:
    """Return the text of a field."""
    if isinstance(value, np.ndarray):
        if value.size > SHOWN_NUMBERS:
            return f"<{' × '.join(map(str, value.shape))}>"
        return str([float(f"{number:.4g}") for number in value.ravel().tolist()])
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        entries = [_printed(entry) for entry in value[:SHOWN_NUMBERS]]
        more = [f"… {len(value)} in all"] if len(value) > SHOWN_NUMBERS else []
        return f"({', '.join([*entries, *more])}{',' if len(value) == 1 else ''})"
    return repr(value)
