"""What lies in the folder of a run, read without trust: only rows that this run can have written are its rows.

Whatever else is found there is named and left out; :class:`~.store.ResultStore` sets it aside and has its cases planned
again.
"""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from ..exceptions import FileFormatError, InvalidValueError
from ..files.reading import hash_of_file, read_bounded
from ..files.text import read_text_file
from .arrow import COLUMN_TYPES, MAX_PART_BYTES, read_part, schema_of
from .errors import ResultsError
from .rows import columns

FORMAT = 1
"""Version of the layout of the folder."""
MAX_CASES = 10_000_000
"""Most cases of a run that is read."""
MAX_INFO_BYTES = 50_000_000
"""Largest ``run.json`` that is read."""
SUMS = "parts.sha256"
"""Checksums of the Parquet files, as ``sha256sum --check`` reads them."""
SET_ASIDE = "set-aside"
"""Folder within that of the run for what does not belong there."""
PART_NAME = re.compile(r"part-(\d{6,9})\.parquet")
"""Names of Parquet files."""
KEYS = ("row", "feasible", "spec_hash")
"""Columns that tell whether a row is one of the run."""


class DamagedRunWarning(UserWarning):
    """Something in the folder of a run is damaged or does not belong there, and is left out."""


@dataclass(frozen=True)
class RunInfo:
    """What a run is.

    Attributes:
        spec_hash: Hash of all its cases and the planner; a run that can grow leaves the number of cases out.
        cases: Number of cases.
        planner: What plans, as ``module:function``.
        columns: Type of every column, by name.
        spec: Text of the specification, if there was one.
        format: Version of the layout of the folder.
    """

    spec_hash: str
    cases: int
    planner: str
    columns: dict[str, str]
    spec: str = ""
    format: int = FORMAT

    def __post_init__(self) -> None:
        for name in ("spec_hash", "planner", "spec"):
            if not isinstance(getattr(self, name), str):
                raise InvalidValueError(name, getattr(self, name), "a text")
        if type(self.cases) is not int or not 1 <= self.cases <= MAX_CASES:
            raise InvalidValueError("cases", self.cases, f"a whole number from 1 to {MAX_CASES}")
        if not isinstance(self.columns, dict) or self.columns.get("row") != "int64":
            raise InvalidValueError("columns", self.columns, "columns by name, with row: int64")
        if self.columns.get("feasible") != "bool":
            raise InvalidValueError("columns", self.columns.get("feasible"), "feasible: bool")
        for name, kind in self.columns.items():
            if not isinstance(kind, str) or kind not in COLUMN_TYPES:
                raise InvalidValueError(f"columns.{name}", kind, f"one of {', '.join(COLUMN_TYPES)}")


def run_info(spec_hash: str, cases: int, planner: str, spec: str = "") -> RunInfo:
    """Return what is run, with the columns of this version."""
    return RunInfo(spec_hash, cases, planner, columns(), spec)


def read_run_info(folder: Path) -> RunInfo:
    """Return what a run is.

    Raises:
        ResultsError: If the folder holds no run, or ``run.json`` is damaged.
    """
    path = folder / "run.json"
    if not path.exists():
        raise ResultsError(path, "no run here: No such file or directory")
    again = "move it away and run the same command again, rows that belong to it are kept"
    try:
        data = json.loads(read_text_file(path, MAX_INFO_BYTES))
        if not isinstance(data, dict):
            raise InvalidValueError("run.json", data, "a mapping")
        if data.get("format") != FORMAT:
            raise ResultsError(path, f"format {str(data.get('format'))[:20]} instead of {FORMAT}")
        return RunInfo(**data)
    except ResultsError:
        raise
    except FileFormatError as error:
        raise ResultsError(path, error.reason) from None
    except (ValueError, TypeError, RecursionError) as error:
        raise ResultsError(path, f"is damaged: {str(error)[:200]}; {again}") from None


@dataclass(frozen=True)
class PartRows:
    """The rows of a Parquet file that are rows of the run and stand in no file before it.

    Attributes:
        path: The file.
        table: These rows.
        fault: What is wrong with the file; empty if all its rows are good.
    """

    path: Path
    table: pa.Table
    fault: str = ""


def read_parts(
    folder: Path, info: RunInfo, names: Iterable[str] | None = None, rows: Iterable[int] | None = None
) -> Iterator[PartRows]:
    """Read the Parquet files of a run, oldest first.

    Args:
        folder: Folder of the run.
        info: What it is.
        names: Columns to read; all if left out.
        rows: Numbers of the rows to read; all if left out.

    Yields:
        What each holds.
    """
    wanted = list(info.columns if names is None else names)
    none = schema_of({name: info.columns[name] for name in wanted}).empty_table()
    sums, seen = read_sums(folder), bytearray(info.cases)
    for path in result_files(folder):
        try:
            if not PART_NAME.fullmatch(path.name):
                raise ResultsError(path, "is no file of this run")
            known = path.name in sums
            if known and sums[path.name] != file_sum(path):
                raise ResultsError(path, "is damaged: its checksum is another")
            # Without a checksum only what can be read in full counts.
            first = [name for name in KEYS if name in info.columns] if known else list(info.columns)
            keys = read_part(path, info.columns, first, info.cases)
            good, fault = _good_rows(keys, info, seen)
            chosen = good if rows is None else pc.and_(good, pc.is_in(keys["row"], value_set=_numbers(rows)))
            table = none  # long texts stay on disk if no row is wanted
            if pc.any(chosen).as_py():
                table = read_part(path, info.columns, wanted, info.cases).filter(chosen)
        except FileNotFoundError:  # moved meanwhile by the process that runs the batch
            continue
        except ResultsError as error:
            yield PartRows(path, none, error.reason)
            continue
        yield PartRows(path, table, fault)


def _good_rows(keys: pa.Table, info: RunInfo, seen: bytearray) -> tuple[pa.Array, str]:
    """Return which rows are rows of the run and new, mark them as seen, and say what is wrong with the others."""
    good, fault = [], ""
    own = keys["spec_hash"].to_pylist() if "spec_hash" in info.columns else [info.spec_hash] * keys.num_rows
    for row, feasible, hashed in zip(keys["row"].to_pylist(), keys["feasible"].to_pylist(), own, strict=True):
        if row is None or not 0 <= row < info.cases:
            wrong = f"row {row} is none of this run"
        elif feasible is None:
            wrong = f"row {row} is not complete"
        elif hashed != info.spec_hash:
            wrong = f"row {row} is of another run"
        elif seen[row]:
            wrong = f"row {row} stands there already"
        else:
            wrong, seen[row] = "", 1
        good.append(not wrong)
        fault = fault or wrong
    return pa.array(good, pa.bool_()), fault


def _numbers(rows: Iterable[int]) -> pa.Array:
    """Return numbers of rows as an Arrow array."""
    return pa.array(sorted(set(rows)), pa.int64())


def sound_tables(
    folder: Path, info: RunInfo, names: Iterable[str], rows: Iterable[int] | None = None
) -> Iterator[pa.Table]:
    """Yield the rows of the Parquet files as :func:`read_parts` does; what is wrong with a file is a warning."""
    for part in read_parts(folder, info, names, rows):
        if part.fault:
            warnings.warn(f"{part.path}: left out: {part.fault}", DamagedRunWarning, stacklevel=2)
        yield part.table


def result_files(folder: Path) -> list[Path]:
    """Return what lies where the Parquet files of a run lie, oldest first, but not what is being written."""
    place = folder / "results"
    return sorted(path for path in place.iterdir() if not path.name.startswith(".")) if place.is_dir() else []


def part_files(folder: Path) -> list[Path]:
    """Return the Parquet files of a run, oldest first."""
    return [path for path in result_files(folder) if PART_NAME.fullmatch(path.name)]


def file_sum(path: Path) -> str:
    """Return the SHA-256 of a file.

    Raises:
        FileNotFoundError: If it is gone.
        ResultsError: If it can't be read, is no file, or too large.
    """
    try:
        return hash_of_file(path, MAX_PART_BYTES)
    except FileNotFoundError:
        raise
    except FileFormatError as error:
        raise ResultsError(path, error.reason) from None
    except OSError as error:
        raise ResultsError(path, f"can't be read: {error.strerror}") from None


def read_sums(folder: Path) -> dict[str, str]:
    """Return the checksums of the Parquet files, by name; lines that are none are left out."""
    try:
        text = read_bounded(folder / SUMS, MAX_INFO_BYTES).decode(errors="replace")
    except FileFormatError:
        return {}
    return {name: value for value, name in re.findall(r"^([0-9a-f]{64})  results/(\S+)$", text, re.MULTILINE)}


def sum_line(path: Path) -> bytes:
    """Return the line of a Parquet file among the checksums."""
    return f"{file_sum(path)}  results/{path.name}\n".encode()
