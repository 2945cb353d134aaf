"""Rows as Arrow tables and Parquet files."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from .errors import BatchDependencyError, ResultsError
from .rows import Row

try:
    import pyarrow as pa
    import pyarrow.parquet as pq
except ImportError:
    raise BatchDependencyError("pyarrow") from None

_NUMBERS = pa.list_(pa.float64())
_TYPES: dict[str, Any] = {
    "bool": pa.bool_(),
    "int64": pa.int64(),
    "double": pa.float64(),
    "string": pa.string(),
    "list<double>": _NUMBERS,
    "list<list<double>>": pa.list_(_NUMBERS),
    "list<string>": pa.list_(pa.string()),
    "list<struct<name: string, value: double>>": pa.list_(pa.struct({"name": pa.string(), "value": pa.float64()})),
    "list<struct<name: string, value: double, unit: string>>": pa.list_(
        pa.struct({"name": pa.string(), "value": pa.float64(), "unit": pa.string()})
    ),
}


def schema_of(columns: Mapping[str, str]) -> pa.Schema:
    """Return the Arrow schema of columns given by name and type."""
    return pa.schema([(name, _TYPES[kind]) for name, kind in columns.items()])


def table_of(rows: Iterable[Row], columns: Mapping[str, str]) -> pa.Table:
    """Return rows as a table, sorted by row number."""
    return pa.Table.from_pylist(sorted(rows, key=lambda values: int(values["row"])), schema=schema_of(columns))


def write_part(table: pa.Table, path: Path) -> None:
    """Write a Parquet file that is there in full or not at all, even if the machine stops.

    Args:
        table: What to write.
        path: The file.

    Raises:
        ResultsError: If it can't be written; nothing is left behind.
    """
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        with temporary.open("wb") as file:
            pq.write_table(table, file, compression="zstd")
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
        sync_folder(path.parent)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise ResultsError(path, f"can't be written: {os.strerror(error.errno or 0)}") from None
    finally:
        pa.default_memory_pool().release_unused()


def read_part(path: Path, columns: list[str] | None = None) -> pa.Table:
    """Read a Parquet file of a run.

    Raises:
        ResultsError: If it is damaged.
    """
    try:
        return pq.read_table(path, columns=columns, partitioning=None)
    except (OSError, pa.ArrowException) as error:
        reason = str(error).splitlines()[0]
        raise ResultsError(path, f"can't be read ({reason}); move it away and its cases are planned anew") from None


def sync_folder(folder: Path) -> None:
    """Make the names in a folder last."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
