"""The folder of a run: rows first go to a journal, then, many at a time, to Parquet files that never change.

::

    run.json                     what is run: hash, number of cases, columns, specification
    results/part-000001.parquet  rows, final; read this folder with pandas, polars or DuckDB
    journal-000002.jsonl         rows that are not in a Parquet file yet, one a line
    parts.sha256                 checksums of the Parquet files; sha256sum --check reads them
    set-aside/                   what lay there and is damaged or does not belong there; nothing is deleted
    workers.log                  what workers wrote to standard error
    run.lock                     held while a process runs the batch

A journal turns into a Parquet file by one rename; then it is deleted. A row that stands in both counts once. So no
row is ever missing, and a kill loses only the cases that were being planned. Nothing in the
folder is trusted: finished are the distinct rows of this run that can be read; everything else is set aside and planned
again.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import time
import warnings
from dataclasses import asdict
from pathlib import Path
from types import TracebackType
from typing import IO

from pyarrow import Table

from ..files.writing import PART_SUFFIX, AppendedFile, open_log, take_lock, write_text
from .arrow import read_part, write_part
from .errors import ResultsError
from .journal import journal_files, journal_line, journal_lines, journal_table
from .rows import Row
from .run_files import (
    PART_NAME,
    SET_ASIDE,
    SUMS,
    DamagedRunWarning,
    PartRows,
    RunInfo,
    part_files,
    read_parts,
    read_run_info,
    read_sums,
    sum_line,
)

PART_ROWS = 500
"""Rows after which the journal is turned into a Parquet file."""
PART_SECONDS = 120.0
"""Age of the journal after which it is turned into a Parquet file [s]."""


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
        self._path: Path | None = None
        self._pending = 0
        self._began = 0.0
        try:
            (folder / "results").mkdir(parents=True, exist_ok=True)
            self._lock = self._take_lock()
        except OSError as error:
            raise ResultsError(folder, f"can't be written: {error.strerror}") from None
        try:
            self._check_same()
            self._adopt_parts()
            for path in journal_files(folder):
                self._fold(path, mine=False)
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
        data = b"".join(journal_line(values) for values in new)
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
        if self._path is not None:
            try:
                self._fold(self._path, mine=True)
            except OSError as error:
                raise ResultsError(self.folder, f"can't be written: {error.strerror}") from None
            self._path = None
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
        self._path = self.folder / f"journal-{self._next_part():06d}.jsonl"
        self._began = time.monotonic()
        return AppendedFile(self._path)

    def _next_part(self) -> int:
        """Return the number of the next Parquet file."""
        found = [PART_NAME.fullmatch(path.name) for path in part_files(self.folder)]
        return 1 + max((int(match[1]) for match in found if match), default=0)

    def _fold(self, journal: Path, *, mine: bool) -> None:
        """Turn a journal into a Parquet file; the rows of one that an earlier process left are counted now."""
        lines = list(journal_lines(journal, self.info))
        rows = [line.values for line in lines if line.values is not None]
        table = journal_table((row for row in rows if mine or not self.done[row["row"]]), self.info)
        if table.num_rows:
            self._write_part(table, self.folder / "results" / f"part-{self._next_part():06d}.parquet")
        if not mine:
            self._count(table)
        faults = sum(line.values is None and not line.torn for line in lines)
        if faults:
            self._set_aside(journal, f"{faults} of its lines are damaged")
        else:
            journal.unlink(missing_ok=True)

    def _adopt_parts(self) -> None:
        """Count the rows of the Parquet files, and set aside what is not one of this run."""
        for unfinished in (self.folder / "results").glob(f".*{PART_SUFFIX}"):
            unfinished.unlink(missing_ok=True)  # its rows are in a journal still
        sums, faults = read_sums(self.folder), []
        for part in read_parts(self.folder, self.info, ["row", "feasible"]):
            if part.fault:
                faults.append(part)
                continue
            self._count(part.table)
            if part.path.name not in sums:
                self._note_sum(part.path)
        for part in faults:
            good = self._rows_of(part)
            self._set_aside(part.path, part.fault)
            if good is not None:
                self._write_part(good, part.path)
                self._count(good)

    def _rows_of(self, part: PartRows) -> Table | None:
        """Return what is good in a Parquet file, all columns; None if nothing is."""
        numbers = part.table["row"].to_pylist()
        if not numbers:
            return None
        try:
            whole = read_part(part.path, self.info.columns, list(self.info.columns), self.info.cases)
        except ResultsError:
            return None
        # A row that stands twice in the file is kept once.
        wanted = set(numbers)
        return journal_table((values for values in whole.to_pylist() if values["row"] in wanted), self.info)

    def _count(self, table: Table) -> None:
        """Note the rows of a table as being on disk."""
        for row in table["row"].to_pylist():
            self.done[row] = 1
        self.finished += table.num_rows
        self.feasible += sum(table["feasible"].to_pylist())

    def _write_part(self, table: Table, path: Path) -> None:
        """Write a Parquet file and its checksum."""
        write_part(table, path)
        self._note_sum(path)

    def _note_sum(self, path: Path) -> None:
        """Write down the checksum of a Parquet file."""
        sums = AppendedFile(self.folder / SUMS)
        try:
            sums.append(sum_line(path))
        finally:
            sums.close()

    def _set_aside(self, path: Path, fault: str) -> None:
        """Move a file out of the way and say so."""
        place = self.folder / SET_ASIDE
        place.mkdir(exist_ok=True)
        number = itertools.count(1)
        target = place / path.name
        while target.exists():
            target = place / f"{path.name}.{next(number)}"
        path.rename(target)
        text = f"{path.name} set aside as {SET_ASIDE}/{target.name}: {fault}; what it does not hold is planned again"
        warnings.warn(f"{self.folder}: {text}", DamagedRunWarning, stacklevel=2)

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
