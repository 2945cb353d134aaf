"""What the pages of a Parquet file hold once decompressed, from their headers, before anything is decompressed.

The sizes in the footer are only said there; what a reader allocates is what the headers of the pages say. These are
structs of Thrift's compact protocol (https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md)
as in parquet.thrift of the Parquet format, https://parquet.apache.org/docs/file-format/metadata/.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, BinaryIO

VALUE_BYTES = 16
"""Most memory that a value of a page takes beside the page itself: a number or an offset, and its levels [bytes]."""
MAX_HEADER_BYTES = 100_000
"""Largest header of a page that is read; statistics within are short texts."""
_UNPACKED, _PACKED = 2, 3
_DATA, _DICTIONARY, _DATA_2 = 5, 7, 8
_BOOLS, _BYTE, _INTEGERS, _DOUBLE, _BINARY, _STRUCT = (1, 2), 3, (4, 5, 6), 7, 8, 12
MAX_DEPTH = 8
"""Deepest struct within a header."""


class _Header:
    """A reader of one header, which raises ValueError or IndexError where the bytes are none."""

    def __init__(self, data: bytes) -> None:
        self.data, self.place = data, 0

    def integer(self) -> int:
        """Return a whole number, not negative."""
        value = shift = 0
        while shift < 64:
            byte = self.data[self.place]
            self.place += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value
        raise ValueError("a number too long")

    def struct(self, depth: int = 0) -> dict[int, Any]:
        """Return the whole numbers and structs of a struct, by field."""
        if depth > MAX_DEPTH:
            raise ValueError("nested too deeply")
        values: dict[int, Any] = {}
        field = 0
        while (head := self.byte()) != 0:
            field = field + (head >> 4) if head >> 4 else self._signed()
            values[field] = self._value(head & 0x0F, depth)
        return values

    def byte(self) -> int:
        """Return the next byte."""
        self.place += 1
        return self.data[self.place - 1]

    def _signed(self) -> int:
        """Return a whole number in zigzag code."""
        value = self.integer()
        return (value >> 1) ^ -(value & 1)

    def _value(self, kind: int, depth: int) -> Any:
        """Return a value of a struct, or go past it."""
        if kind in _BOOLS:
            return None
        if kind in _INTEGERS:
            return self._signed()
        if kind == _STRUCT:
            return self.struct(depth + 1)
        if kind not in (_BYTE, _DOUBLE, _BINARY):
            raise ValueError("a kind that no header has")  # lists and maps stand in none
        length = 1 if kind == _BYTE else 8 if kind == _DOUBLE else self.integer()
        self.place += length
        return None


def unpacked_bytes(file: BinaryIO, chunks: Iterable[Any]) -> int:
    """Return how much memory pages take once they are decompressed.

    Args:
        file: The Parquet file.
        chunks: Metadata of the column chunks that are read (``ColumnChunkMetaData`` of pyarrow).

    Returns:
        Bytes of all pages as their headers say, and of the values that they say they hold.

    Raises:
        ValueError: If the headers are none.
    """
    return sum(_chunk_bytes(file, chunk) for chunk in chunks)


def _chunk_bytes(file: BinaryIO, chunk: Any) -> int:
    """Return the memory that the pages of one column chunk take."""
    offsets = [offset for offset in (chunk.dictionary_page_offset, chunk.data_page_offset) if offset]
    if not offsets:  # a column without a row
        return 0
    place = min(offsets)
    end, total = place + chunk.total_compressed_size, 0
    while place < end:
        file.seek(place)
        header = _Header(file.read(min(MAX_HEADER_BYTES, end - place)))
        try:
            page = header.struct()
            unpacked, packed = page[_UNPACKED], page[_PACKED]
            inner = next(page[kind] for kind in (_DATA, _DICTIONARY, _DATA_2) if kind in page)
            values = inner[1]
        except (IndexError, KeyError, StopIteration, TypeError):
            raise ValueError("a page without a header") from None
        if min(unpacked, packed, values) < 0:
            raise ValueError("a page of negative size")
        total += unpacked + VALUE_BYTES * values
        place += header.place + packed
    return total
