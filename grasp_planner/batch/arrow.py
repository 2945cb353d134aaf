"""Rows as Arrow tables and Parquet files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..files.writing import replacing
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
    try:
        with replacing(path, ResultsError) as file:
            pq.write_table(table, file, compression="zstd")
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
