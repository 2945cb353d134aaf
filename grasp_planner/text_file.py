"""Reading a text file strictly: of limited size, UTF-8, with one clear error."""

from __future__ import annotations

from pathlib import Path

from .exceptions import FileFormatError


def read_text_file(path: Path, max_bytes: int) -> str:
    """Return the text of a file.

    Args:
        path: The file.
        max_bytes: Largest size that is read.

    Returns:
        Its text.

    Raises:
        FileFormatError: If it can't be read, is too large, or is not UTF-8.
    """
    try:
        if path.stat().st_size > max_bytes:
            raise FileFormatError(path, f"larger than the {max_bytes} bytes allowed")
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise FileFormatError(path, error.strerror or "can't be read") from None
    except UnicodeDecodeError:
        raise FileFormatError(path, "is not UTF-8 text") from None
