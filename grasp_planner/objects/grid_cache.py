"""Distance grids on disk, by the content of the mesh: numbers only, never pickles, never trusted blindly."""

from __future__ import annotations

import contextlib
import hashlib
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..exceptions import FileFormatError
from ..files.writing import make_folder, replacing
from .distance_grid import MAX_NODES, DistanceGrid, GridAxes, build_distance_grid

if TYPE_CHECKING:
    import trimesh

CACHE_VERSION = 3
"""Raised whenever grids are built in another way."""


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
    if grid is None:
        grid = build_distance_grid(mesh, resolution, tolerance)
        with contextlib.suppress(FileFormatError):  # no cache is slower, not wrong
            _store(grid, path)
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
        np.savez(file, low=axes.low, high=axes.high, scalars=scalars, coefficients=grid.coefficients)


def _load(path: Path) -> DistanceGrid | None:
    """Return a stored grid; None if there is none or it is damaged."""
    if not path.is_file():
        return None
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            low, high, scalars, coefficients = (data[key] for key in ("low", "high", "scalars", "coefficients"))
        resolution, margin, error = scalars.tolist()
        n_x, n_y, n_z = coefficients.shape
        axes = GridAxes(low, high, resolution, int(margin), (n_x, n_y, n_z))
        expected = np.rint((high - low) / resolution).astype(int) + 2 * axes.margin + 1
        sound = coefficients.dtype == np.float32 and 0 < coefficients.size <= MAX_NODES
        sound = sound and low.shape == high.shape == (3,) and (expected == coefficients.shape).all()
        return DistanceGrid(axes, coefficients, error) if sound and np.isfinite(coefficients).all() else None
    except (OSError, ValueError, KeyError, ArithmeticError, EOFError, zipfile.BadZipFile):
        return None
