"""Opening the file of a grasp, with its own hand or the one that an option names."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from ..exceptions import InvalidValueError
from ..grasp.grasp import Grasp
from ..hand.loading import load_hand
from ..records.grasp_files import read_grasp_record
from ..records.grasp_record import grasp_from_record
from .output import say_findings

Command = TypeVar("Command", bound=Callable[..., Any])


def hand_option(text: str, default: str | None = None) -> Callable[[Command], Command]:
    """Return a decorator that adds ``--hand`` and ``--lock``; the command gets both as the text ``hand``.

    Args:
        text: Help of ``--hand``.
        default: Hand where none is named.
    """

    def decorated(command: Command) -> Any:
        @functools.wraps(command)
        def called(*args: Any, hand: str | None, locks: tuple[str, ...], **rest: Any) -> Any:
            if locks and hand is None:
                raise InvalidValueError("--lock", locks[0], "only with --hand; a file knows its own hand's joints")
            return command(*args, hand=f"{hand}:{','.join(locks)}" if locks else hand, **rest)

        lock = "Fix a joint of the hand's URDF: NAME=VALUE in rad or m. Repeatable."
        given: dict[str, Any] = {} if default is None else {"show_default": True}
        return click.option("--hand", default=default, help=text, **given)(
            click.option("--lock", "locks", multiple=True, help=lock)(called)
        )

    return decorated


HAND = hand_option("Hand to take instead of the one of the file: name, description (TOML) or URDF.")
"""Options of the commands that open a grasp or a run."""


def opened_grasp(path: Path, hand: str | None) -> Grasp:
    """Return the grasp of a file; what was repaired or derived of a hand that is named goes to standard error.

    Args:
        path: The file.
        hand: Name, description file or URDF of the hand to take instead of the file's own.

    Raises:
        GraspPlannerError: If the file or the hand can't be read.
    """
    record = read_grasp_record(path)
    if hand is None:
        return grasp_from_record(record)
    loaded = load_hand(hand)
    say_findings(loaded)
    return grasp_from_record(record, loaded)
