"""Values of widgets as a page sends them, made to fit."""

from __future__ import annotations

import math
from typing import Any

MAX_TEXT = 2000
"""Longest text a widget accepts."""


def in_bounds(handle: Any, value: Any) -> Any:
    """Return the value for a widget, made to fit: numbers within its range, texts not too long.

    Args:
        handle: The widget.
        value: What the page sent.

    Raises:
        TypeError, ValueError: If it is not such a value at all.
    """
    present = handle.value
    if isinstance(present, bool):
        if not isinstance(value, bool):
            raise TypeError(value)
        return value
    if isinstance(present, int | float):
        return _number(value, getattr(handle, "min", None), getattr(handle, "max", None))
    if isinstance(present, tuple):
        if not isinstance(value, list | tuple) or len(value) != len(present):
            raise ValueError(value)
        low, high = getattr(handle, "min", None), getattr(handle, "max", None)
        return tuple(
            _number(entry, low[i] if low is not None else None, high[i] if high is not None else None)
            for i, entry in enumerate(value)
        )
    if isinstance(present, str):
        if not isinstance(value, str):
            raise TypeError(value)
        options = getattr(handle, "options", None)
        if options is not None and value not in options:
            raise ValueError(value)
        return value[:MAX_TEXT]
    raise TypeError(type(present))


def _number(value: Any, low: float | None, high: float | None) -> float:
    """Return a finite number within a range."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(value)
    value = max(value, -1e12 if low is None else low)
    return min(value, 1e12 if high is None else high)
