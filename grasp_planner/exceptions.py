"""Errors: one tree, each carrying the evidence of what was wrong and what would be allowed."""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable
from pathlib import Path

MAX_VALUE = 80
"""Characters of a value that a message shows."""
MAX_PATH = 160
"""Characters of a path that a message shows, its end."""
MAX_MESSAGE = 300
"""Characters of a message that the command line prints."""
_MOST_ENTRIES, _MOST_LEVELS = 20, 4


def cut(text: str, limit: int) -> str:
    """Return a text on one line, cut to a number of characters."""
    line = " ".join(text[: 4 * limit].split())
    return line if len(line) <= limit and len(text) <= 4 * limit else f"{line[: limit - 1]}…"


def shown(value: object) -> str:
    """Return a value as messages show it, cut to :data:`MAX_VALUE` characters however large it is."""
    short = reprlib.Repr()
    short.maxlevel = _MOST_LEVELS
    short.maxlist = short.maxtuple = short.maxdict = short.maxset = short.maxfrozenset = _MOST_ENTRIES
    short.maxlong = short.maxother = 2 * MAX_VALUE
    short.maxstring = MAX_VALUE
    try:
        text = repr(value[: MAX_VALUE + 1]) if isinstance(value, str) else short.repr(value)
    except ValueError:  # a whole number with thousands of digits has no text
        text = "a number of thousands of digits"
    return cut(text, MAX_VALUE)


def shown_path(path: Path | str) -> str:
    """Return a path as messages show it: of a long one the end, which says more."""
    text = str(path)
    return text if len(text) <= MAX_PATH else "…" + text[1 - MAX_PATH :]


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
        super().__init__(f"{cut(field, MAX_VALUE)}: got {shown(value)}, allowed: {allowed}")

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
        close = difflib.get_close_matches(name[:MAX_VALUE], self.known, n=1)
        hint = f" (did you mean {close[0]!r}?)" if close else ""
        super().__init__(f"unknown {kind} {shown(name)}{hint}; existing: {', '.join(self.known) or 'none'}")

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
        super().__init__(f"{shown_path(self.path)}: {reason}")

    def __reduce__(self) -> tuple[type, tuple[Path, str]]:
        return type(self), (self.path, self.reason)
