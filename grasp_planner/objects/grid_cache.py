"""Distance grids on disk, by the content of the mesh: numbers only, never pickles, never trusted blindly.

An entry has a version and a checksum; one that is damaged is named and built anew. The folder keeps within a size: what
was not used for longest goes first. Entries are replaced in one step, so that several processes may write at once.
"""

from __future__ import annotations

import contextlib
import hashlib
import math
import os
import time
import warnings
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO
from zipfile import ZIP_STORED, BadZipFile, ZipFile

import numpy as np
import numpy.typing as npt

from ..exceptions import FileFormatError
from ..files.reading import opened_file
from ..files.writing import PART_SUFFIX, make_folder, replacing
from .distance_grid import MAX_NODES, DistanceGrid, GridAxes, build_distance_grid

if TYPE_CHECKING:
    import trimesh

CACHE_VERSION = 8
"""Raised whenever grids are built, or written, in another way."""
MAX_CACHE_BYTES = 2_000_000_000
"""Size of the folder above which entries are deleted."""
MAX_ENTRY_BYTES = 4 * MAX_NODES + 100_000
"""Largest entry that is read: the nodes as single-precision numbers and little else."""
STALE_S = 86400.0
"""Age at which a file that was not finished is deleted [s]."""


class CacheWarning(UserWarning):
    """An entry of the cache is damaged and made anew."""


def cached_distance_grid(mesh: trimesh.Trimesh, resolution: float, tolerance: float = np.inf) -> DistanceGrid:
    """Return the distance grid of a solid, from the user's cache folder if it is there.

    Args:
        mesh: Watertight mesh in its final unit and frame [m].
        resolution: Node spacing asked for [m].
        tolerance: Error above which the grid is refined [m].

    Returns:
        The grid.
    """
    path = cache_folder() / f"{_content_hash(mesh, resolution, tolerance)}.npz"
    grid = _load(path)
    if grid is not None:
        with contextlib.suppress(OSError):
            os.utime(path)  # used now; what was not for longest is deleted first
    else:
        grid = build_distance_grid(mesh, resolution, tolerance)
        with contextlib.suppress(FileFormatError, OSError):  # no cache is slower, not wrong
            _store(grid, path)
            _evict(path)
    return grid


def cache_folder() -> Path:
    """Return the folder the grids are kept in."""
    import platformdirs

    return Path(platformdirs.user_cache_dir("grasp_planner", appauthor=False)) / "distance_grids"


def _content_hash(mesh: trimesh.Trimesh, resolution: float, tolerance: float) -> str:
    """Return the hash of everything a grid depends on."""
    digest = hashlib.sha256(f"{CACHE_VERSION} {resolution!r} {tolerance!r}".encode())
    digest.update(np.ascontiguousarray(mesh.vertices, dtype=np.float64).tobytes())
    digest.update(np.ascontiguousarray(mesh.faces, dtype=np.int64).tobytes())
    return digest.hexdigest()[:32]


def _store(grid: DistanceGrid, path: Path) -> None:
    """Write a grid in one step, so that no reader ever sees half a file."""
    make_folder(path.parent)
    axes = grid.axes
    scalars = np.array([axes.resolution, axes.margin, grid.error])
    with replacing(path) as file:
        arrays = {"low": axes.low, "high": axes.high, "scalars": scalars, "coefficients": grid.coefficients}
        np.savez(file, allow_pickle=False, **arrays, checksum=_checksum(arrays.values()))


def _load(path: Path) -> DistanceGrid | None:
    """Return a stored grid; None if there is none, or it is damaged, which is a warning."""
    if not path.is_file():
        return None
    grid = _sound(path)
    if grid is None:
        warnings.warn(f"{path} is damaged; the distance grid is built anew", CacheWarning, stacklevel=3)
    return grid


def _sound(path: Path) -> DistanceGrid | None:
    """Return a stored grid; None if it is damaged."""
    try:
        with opened_file(path, MAX_ENTRY_BYTES) as file:
            _check_headers(file)
            with np.load(file, allow_pickle=False) as data:
                arrays = [data[key] for key in ("low", "high", "scalars", "coefficients")]
                if not np.array_equal(data["checksum"], _checksum(arrays)):
                    return None
        low, high, scalars, coefficients = arrays
        resolution, margin, error = scalars.tolist()
        n_x, n_y, n_z = coefficients.shape
        axes = GridAxes(low, high, resolution, int(margin), (n_x, n_y, n_z))
        expected = np.rint((high - low) / resolution).astype(int) + 2 * axes.margin + 1
        sound = coefficients.dtype == np.float32 and 0 < coefficients.size <= MAX_NODES
        sound = sound and low.shape == high.shape == (3,) and (expected == coefficients.shape).all()
        return DistanceGrid(axes, coefficients, error) if sound and np.isfinite(coefficients).all() else None
    except (
        OSError,
        FileFormatError,
        ValueError,
        KeyError,
        ArithmeticError,
        EOFError,
        MemoryError,
        NotImplementedError,
        zlib.error,
        BadZipFile,
    ):
        return None


def _check_headers(file: BinaryIO) -> None:
    """Check before anything is unpacked that the arrays of an entry are as large as they say, and not compressed.

    Raises:
        ValueError: If they are not.
    """
    with ZipFile(file) as archive:
        for info in archive.infolist():
            with archive.open(info) as array:
                if np.lib.format.read_magic(array) != (1, 0) or info.compress_type != ZIP_STORED:
                    raise ValueError(info.filename)
                shape, _, dtype = np.lib.format.read_array_header_1_0(array)
                if (
                    array.tell() + math.prod(shape) * dtype.itemsize != info.file_size
                    or info.file_size > MAX_ENTRY_BYTES
                ):
                    raise ValueError(info.filename)
    file.seek(0)


def _checksum(arrays: Iterable[npt.NDArray[np.generic]]) -> npt.NDArray[np.uint8]:
    """Return the SHA-256 of arrays, their types and shapes, of shape (32,)."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return np.frombuffer(digest.digest(), np.uint8)


def _evict(kept: Path) -> None:
    """Delete entries, those used longest ago first, until the folder keeps within its size; never the one kept."""
    now, entries = time.time(), []
    for path in kept.parent.iterdir():
        with contextlib.suppress(OSError):  # another process deletes too
            found = path.stat()
            if path.suffix == ".npz":
                entries.append((found.st_mtime, found.st_size, path))
            elif path.suffix == PART_SUFFIX and now - found.st_mtime > STALE_S:
                path.unlink(missing_ok=True)
    total = sum(size for _, size, _ in entries)
    for _, size, path in sorted(entries):
        if total <= MAX_CACHE_BYTES:
            return
        if path != kept:
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)
            total -= size
