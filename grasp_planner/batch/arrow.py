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

COLUMN_TYPES = tuple(_TYPES)
"""Types that columns have."""
MAX_PART_BYTES = 2**30
"""Largest Parquet file that is read, decompressed [bytes]."""


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
            pq.write_table(table, file, compression="zstd", write_page_checksum=True)
    finally:
        pa.default_memory_pool().release_unused()


def read_part(path: Path, columns: Mapping[str, str], names: list[str], max_rows: int) -> pa.Table:
    """Read a Parquet file of a run.

    Args:
        path: The file.
        columns: Every column it has to have, and its type.
        names: Columns to read.
        max_rows: Most rows it may have.

    Raises:
        FileNotFoundError: If it is gone.
        ResultsError: If it is damaged, too large, or has other columns.
    """
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            meta, schema = file.metadata, file.schema_arrow
            size = sum(meta.row_group(k).total_byte_size for k in range(meta.num_row_groups))
            if meta.num_rows > max_rows or not 0 <= size <= MAX_PART_BYTES:
                raise ResultsError(path, f"holds more than {max_rows} rows or {MAX_PART_BYTES} bytes")
            if not schema.equals(schema_of(columns)):
                raise ResultsError(path, "has other columns than the run")
            return file.read(names, use_threads=False).select(names)
    except FileNotFoundError:
        raise
    except (OSError, pa.ArrowException, ValueError, MemoryError) as error:
        raise ResultsError(path, f"can't be read ({(str(error).splitlines() or ['?'])[0]})") from None
