"""The last guard: an error that nobody foresaw becomes one line, and a file that says the rest."""

from __future__ import annotations

import os
import platform
import sys
import time
import traceback
from pathlib import Path

from .. import __version__
from ..exceptions import FileFormatError
from ..files.writing import make_folder
from ..files.writing import write_text as write_file
from .output import say

KEPT_REPORTS = 20
"""Reports that are kept; older ones are deleted."""
MAX_REPORT = 200_000
"""Longest report [characters]."""


def reports_folder() -> Path:
    """Return the folder of the reports, within the cache of the package."""
    import platformdirs

    return Path(platformdirs.user_cache_dir("grasp_planner", appauthor=False)) / "reports"


def say_unforeseen(error: BaseException, command: str) -> None:
    """Print what went wrong while a command ran, in one line, and write a report to send.

    Args:
        error: What was raised.
        command: Name of the command.
    """
    what = "out of memory" if isinstance(error, MemoryError) else f"{type(error).__name__}: {error}".rstrip(": ")
    path = reports_folder() / f"{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}.txt"
    try:
        make_folder(path.parent)
        write_file(path, _report(error))
        for old in sorted(path.parent.glob("*.txt"))[:-KEPT_REPORTS]:
            old.unlink(missing_ok=True)
        place = f"; please send the report {path}"
    except (FileFormatError, OSError):
        place = "; --debug before the command shows the traceback"
    # The place of the report counts more than the end of a long message.
    say("error", f"{command} failed unexpectedly{place} ({what})")


def _report(error: BaseException) -> str:
    """Return versions, command line and traceback."""
    lines = [
        f"grasp_planner {__version__}, Python {platform.python_version()}, {platform.platform()}",
        f"command line: {sys.argv}",
        "".join(traceback.format_exception(error)),
    ]
    return "\n".join(lines)[:MAX_REPORT]
