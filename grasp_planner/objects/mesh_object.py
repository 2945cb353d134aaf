"""Objects from mesh files: a solid of uniform density, with a smooth signed distance built once and cached."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import coal
import numpy as np

from ..checks import positive
from ..exceptions import InvalidValueError
from ..spatial import Array, readonly
from .base import GraspObject, SurfaceSample
from .distance_grid import DistanceGrid
from .grid_cache import cached_distance_grid
from .mesh_file import MeshWarning, read_solid

if TYPE_CHECKING:
    import trimesh

CELLS = 100
"""Grid cells along the longest side unless a resolution is given …"""
COARSEST, FINEST = 1e-3, 0.3e-3
"""… but no coarser and no finer than this [m] …"""
TOLERANCE = 0.3e-3
"""… and finer where the measured error is larger than this [m]."""
DEFAULT_MASS = 0.2
"""Mass without mass and density [kg]."""
SMALL, LARGE = 0.01, 1.0
"""Longest side of what a hand grasps [m]; outside, the unit is likely wrong."""
UNITS = {"millimetres": 1e-3, "inches": 0.0254, "centimetres": 1e-2, "metres": 1e3, "micrometres": 1e-6}
"""Units by the scale that mends them, likeliest first (``metres``: a file in metres that was scaled to mm)."""


@dataclass(frozen=True)
class MeshObject(GraspObject):
    """A solid from a mesh file. The axes of O are those of the file, the origin is the centre of mass.

    Attributes:
        path: STL, OBJ, PLY, GLB or DAE file, as given.
        scale: Factor from the unit of the file to metres.
        mass: Mass [kg]; from the density if that is given, 0.2 without either.
        density: Density [kg/m³]; None if the mass is given.
        resolution: Spacing of the distance grid [m]; None for a hundredth of the longest side, 0.3 to 1 mm, and
            finer if the distance is not exact to 0.3 mm.
        repair: Whether to mend holes, flipped triangles and overlapping parts (1) or refuse them (0).
    """

    kind: ClassVar[str] = "mesh"
    convex: ClassVar[bool] = False
    path: str = ""
    scale: float = 1.0
    mass: float = None  # type: ignore[assignment]  # a number once built
    density: float | None = None
    resolution: float | None = None
    repair: float = 0

    def __post_init__(self) -> None:
        positive("object mesh.scale", self.scale)
        if self.repair not in (0, 1):
            raise InvalidValueError("object mesh.repair", self.repair, "0 or 1")
        if self.mass is not None and self.density is not None:
            raise InvalidValueError("object mesh", "mass and density", "one of the two")
        solid = read_solid(_checked_path(self.path), repair=bool(self.repair))
        mesh = solid.mesh
        mesh.apply_scale(self.scale)
        centre = readonly(mesh.center_mass)
        mesh.apply_translation(-centre)
        _warn(self.path, solid.repairs, float(mesh.extents.max()), self.scale)
        mass = DEFAULT_MASS if self.mass is None else self.mass
        if self.density is not None:
            mass = positive("object mesh.density", self.density, unit="kg/m³") * float(mesh.volume)
        grid = self._make_grid(mesh)
        for name, value in {
            "mass": positive("object mesh.mass", mass, unit="kg"),
            "_mesh": mesh,
            "_grid": grid,
            "repairs": solid.repairs,
            "file_origin": readonly(-centre),
        }.items():
            object.__setattr__(self, name, value)

    def _make_grid(self, mesh: trimesh.Trimesh) -> DistanceGrid:
        """Return the distance grid, and warn if it could not be made as exact as wanted."""
        if self.resolution is not None:
            spacing = positive("object mesh.resolution", self.resolution, unit="m")
            return cached_distance_grid(mesh, spacing)
        spacing = float(np.clip(mesh.extents.max() / CELLS, FINEST, COARSEST))
        grid = cached_distance_grid(mesh, spacing, TOLERANCE)
        if grid.error > TOLERANCE and mesh.extents.max() <= LARGE:
            message = f"{self.path}: its distance is exact to {1e3 * grid.error:.2f} mm only (thin or sharp parts)"
            warnings.warn(message, MeshWarning, stacklevel=4)
        return grid

    _mesh: ClassVar[trimesh.Trimesh]
    _grid: ClassVar[DistanceGrid]
    repairs: ClassVar[tuple[str, ...]]
    """What was repaired, one sentence each."""
    file_origin: ClassVar[Array]
    """Origin of the file's frame in O [m], of shape (3,)."""

    @property
    def size_doubted(self) -> bool:
        """Whether its longest side is no size for a hand, of which it has warned."""
        return not SMALL <= float(self._mesh.extents.max()) <= LARGE

    def resized(self, factor: float) -> MeshObject:
        """Return the same solid with every size multiplied by a factor, and the same mass."""
        return replace(self, scale=factor * self.scale, mass=self.mass, density=None)

    def coal_geometry(self) -> Any:
        """Return the triangles as a coal geometry."""
        model = coal.BVHModelOBBRSS()
        model.beginModel(len(self._mesh.faces), len(self._mesh.vertices))
        model.addVertices(np.array(self._mesh.vertices, dtype=float))
        model.addTriangles(np.array(self._mesh.faces, dtype=np.int64))
        model.endModel()
        return model

    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance; see the base class."""
        return self._grid.sample(points)

    @property
    def distance_error(self) -> float:
        """Largest error of the signed distance on and up to 12 mm outside the surface, as measured [m]."""
        return self._grid.error

    @property
    def grid_resolution(self) -> float:
        """Spacing of the distance grid at the surface [m]."""
        return self._grid.axes.resolution

    @property
    def half_extents(self) -> Array:
        """Half the edges of the bounding box that is symmetric about the centre of mass [m]."""
        return np.abs(self._mesh.bounds).max(axis=0)

    @property
    def mesh(self) -> trimesh.Trimesh:
        """Triangle mesh in O [m], as read."""
        return self._mesh

    @property
    def text(self) -> str:
        """The text form, which ``parse_object`` reads back."""
        parts = [f"mesh:{self.path}", f"scale={self.scale:.12g}"]
        parts.append(f"mass={self.mass:.12g}" if self.density is None else f"density={self.density:.12g}")
        if self.resolution is not None:
            parts.append(f"resolution={self.resolution:.12g}")
        return ",".join([*parts, "repair=1"] if self.repair else parts)


def _checked_path(text: str) -> Path:
    """Return the path of a mesh; the text form has to be able to carry it."""
    if not text or text != text.strip() or any(sign in text for sign in ",=\n\r\0"):
        raise InvalidValueError("object mesh.path", text, "a file name without comma, equals sign or line break")
    return Path(text)


def _warn(path: str, repairs: tuple[str, ...], size: float, scale: float) -> None:
    """Warn of what was repaired, and of a size no hand can hold, with a guess at the unit."""
    for repair in repairs:
        warnings.warn(f"{path}: {repair}", MeshWarning, stacklevel=4)
    if SMALL <= size <= LARGE:
        return
    fitting = [(unit, factor) for unit, factor in UNITS.items() if 3 * SMALL <= size * factor <= LARGE / 2]
    guess = f"; in {fitting[0][0]}, scale={scale * fitting[0][1]:.6g} would fit" if fitting else ""
    warnings.warn(
        f"{path}: its longest side is {size:.3g} m, which is no size for a hand{guess}", MeshWarning, stacklevel=4
    )
