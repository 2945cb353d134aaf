"""Reading a file without trust in its size: devices and pipes have none, and give as much as they like."""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import stat
from collections.abc import Iterator
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
        with opened_file(path, max_bytes, devices=True) as file:
            data = file.read(max_bytes + 1)
    except OSError as error:
        raise FileFormatError(path, error.strerror or "can't be read") from None
    except ValueError:  # a zero byte in the name
        raise FileFormatError(repr(path), "is no name of a file") from None
    if len(data) > max_bytes:
        raise FileFormatError(path, f"larger than the {max_bytes} bytes allowed")
    return data


@contextlib.contextmanager
def opened_file(path: Path, max_bytes: int, *, devices: bool = False) -> Iterator[io.BufferedReader]:
    """Open a file for reading that is not too large and, unless told otherwise, no device and no pipe.

    Args:
        path: The file.
        max_bytes: Largest size that is opened; devices and pipes have none.
        devices: Whether a device or a pipe is opened too. A pipe that nobody writes to is empty.

    Yields:
        The open file.

    Raises:
        OSError: If it can't be opened.
        FileFormatError: If it is no file, or larger.
    """
    # A pipe without a writer would keep the open call waiting.
    handle = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    about = os.fstat(handle)
    if stat.S_ISDIR(about.st_mode) or not (devices or stat.S_ISREG(about.st_mode)):
        os.close(handle)
        raise FileFormatError(path, "is no file but a folder, a device or a pipe")
    os.set_blocking(handle, True)
    with os.fdopen(handle, "rb") as file:
        if about.st_size > max_bytes:
            raise FileFormatError(path, f"larger than the {max_bytes} bytes allowed")
        yield file


def hash_of_file(path: Path, max_bytes: int) -> str:
    """Return the SHA-256 of a file, read piece by piece.

    Args:
        path: The file.
        max_bytes: Largest size that is read.

    Raises:
        OSError: If it can't be read.
        FileFormatError: If it is no file, or larger.
    """
    with opened_file(path, max_bytes) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
