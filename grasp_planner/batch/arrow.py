"""Rows as Arrow tables and Parquet files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ..exceptions import FileFormatError
from ..files.reading import opened_file
from ..files.writing import replacing
from .errors import BatchDependencyError, ResultsError
from .parquet_pages import unpacked_bytes
from .rows import Row

try:
    import pyarrow as pa
    import pyarrow.compute as pc
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
    "list<struct<name: string, survived: int64, tried: int64, worst: string>>": pa.list_(
        pa.struct({"name": pa.string(), "survived": pa.int64(), "tried": pa.int64(), "worst": pa.string()})
    ),
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

    Texts are read by their numbers in the dictionaries of the file first: a text may stand in it once and in the table
    a million times.

    Args:
        path: The file.
        columns: Every column it has to have, and its type.
        names: Columns to read.
        max_rows: Most rows it may have.

    Raises:
        FileNotFoundError: If it is gone.
        ResultsError: If it is damaged, too large, no file but a device or a pipe, or has other columns.
    """
    too_large = ResultsError(path, f"holds more than {max_rows} rows or {MAX_PART_BYTES} bytes")
    try:
        with opened_file(path, MAX_PART_BYTES) as file, pq.ParquetFile(file) as head:
            meta, wanted = head.metadata, set(names)
            if not head.schema_arrow.equals(schema_of(columns)):
                raise ResultsError(path, "has other columns than the run")
            groups = [meta.row_group(number) for number in range(meta.num_row_groups)]
            chunks = [group.column(number) for group in groups for number in range(group.num_columns)]
            chunks = [chunk for chunk in chunks if chunk.path_in_schema.partition(".")[0] in wanted]
            if meta.num_rows > max_rows or unpacked_bytes(file, chunks) > MAX_PART_BYTES:
                raise too_large
            texts = sorted({chunk.path_in_schema for chunk in chunks if chunk.physical_type == "BYTE_ARRAY"})
            options = {"page_checksum_verification": True, "metadata": meta, "read_dictionary": texts}
            with pq.ParquetFile(file, **options) as parquet:
                table = parquet.read(names, use_threads=False).select(names)
            if sum(_text_bytes(chunk) for column in table.columns for chunk in column.chunks) > MAX_PART_BYTES:
                raise too_large
            return table.cast(schema_of({name: columns[name] for name in names}))
    except FileNotFoundError:
        raise
    except FileFormatError as error:
        raise ResultsError(path, error.reason) from None
    except (OSError, pa.ArrowException, ValueError, MemoryError) as error:
        raise ResultsError(path, f"can't be read ({(str(error).splitlines() or ['?'])[0]})") from None


def _text_bytes(array: pa.Array) -> int:
    """Return the bytes of all texts of an array once each stands where it is used."""
    if pa.types.is_dictionary(array.type):
        if len(array.dictionary) == 0:
            return 0
        lengths = pc.binary_length(array.dictionary).take(array.indices)
        return int(pc.sum(lengths.cast(pa.int64())).as_py() or 0)
    if pa.types.is_list(array.type):
        return _text_bytes(array.values)
    if pa.types.is_struct(array.type):
        return sum(_text_bytes(array.field(number)) for number in range(array.type.num_fields))
    return 0
