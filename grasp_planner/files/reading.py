"""Reading a file without trust in its size: devices and pipes have none, and give as much as they like."""

from __future__ import annotations

import os
from pathlib import Path

from ..exceptions import FileFormatError

MESH_SUFFIXES = (".stl", ".obj", ".ply", ".glb", ".dae")
"""Formats of meshes that are read, of objects and of links, by file suffix."""


def read_bounded(path: Path, max_bytes: int) -> bytes:
    """Return the content of a file, a pipe or a device, if it ends soon enough.

    Args:
        path: The file. A pipe that nobody writes to is empty.
        max_bytes: Most bytes that are read.

    Returns:
        Its bytes.

    Raises:
        FileFormatError: If it can't be read or holds more.
    """
    try:
        # A pipe without a writer would keep the open call waiting.
        with open(os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK), "rb") as file:  # noqa: PTH123
            os.set_blocking(file.fileno(), True)
            data = file.read(max_bytes + 1)
    except OSError as error:
        raise FileFormatError(path, error.strerror or "can't be read") from None
    except ValueError:  # a zero byte in the name
        raise FileFormatError(repr(path), "is no name of a file") from None
    if len(data) > max_bytes:
        raise FileFormatError(path, f"larger than the {max_bytes} bytes allowed")
    return data
