"""Grasps as JSON text: one, or a list of several, the best first."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from ..exceptions import FileFormatError, shown
from ..files.reading import read_bounded
from ..grasp.grasp import Grasp
from .grasp_record import grasp_record
from .layout import GraspRecord

MAX_RECORD_BYTES = 5_000_000
"""Largest file of grasps that is read."""
_RECORDS = TypeAdapter(list[GraspRecord])
_NUMBERED = re.compile(r"(?P<path>.*)#(?P<number>[1-9][0-9]{0,3})")


def grasp_json(grasp: Grasp) -> str:
    """Return the JSON text of a grasp."""
    return grasp_record(grasp).model_dump_json(indent=2) + "\n"


def grasp_list_json(grasps: Sequence[Grasp]) -> str:
    """Return the JSON text of several grasps: a list of what :func:`grasp_json` writes for each."""
    return _RECORDS.dump_json([grasp_record(grasp) for grasp in grasps], indent=2).decode() + "\n"


def read_grasp_record(path: Path) -> GraspRecord:
    """Read a grasp file; of a list of grasps the first, or with ``#3`` behind the path the third.

    Args:
        path: JSON file.

    Returns:
        The record.

    Raises:
        FileFormatError: If it can't be read, is too large, or breaks the contract; the reason names the key.
    """
    numbered = None if path.exists() else _NUMBERED.fullmatch(str(path))
    file, number = (path, 1) if numbered is None else (Path(numbered["path"]), int(numbered["number"]))
    return parse_grasp_record(read_bounded(file, MAX_RECORD_BYTES), file, number)


def parse_grasp_record(content: bytes, source: Path | str, number: int = 1) -> GraspRecord:
    """Return the record of JSON text.

    Args:
        content: The text, in UTF-8.
        source: Where it comes from, for messages.
        number: Which grasp of a list, from 1.

    Returns:
        The record.

    Raises:
        FileFormatError: If it is too large, no UTF-8, no JSON, or breaks the contract; the reason names the key.
    """
    if len(content) > MAX_RECORD_BYTES:
        raise FileFormatError(source, f"larger than the {MAX_RECORD_BYTES} bytes allowed")
    try:
        text = content.decode("utf-8")
        several = text.lstrip().startswith("[")
        found = _RECORDS.validate_json(text) if several else [GraspRecord.model_validate_json(text)]
    except UnicodeDecodeError:
        raise FileFormatError(source, "is not UTF-8 text") from None
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"])
        raise FileFormatError(source, f"key {shown(key)}: {first['msg']}") from None
    if number > len(found):
        raise FileFormatError(source, f"holds {len(found)} grasps, not {number}")
    return found[number - 1]
