"""The folder of a study: of which settings it holds rows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..exceptions import FileFormatError


def check_same_study(folder: Path, given: dict[str, Any]) -> None:
    """Refuse the folder of another study; more problems are the same one, and its rows stay.

    Args:
        folder: The folder, which may be empty.
        given: The settings of the study by name.

    Raises:
        FileFormatError: If it holds a run of other settings, or of more problems.
    """
    from ..batch.run_files import read_run_info

    if not (folder / "run.json").exists():
        return
    try:
        held = json.loads(read_run_info(folder).spec)
    except ValueError:
        held = None
    if not isinstance(held, dict):
        raise FileFormatError(folder, "holds a run that is no study; choose another folder")
    differ = [name for name in {**held, **given} if name != "problems" and held.get(name) != given.get(name)]
    if differ:
        name = differ[0]
        text = f"holds a study of other settings ({name}: {held.get(name)} there, {given.get(name)} asked for)"
        raise FileFormatError(folder, f"{text}; choose another folder")
    if held.get("problems", 0) > given["problems"]:
        raise FileFormatError(folder, f"holds a study of {held['problems']} problems; ask for at least as many")
