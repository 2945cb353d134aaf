"""The folder of a run: rows first go to a journal, then, many at a time, to Parquet files that never change.

::

    run.json                     what is run: hash, number of cases, columns, specification
    results/part-000001.parquet  rows, final; read this folder with pandas, polars or DuckDB
    journal-000002.jsonl         rows that are not in a Parquet file yet, one a line
    workers.log                  what workers wrote to standard error
    run.lock                     held while a process runs the batch

Journal k turns into part k, by one rename; then it is deleted. Where both exist the journal is obsolete. So every
row is in exactly one place at every instant, and a kill loses only the cases that were being planned.
"""

from __future__ import annotations

import contextlib
import json
import os
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import IO

from ..files.writing import AppendedFile, open_log, take_lock, write_text
from .arrow import read_part, table_of, write_part
from .errors import ResultsError
from .rows import Row, columns

PART_ROWS = 500
"""Rows after which the journal is turned into a Parquet file."""
PART_SECONDS = 120.0
"""Age of the journal after which it is turned into a Parquet file [s]."""
FORMAT = 1
"""Version of the layout of the folder."""


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


def read_run_info(folder: Path) -> RunInfo:
    """Return what a run is.

    Raises:
        ResultsError: If the folder holds no run.
    """
    path = folder / "run.json"
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if data["format"] != FORMAT:
            raise ResultsError(path, f"format {data['format']} instead of {FORMAT}")
        return RunInfo(**data)
    except OSError as error:
        raise ResultsError(path, f"no run here: {error.strerror}") from None
    except (ValueError, TypeError, KeyError) as error:
        raise ResultsError(path, f"is damaged: {error}") from None


def part_files(folder: Path) -> list[Path]:
    """Return the Parquet files of a run, oldest first."""
    return sorted((folder / "results").glob("part-*.parquet"))


def journal_rows(folder: Path) -> Iterator[Row]:
    """Yield the rows that are in no Parquet file yet; a line cut off by a kill is left out."""
    for path in sorted(folder.glob("journal-*.jsonl")):
        if not _part_of(path).exists():
            yield from _lines_of(path)


def _lines_of(journal: Path) -> Iterator[Row]:
    """Yield the rows of one journal; none if it has become a Parquet file since it was listed."""
    if not journal.exists():
        return
    with journal.open("rb") as file:
        for line in file:
            try:
                values = json.loads(line)
            except ValueError:
                continue
            if isinstance(values, dict) and "row" in values:
                yield values


class ResultStore:
    """Writes the rows of a run; one process at a time.

    Args:
        folder: Folder of the run; made if it does not exist.
        info: What is run; if the folder holds a run already, it has to be the same, or the first rows of this one.

    Raises:
        ResultsError: If the folder can't be written, holds another run, or another process runs it.
    """

    def __init__(self, folder: Path, info: RunInfo) -> None:
        self.folder, self.info = folder, info
        self.done = bytearray(info.cases)
        self.finished = self.feasible = 0
        self._journal: AppendedFile | None = None
        self._pending = 0
        self._began = 0.0
        try:
            (folder / "results").mkdir(parents=True, exist_ok=True)
            self._lock = self._take_lock()
        except OSError as error:
            raise ResultsError(folder, f"can't be written: {error.strerror}") from None
        try:
            self._check_same()
            self._fold_left_over()
            self._read_done()
            self.log: IO[bytes] = open_log(folder / "workers.log")
        except OSError as error:
            os.close(self._lock)
            raise ResultsError(folder, f"can't be written: {error.strerror}") from None
        except BaseException:
            os.close(self._lock)
            raise

    def __enter__(self) -> ResultStore:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
            return
        with contextlib.suppress(ResultsError):  # what went wrong first is what counts; the journal stays
            self.close()

    def append(self, rows: list[Row]) -> None:
        """Write rows so that they last; a row that is there already is dropped.

        Args:
            rows: The rows.

        Raises:
            ResultsError: If they can't be written, for instance because the disk is full; earlier rows are intact.
        """
        new = list({values["row"]: values for values in rows if not self.done[values["row"]]}.values())
        if not new:
            return
        data = b"".join(json.dumps(values, separators=(",", ":")).encode() + b"\n" for values in new)
        try:
            if self._journal is None:
                self._journal = self._open_journal()
            self._journal.append(data)
        except OSError as error:
            reason = f"can't be written: {error.strerror}; {self.finished} rows are intact, run again to go on"
            raise ResultsError(self.folder, reason) from None
        self._pending += len(new)
        for values in new:
            self.done[values["row"]] = 1
            self.feasible += bool(values["feasible"])
        self.finished += len(new)
        if self._pending >= PART_ROWS or time.monotonic() - self._began > PART_SECONDS:
            self.fold()

    def fold(self) -> None:
        """Turn the journal into a Parquet file.

        Raises:
            ResultsError: If it can't be written; the journal stays.
        """
        if self._journal is not None:
            self._journal.close()
            self._journal = None
        self._fold_left_over()
        self._pending = 0

    def close(self) -> None:
        """Turn the journal into a Parquet file and let go of the folder."""
        try:
            self.fold()
        finally:
            self.log.close()
            os.close(self._lock)

    def _open_journal(self) -> AppendedFile:
        """Open the next journal."""
        parts = part_files(self.folder)
        number = 1 + (int(parts[-1].stem.split("-")[1]) if parts else 0)
        path = self.folder / f"journal-{number:06d}.jsonl"
        self._began = time.monotonic()
        return AppendedFile(path)

    def _fold_left_over(self) -> None:
        """Turn every journal into its Parquet file."""
        for path in sorted(self.folder.glob("journal-*.jsonl")):
            if not _part_of(path).exists():
                rows = {values["row"]: values for values in _lines_of(path)}
                if rows:
                    write_part(table_of(rows.values(), self.info.columns), _part_of(path))
            path.unlink()

    def _read_done(self) -> None:
        """Note which cases have a row."""
        for path in part_files(self.folder):
            table = read_part(path, ["row", "feasible"])
            for row in table["row"].to_pylist():
                self.done[row] = 1
            self.finished += table.num_rows
            self.feasible += sum(table["feasible"].to_pylist())

    def _take_lock(self) -> int:
        """Keep other processes out, as long as this one lives."""
        handle = take_lock(self.folder / "run.lock")
        if handle is None:
            raise ResultsError(self.folder, "another process runs this batch now")
        return handle

    def _check_same(self) -> None:
        """Write what is run, or check that it is the same."""
        path = self.folder / "run.json"
        there = read_run_info(self.folder) if path.exists() else None
        if there is None or (there.spec_hash == self.info.spec_hash and there.cases < self.info.cases):
            write_text(path, json.dumps(asdict(self.info), indent=1) + "\n", ResultsError)
        if there is None:
            return
        if there.spec_hash != self.info.spec_hash:
            reason = f"holds a run of other cases ({there.cases}, hash {there.spec_hash}; these: {self.info.cases}, "
            raise ResultsError(self.folder, f"{reason}hash {self.info.spec_hash}); choose another folder")
        if there.cases > self.info.cases:
            reason = f"holds a run of {there.cases} cases; ask for at least as many, or choose another folder"
            raise ResultsError(self.folder, reason)
        if there.columns != self.info.columns:
            raise ResultsError(self.folder, "was begun by a version with other columns; choose another folder")


def run_info(spec_hash: str, cases: int, planner: str, spec: str = "") -> RunInfo:
    """Return what is run, with the columns of this version."""
    return RunInfo(spec_hash, cases, planner, columns(), spec)


def _part_of(journal: Path) -> Path:
    """Return the Parquet file a journal turns into."""
    return journal.parent / "results" / f"{journal.stem.replace('journal', 'part')}.parquet"
