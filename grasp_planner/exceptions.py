"""Errors: one tree, each carrying the evidence of what was wrong and what would be allowed."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path


class GraspPlannerError(Exception):
    """Base class of every error raised on purpose by this package."""


class InvalidValueError(GraspPlannerError, ValueError):
    """A value lies outside what its field allows.

    Attributes:
        field: Name of the field or argument.
        value: The value given.
        allowed: What would be allowed, in words.
    """

    def __init__(self, field: str, value: object, allowed: str) -> None:
        self.field = field
        self.value = value
        self.allowed = allowed
        super().__init__(f"{field}: got {value!r}, allowed: {allowed}")

    def __reduce__(self) -> tuple[type, tuple[str, object, str]]:
        return type(self), (self.field, self.value, self.allowed)


class NameNotFoundError(GraspPlannerError, LookupError):
    """A name (hand, frame, joint, synergy set, …) does not exist.

    Attributes:
        kind: What kind of thing was looked up.
        name: The name that was not found.
        known: The names that exist.
    """

    def __init__(self, kind: str, name: str, known: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.known = tuple(known)
        close = difflib.get_close_matches(name, self.known, n=1)
        hint = f" (did you mean {close[0]!r}?)" if close else ""
        super().__init__(f"unknown {kind} {name!r}{hint}; existing: {', '.join(self.known) or 'none'}")

    def __reduce__(self) -> tuple[type, tuple[str, str, tuple[str, ...]]]:
        return type(self), (self.kind, self.name, self.known)


class FileFormatError(GraspPlannerError):
    """A file can't be read or does not say what it should.

    Attributes:
        path: The file.
        reason: What is wrong, in one line.
    """

    def __init__(self, path: Path | str, reason: str) -> None:
        self.path = Path(path)
        self.reason = reason
        super().__init__(f"{self.path}: {reason}")

    def __reduce__(self) -> tuple[type, tuple[Path, str]]:
        return type(self), (self.path, self.reason)
