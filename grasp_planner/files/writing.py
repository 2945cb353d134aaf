"""Writing a file: it is there in full or not at all, and what stood there before stays until then.

Nothing else of the package opens a file for writing.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from ..exceptions import FileFormatError

PART_SUFFIX = ".part"
"""End of the name of a file that is being written; one that a kill left behind may be deleted."""


@contextlib.contextmanager
def replacing(path: Path, error: type[FileFormatError] = FileFormatError) -> Iterator[IO[bytes]]:
    """Open a new file that takes the place of another when the block ends well.

    It is written beside the other under a name of its own, made to last, and then renamed. A symbolic link keeps
    pointing at its file, and a file that is there keeps its permissions. A device or a pipe is written directly.

    Args:
        path: The file.
        error: Kind of error raised.

    Yields:
        The file to write bytes to.

    Raises:
        FileFormatError: If it can't be written; what stood there before is intact and nothing is left beside it.
    """
    temporary: Path | None = None
    try:
        target = path.resolve()
        if target.is_symlink():  # since Python 3.13 a circle of symbolic links is no error of resolve
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        if target.exists() and not target.is_file():
            with target.open("wb") as device:
                yield device
            return
        temporary = target.with_name(f".{secrets.token_hex(8)}{PART_SUFFIX}")
        with temporary.open("xb") as file:
            if target.exists():
                os.fchmod(file.fileno(), target.stat().st_mode & 0o777)
            yield file
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(target)
        temporary = None
        sync_folder(target.parent)
    except (OSError, RuntimeError) as problem:  # RuntimeError: a circle of symbolic links
        if isinstance(problem, RuntimeError) and "ymlink" not in str(problem):
            raise
        raise error(path, f"can't be written: {getattr(problem, 'strerror', None) or problem}") from None
    finally:
        if temporary is not None:
            with contextlib.suppress(OSError):
                temporary.unlink(missing_ok=True)


def write_bytes(path: Path, data: bytes, error: type[FileFormatError] = FileFormatError) -> None:
    """Write a whole file, in full or not at all; see :func:`replacing`.

    Raises:
        FileFormatError: If it can't be written; what stood there before is intact.
    """
    with replacing(path, error) as file:
        file.write(data)


def write_text(path: Path, text: str, error: type[FileFormatError] = FileFormatError) -> None:
    """Write a whole text file as UTF-8, in full or not at all; see :func:`replacing`.

    Raises:
        FileFormatError: If it can't be written; what stood there before is intact.
    """
    write_bytes(path, text.encode(), error)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder last."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


class AppendedFile:
    """A file that only grows, by whole pieces that last.

    Args:
        path: The file; made if it does not exist.

    Raises:
        OSError: If it can't be opened.
    """

    def __init__(self, path: Path) -> None:
        self._handle = _open_to_append(path)
        self._size = os.fstat(self._handle).st_size
        sync_folder(path.parent)

    def append(self, data: bytes) -> None:
        """Append bytes and make them last.

        Raises:
            OSError: If they can't be written in full; the file is then as it was before.
        """
        try:
            write_all(self._handle, data)
            os.fsync(self._handle)
        except OSError:
            os.ftruncate(self._handle, self._size)
            raise
        self._size += len(data)

    def close(self) -> None:
        """Close the file."""
        os.close(self._handle)


def write_all(handle: int, data: bytes) -> None:
    """Write all bytes; a file system may take them in pieces."""
    view = memoryview(data)
    while view:
        view = view[os.write(handle, view) :]


def drop_output() -> None:
    """Let go from now on of whatever this process prints, native libraries too."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)


def open_log(path: Path) -> IO[bytes]:
    """Open a log that grows, for what child processes say; whole lines are not promised.

    Raises:
        OSError: If it can't be opened.
    """
    return os.fdopen(_open_to_append(path), "ab", buffering=0)


def _open_to_append(path: Path) -> int:
    """Open a file at its end; a pipe that nobody reads is an error and does not keep the call waiting."""
    return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC | os.O_NONBLOCK, 0o666)


def take_lock(path: Path) -> int | None:
    """Take the lock of a file, held as long as the handle is open and the process lives.

    Args:
        path: The file; made if it does not exist, never deleted.

    Returns:
        The handle, to be closed with :func:`os.close`; None if another process holds the lock.

    Raises:
        OSError: If the file can't be opened.
    """
    import fcntl

    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        return None
    return handle


def make_folder(path: Path, error: type[FileFormatError] = FileFormatError) -> None:
    """Make a folder, with those above it, if it is not there.

    Raises:
        FileFormatError: If it can't be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise error(path, f"can't be written: {problem.strerror or problem}") from None
