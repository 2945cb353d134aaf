"""Writing what a command made, to a file or to standard output."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..exceptions import MAX_MESSAGE, FileFormatError, cut
from ..files import writing

if TYPE_CHECKING:  # --help and --version read this file, and import nothing heavy
    from ..hand.hand import Hand


def say(kind: str, message: str) -> None:
    """Print one line, ``error`` or ``warning``, on standard error; a long message is cut."""
    click.echo(f"grasp-planner: {kind}: {cut(message, MAX_MESSAGE)}", err=True)


def say_findings(hand: Hand) -> None:
    """Print what was repaired in a hand's URDF and derived from it, on standard error."""
    for line in hand.findings:
        click.echo(line, err=True)


def write_or_print(text: str, path: Path) -> None:
    """Write text to a file, or to standard output for ``-``.

    Raises:
        FileFormatError: If the file cannot be written.
    """
    if str(path) == "-":
        click.echo(text, nl=False)
        return
    writing.write_text(path, text)


def check_writable(*paths: Path | None) -> None:
    """Check before long work that outputs have a folder to go to."""
    for path in paths:
        if path is not None and str(path) != "-" and not path.parent.is_dir():
            raise FileFormatError(path, f"can't be written: no folder {path.parent}")
