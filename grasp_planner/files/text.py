"""Reading a text file strictly: of limited size, UTF-8, with one clear error."""

from __future__ import annotations

import math
import re
from pathlib import Path

from ..exceptions import FileFormatError, shown
from .reading import read_bounded


def read_text_file(path: Path, max_bytes: int) -> str:
    """Return the text of a file.

    Args:
        path: The file.
        max_bytes: Largest size that is read.

    Returns:
        Its text.

    Raises:
        FileFormatError: If it can't be read, is too large, or is not UTF-8.
    """
    try:
        text = read_bounded(path, max_bytes).decode()
        return text.replace("\r\n", "\n").replace("\r", "\n")  # as text files are read
    except UnicodeDecodeError:
        raise FileFormatError(path, "is not UTF-8 text") from None


def finite_number(path: Path, place: str, text: str) -> float:
    """Return a finite number of a table.

    Args:
        path: The file, for messages.
        place: Where in the file, for messages.
        text: The number as it stands there.

    Returns:
        The number.

    Raises:
        FileFormatError: If it is no finite number; names file and place.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FileFormatError(path, f"{place}: {shown(text)} is not a finite number")
    return value


def refuse_entities(path: Path, text: str) -> None:
    """Refuse XML that declares a document type, entities, or an encoding that could hide one.

    Args:
        path: The file, for messages.
        text: Its text, read as UTF-8.

    Raises:
        FileFormatError: If it does.
    """
    declared = re.search(r"<\?xml[^>]*\bencoding\s*=\s*[\"']([^\"']*)", text[:1000])
    if declared and declared[1].lower() not in ("utf-8", "utf8", "ascii", "us-ascii"):
        raise FileFormatError(path, f"declares the encoding {shown(declared[1])}, only UTF-8 is allowed")
    if "<!DOCTYPE" in text.upper() or "<!ENTITY" in text.upper():
        raise FileFormatError(path, "declares a document type or entities, which is not allowed")
