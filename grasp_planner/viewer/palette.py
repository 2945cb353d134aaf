"""The commands of the palette (Ctrl/Cmd + K) with their keys."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, cast

import viser

Action = Callable[[], None]


def add_commands(
    gui: viser.GuiApi, later: Callable[[Action], None], commands: Sequence[tuple[str, str, Action]]
) -> None:
    """Add commands.

    Args:
        gui: The widgets of the page.
        later: Has the worker do something.
        commands: Name, key such as ``C`` or ``cmd/ctrl+Z``, and what to do of each. In a text field a key is typed.
    """
    for label, keys, action in commands:
        modifier, _, key = keys.rpartition("+")
        command = gui.add_command(label, hotkey=cast(Any, key), modifier=cast(Any, modifier or None))
        command.on_trigger(partial(_trigger, later, action))


def _trigger(later: Callable[[Action], None], action: Action, _: Any) -> None:
    """Do what a command says."""
    later(action)
