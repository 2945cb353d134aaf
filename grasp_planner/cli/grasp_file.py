"""Opening the file of a grasp, with its own hand or the one that an option names."""

from __future__ import annotations

from pathlib import Path

import click

from ..grasp.grasp import Grasp
from ..hand.loading import load_hand
from ..records.grasp_files import read_grasp_record
from ..records.grasp_record import grasp_from_record

HAND = click.option("--hand", default=None, help="Hand to take instead of the one of the file: name or description.")
"""Option of the commands that open a grasp."""


def opened_grasp(path: Path, hand: str | None) -> Grasp:
    """Return the grasp of a file.

    Args:
        path: The file.
        hand: Name or description file of the hand to take instead of the file's own.

    Raises:
        GraspPlannerError: If the file or the hand can't be read.
    """
    return grasp_from_record(read_grasp_record(path), None if hand is None else load_hand(hand))
