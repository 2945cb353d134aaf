"""Icons of buttons, read from the library's archive in one go."""

from __future__ import annotations

import contextlib
import zipfile
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

from viser import _icons


class _KeptOpen(zipfile.ZipFile):
    """An archive that the end of a ``with`` block does not close."""

    def __exit__(self, *_: object) -> None:
        """Leave it open."""


@contextlib.contextmanager
def icons_read_once() -> Iterator[None]:
    """Have the archive of icons opened once for all buttons made meanwhile.

    The library opens it anew for every icon, and reading what thousands of icons it holds takes a tenth of a second.
    Where a version of the library reads icons in another way, this changes nothing.
    """
    archives: dict[Path, _KeptOpen] = {}

    def opened(path: Path) -> zipfile.ZipFile:
        if path not in archives:
            archives[path] = _KeptOpen(path)
        return archives[path]

    usual = getattr(_icons, "zipfile", None)
    vars(_icons)["zipfile"] = SimpleNamespace(ZipFile=opened)
    try:
        yield
    finally:
        vars(_icons)["zipfile"] = usual
        for archive in archives.values():
            archive.close()
