"""The journal of a run: rows that are in no Parquet file yet, one a line, each with its checksum."""

from __future__ import annotations

import json
import warnings
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa

from .arrow import table_of
from .rows import Row
from .run_files import DamagedRunWarning, RunInfo

MAX_LINE_BYTES = 50_000_000
"""Longest line that is read."""
MAX_JOURNAL_BYTES = 250_000_000
"""How much of a journal is read: it is written for 500 rows at most."""
_SEAL = b',"crc32":"%08x"}\n'


def journal_line(values: Row) -> bytes:
    """Return a row as a line of a journal: JSON whose last key is the checksum of what stands before it."""
    text = json.dumps(values, separators=(",", ":")).encode()[:-1]
    return text + _SEAL % zlib.crc32(text)


@dataclass(frozen=True)
class JournalLine:
    """A line of a journal.

    Attributes:
        values: The row; None if the line holds none of this run.
        torn: Whether it is the last and cut off, as a kill leaves it.
    """

    values: Row | None
    torn: bool = False


def journal_lines(journal: Path, info: RunInfo) -> Iterator[JournalLine]:
    """Yield the lines of one journal, one that is none if it is too long to be one.

    Yields:
        The lines; none if the journal has become a Parquet file since it was listed.
    """
    if not journal.is_file():
        return
    with journal.open("rb") as file:
        while line := file.readline(MAX_LINE_BYTES):
            if file.tell() > MAX_JOURNAL_BYTES:
                yield JournalLine(None)
                return
            yield JournalLine(_row_of(line, info), torn=not line.endswith(b"\n") and len(line) < MAX_LINE_BYTES)


def _row_of(line: bytes, info: RunInfo) -> Row | None:
    """Return the row of a line that was written whole and for this run."""
    text, found, _ = line.rpartition(b',"crc32":"')
    if not found or line != text + _SEAL % zlib.crc32(text):
        return None
    try:
        values: Any = json.loads(text + b"}")
    except (ValueError, RecursionError):
        return None
    known = isinstance(values, dict) and values.keys() == info.columns.keys()
    if not known or type(values["row"]) is not int or not 0 <= values["row"] < info.cases:
        return None
    if type(values["feasible"]) is not bool or values.get("spec_hash", info.spec_hash) != info.spec_hash:
        return None
    return values


def journal_files(folder: Path) -> list[Path]:
    """Return the journals of a run, oldest first."""
    return sorted(folder.glob("journal-*.jsonl"))


def journal_rows(folder: Path, info: RunInfo) -> Iterator[Row]:
    """Yield the rows of all journals, which Parquet files may hold already; damaged lines are left out."""
    for path in journal_files(folder):
        for number, line in enumerate(journal_lines(path, info), 1):
            if line.values is not None:
                yield line.values
            elif not line.torn:
                warnings.warn(f"{path}: left out: line {number} is damaged", DamagedRunWarning, stacklevel=2)


def journal_table(rows: Iterable[Row], info: RunInfo) -> pa.Table:
    """Return the rows of journals as a table, each once; those whose values are not of their columns are left out."""
    once = {values["row"]: values for values in rows}
    try:
        return table_of(once.values(), info.columns)
    except pa.ArrowException:
        return table_of((values for values in once.values() if _fits(values, info)), info.columns)


def _fits(values: Row, info: RunInfo) -> bool:
    """Return whether the values of a row are of the types of their columns."""
    try:
        table_of([values], info.columns)
    except pa.ArrowException:
        return False
    return True
