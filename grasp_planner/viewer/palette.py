"""The commands of the palette (Ctrl/Cmd + K) with their keys."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import viser

Action = Callable[[], None]


def add_commands(
    gui: viser.GuiApi, later: Callable[[Action], None], commands: Sequence[tuple[str, Any, Action]]
) -> None:
    """Add commands.

    Args:
        gui: The widgets of the page.
        later: Has the worker do something.
        commands: Name, key and what to do of each.
    """
    for label, key, action in commands:
        gui.add_command(label, hotkey=key).on_trigger(partial(_trigger, later, action))


def _trigger(later: Callable[[Action], None], action: Action, _: Any) -> None:
    """Do what a command says."""
    later(action)
