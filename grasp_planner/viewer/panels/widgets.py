"""Small helpers around widgets."""

from __future__ import annotations

from typing import Any


def set_value(widget: Any, value: Any) -> None:
    """Show a value in a widget, if it is another one; callbacks run in the caller's thread."""
    if widget.value != value:
        widget.value = value
