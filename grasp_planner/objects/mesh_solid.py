"""The solid of a mesh file as it is held by an object: triangles about the centre of mass and a distance grid.

Loading reads and repairs the file, builds the grid or takes it from the cache, and warns; holding it does nothing.
"""

from __future__ import annotations

import hashlib
import warnings
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import finite_array, positive
from ..exceptions import FileFormatError, InvalidValueError, NameNotFoundError, shown_path
from ..spatial import Array, Indices, readonly
from ..values import Value
from .base import SIZES
from .distance_grid import DistanceGrid
from .grid_cache import cached_distance_grid
from .groups import named_boxes
from .mesh_file import MeshWarning, declared_unit, read_solid
from .moments import parts_moments, solid_moments
from .zone import Zone

if TYPE_CHECKING:
    import trimesh

CELLS = 100
"""Grid cells along the longest side unless a resolution is given …"""
COARSEST, FINEST = 1e-3, 0.3e-3
"""… but no coarser and no finer than this [m] …"""
TOLERANCE = 0.3e-3
"""… and finer where the measured error is larger than this [m]."""
MOST_ERROR, MOST_SHARE = 0.5e-3, 0.01
"""A grid with a larger error than this [m], and than this share of the longest side, is refused unless asked for."""
MAX_SHELL = 0.1
"""Largest thickness of a wall [m]."""
UPWARDS = {
    "z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    "x": ((0, 1, 0), (0, 0, 1), (1, 0, 0)),
}
"""Rotations that turn an axis of the file to z."""
AROUND, SHOWN_PARTS = 1e-3, 5
"""How much larger the box around a named part is on every side [m], and most names that a message shows."""
SMALL, LARGE = 0.01, 1.0
"""Longest side of what a hand grasps [m]; outside, the unit is likely wrong."""
UNITS = {"millimetres": 1e-3, "inches": 0.0254, "centimetres": 1e-2, "metres": 1e3, "micrometres": 1e-6}
"""Units by the scale that mends them, likeliest first (``metres``: a file in metres that was scaled to mm)."""


@dataclass(frozen=True, eq=False, repr=False)
class MeshSolid(Value):
    """A solid loaded from a mesh file; its axes are the file's, turned if so asked, its origin the centre of mass.

    Attributes:
        path: The file, as given.
        scale: Factor from the unit of the file to metres.
        resolution: Spacing of the distance grid as asked for [m]; None if it follows from the size.
        repair: Whether holes of every size were to be closed (1) or small ones only (0).
        shell: Thickness that was given to the surface [m]; 0 for none.
        up: Axis of the file that is z of its frame.
        densities: Density of each part [kg/m³], in the order of the file; empty for uniform density.
        com_given: Whether the centre of mass was given, and is not that of uniform density.
        vertices: Vertices [m], of shape (n, 3), read-only.
        faces: Their triangles, of shape (m, 3), read-only.
        file_origin: Origin of the file's frame [m], of shape (3,).
        repairs: What was repaired, one sentence each.
        grid: Its signed distance.
        volume: Volume [m³].
        gyration: Inertia per mass about the centre of mass of density or densities [m²], of shape (3, 3).
        parts_mass: Mass by the densities of the parts [kg]; 0 without.
    """

    path: str
    scale: float
    resolution: float | None
    repair: float
    shell: float
    up: str
    densities: tuple[float, ...]
    com_given: bool
    vertices: Array
    faces: Indices
    file_origin: Array
    repairs: tuple[str, ...]
    grid: DistanceGrid
    volume: float
    gyration: Array
    parts_mass: float = 0.0

    def _content(self) -> dict[str, Any]:
        """Return what it was loaded from and a hash of its triangles; its grid follows from these."""
        digest = hashlib.sha256(self.vertices.tobytes() + self.faces.tobytes()).hexdigest()
        found = {name: value for name, value in super()._content().items() if name not in ("vertices", "faces", "grid")}
        return found | {"triangles": digest, "error": self.grid.error}

    def __repr__(self) -> str:
        return f"MeshSolid({self.path!r}, {len(self.faces)} triangles)"

    @property
    def mesh(self) -> trimesh.Trimesh:
        """The triangles as a new mesh."""
        import trimesh

        return trimesh.Trimesh(vertices=np.array(self.vertices), faces=np.array(self.faces), process=False)

    @cached_property
    def bounds(self) -> Array:
        """Lower and upper corner of the bounding box [m], of shape (2, 3)."""
        return readonly([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    @cached_property
    def longest_side(self) -> float:
        """Longest side of the bounding box [m]."""
        return float((self.bounds[1] - self.bounds[0]).max())


def load_mesh_solid(
    path: str | Path,
    *,
    scale: float | None = None,
    resolution: float | None = None,
    repair: float = 0,
    shell: float = 0.0,
    com: tuple[float, float, float] | None = None,
    densities: tuple[float, ...] = (),
    up: str = "z",
) -> MeshSolid:
    """Load a solid from a mesh file; takes seconds the first time, when its distance grid is built.

    Warns with :class:`MeshWarning` of what was done to its triangles, of a size that is none for a hand, and of a
    distance that is not as exact as wanted.

    Args:
        path: STL, OBJ, PLY, GLB or DAE file.
        scale: Factor from the unit of the file to metres; None for the unit it declares (COLLADA), or metres.
        resolution: Spacing of the distance grid [m]; None for a hundredth of the longest side, 0.3 to 1 mm, and
            finer if the distance is not exact to 0.3 mm.
        repair: Whether to close holes of every size (1) or small ones only (0).
        shell: Thickness that the surface is given [m], half on each side; 0 for none.
        com: Centre of mass in the file's frame [m]; None for that of uniform density.
        densities: Density of each part [kg/m³], in the order of the file; where parts overlap, the first counts.
        up: Axis of the file, x, y or z, that becomes z of its frame: where a file stands upright along another.

    Returns:
        The solid.

    Raises:
        InvalidValueError: If a number is out of range, or the text form can't carry the path.
        FileFormatError: If the file can't be read or is no solid.
    """
    text = str(path)
    source = _checked_path(text)
    scale = declared_unit(source) if scale is None else positive("object mesh.scale", scale)
    if up not in UPWARDS:
        raise InvalidValueError("object mesh.up", up, f"one of {', '.join(UPWARDS)}")
    if repair not in (0, 1):
        raise InvalidValueError("object mesh.repair", repair, "0 or 1")
    shell = positive("object mesh.shell", shell, zero_allowed=True, unit="m", at_most=MAX_SHELL)
    solid = read_solid(source, repair=bool(repair), shell=shell / scale)
    mesh = _placed(solid.mesh, scale, up)
    if not SIZES[0] <= (extent := float(mesh.extents.max())) <= SIZES[1]:
        raise FileFormatError(text, f"is {extent:.3g} m long with this scale, allowed: {SIZES[0]:g} to {SIZES[1]:g} m")
    volume, centre, gyration = solid_moments(mesh, overlapping=solid.overlapping)
    parts_mass = 0.0
    if len(densities):
        parts_mass, centre, gyration = _by_parts([_placed(part, scale, up) for part in solid.parts], densities, com)
    elif com is not None:
        centre = _checked_centre(com, mesh)
    mesh.apply_translation(-centre)
    _warn(text, solid.repairs, float(mesh.extents.max()), scale)
    return MeshSolid(
        path=text,
        scale=float(scale),
        resolution=resolution,
        repair=repair,
        shell=shell,
        up=up,
        densities=tuple(map(float, densities)),
        com_given=com is not None,
        vertices=np.array(mesh.vertices, dtype=float),
        faces=np.array(mesh.faces, dtype=np.int64),
        file_origin=readonly(-centre),
        repairs=solid.repairs,
        grid=_distance_grid(text, mesh, resolution),
        volume=volume,
        gyration=gyration,
        parts_mass=parts_mass,
    )


def _placed(mesh: trimesh.Trimesh, scale: float, up: str) -> trimesh.Trimesh:
    """Return a mesh of a file in metres, one of its axes turned to z."""
    mesh.apply_scale(scale)
    mesh.vertices = np.asarray(mesh.vertices) @ np.array(UPWARDS[up], dtype=float).T
    return mesh


def zone_of(solid: MeshSolid, text: str, allowed: bool) -> Zone:
    """Return the zone of a text: a box or ball by its numbers, or the box around a named part of the file.

    Args:
        solid: The solid of the file.
        text: As :meth:`Zone.parse` reads it, or a name.
        allowed: Whether contacts have to be inside; outside otherwise.

    Raises:
        InvalidValueError: If it is neither.
        NameNotFoundError: If the file has no part of that name.
    """
    if "," in text or not text:
        return Zone.parse(text, allowed)
    boxes = named_boxes(Path(solid.path))
    if text not in boxes:
        kind = f"part for {'region' if allowed else 'forbid'} in {shown_path(Path(solid.path).name)}"
        raise NameNotFoundError(kind, text, list(boxes)[:SHOWN_PARTS])
    corners = solid.scale * boxes[text] @ np.array(UPWARDS[solid.up], dtype=float).T
    low, high = corners.min(axis=0) - AROUND, corners.max(axis=0) + AROUND
    return Zone("box", np.concatenate([low, high]), allowed, text)


def _by_parts(parts: list[trimesh.Trimesh], densities: tuple[float, ...], com: object) -> tuple[float, Array, Array]:
    """Return mass, centre and inertia per mass of parts with densities, after checks."""
    name = "object mesh.densities"
    if com is not None:
        raise InvalidValueError(name, densities, "densities or com, one of the two")
    if any(part.volume <= 0.0 for part in parts):
        raise InvalidValueError(name, densities, "parts without cavities and folds")
    if len(densities) != len(parts):
        raise InvalidValueError(name, densities, f"{len(parts)} numbers, one for each part in the order of the file")
    given = tuple(positive(name, density, unit="kg/m³") for density in densities)
    try:
        return parts_moments(parts, given)
    except ValueError:
        raise InvalidValueError(name, densities, "parts that can be told apart where they overlap") from None


def _distance_grid(path: str, mesh: trimesh.Trimesh, resolution: float | None) -> DistanceGrid:
    """Return the distance grid, and warn if it could not be made as exact as wanted."""
    if resolution is not None:
        return cached_distance_grid(mesh, positive("object mesh.resolution", resolution, unit="m"))
    spacing = float(np.clip(mesh.extents.max() / CELLS, FINEST, COARSEST))
    grid = cached_distance_grid(mesh, spacing, TOLERANCE)
    allowed = max(MOST_ERROR, MOST_SHARE * float(mesh.extents.max()))
    if grid.error > allowed:
        reason = f"its distance is exact to {1e3 * grid.error:.2g} mm only, {1e3 * allowed:.2g} mm are allowed"
        raise FileFormatError(path, f"{reason}; resolution={grid.axes.resolution / 2:.1g} is finer")
    if grid.error > TOLERANCE and mesh.extents.max() <= LARGE:
        message = f"{shown_path(path)}: its distance is exact to {1e3 * grid.error:.2f} mm only (thin or sharp parts)"
        warnings.warn(message, MeshWarning, stacklevel=4)
    return grid


def _checked_centre(com: tuple[float, float, float], mesh: trimesh.Trimesh) -> Array:
    """Return a centre of mass; that of any body is in the box around it."""
    given = finite_array("object mesh.com", com, (3,))
    if not ((mesh.bounds[0] <= given) & (given <= mesh.bounds[1])).all():
        low, high = (", ".join(f"{x:.4g}" for x in corner) for corner in mesh.bounds)
        raise InvalidValueError("object mesh.com", com, f"three lengths between ({low}) and ({high}) m")
    return readonly(given)


def _checked_path(text: str) -> Path:
    """Return the path of a mesh; the text form has to be able to carry it."""
    if not text or text != text.strip() or any(sign in text for sign in "=\n\r\0"):
        raise InvalidValueError("object mesh.path", text, "a file name without equals sign or line break")
    return Path(text)


def _warn(path: str, repairs: tuple[str, ...], size: float, scale: float) -> None:
    """Warn of what was repaired, and of a size no hand can hold, with a guess at the unit."""
    for repair in repairs:
        warnings.warn(f"{shown_path(path)}: {repair}", MeshWarning, stacklevel=4)
    if SMALL <= size <= LARGE:
        return
    fitting = [
        f"in {unit}, scale={scale * factor:.6g}"
        for unit, factor in UNITS.items()
        if 3 * SMALL <= size * factor <= LARGE / 2
    ]
    guess = f"; {' or '.join(fitting[:2])} would fit" if fitting else ""
    message = f"{shown_path(path)}: its longest side is {size:.3g} m, which is no size for a hand{guess}"
    warnings.warn(message, MeshWarning, stacklevel=4)
