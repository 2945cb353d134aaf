"""Objects from mesh files: a solid of uniform density, its smooth signed distance, a mass and a size."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import coal
import numpy as np

from ..checks import positive
from ..exceptions import InvalidValueError
from ..spatial import Array, readonly
from ..values import exact_text
from .base import MASSES, GraspObject, SurfaceSample
from .mesh_solid import LARGE, SMALL, MeshSolid, load_mesh_solid, zone_of
from .normal_spread import normal_spread
from .patches import opposed_patches
from .pressure_limit import PressureLimit
from .triangles import NearestPoints, Triangles
from .zone import Zone

if TYPE_CHECKING:
    import trimesh

DEFAULT_MASS = 0.2
"""Mass without mass and density [kg]."""


@dataclass(frozen=True, eq=False, repr=False)
class MeshObject(GraspObject):
    """A solid from a mesh file; :meth:`load` loads one. The axes of O are those of the file.

    Resizing takes the same distance: φ_s(x) = s φ(x / s) has the same gradient, and its Hessian is divided by s.

    Attributes:
        loaded: The solid as loaded.
        mass: Mass [kg].
        size: Factor by which the solid is larger than loaded.
        max_normal_force: Largest normal force of a contact that it bears [N].
        zones: Where it may be touched, and where not.
        pressure_limit: Largest pressure of a contact that it bears; None for no limit.
    """

    kind: ClassVar[str] = "mesh"
    convex: ClassVar[bool] = False
    loaded: MeshSolid
    mass: float = DEFAULT_MASS
    size: float = 1.0
    max_normal_force: float = np.inf
    zones: tuple[Zone, ...] = ()
    pressure_limit: PressureLimit | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.loaded, MeshSolid):
            raise InvalidValueError("object mesh.loaded", self.loaded, "a loaded solid; MeshObject.load reads a file")
        object.__setattr__(self, "mass", positive("object mesh.mass", self.mass, unit="kg", at_most=MASSES[1]))
        object.__setattr__(self, "size", positive("object mesh.size", self.size))
        limit = self.max_normal_force
        limit = limit if limit == np.inf else positive("object mesh.max_normal", limit, unit="N")
        object.__setattr__(self, "max_normal_force", limit)
        object.__setattr__(self, "zones", tuple(self.zones))

    @classmethod
    def load(
        cls,
        path: str | Path,
        *,
        scale: float | None = None,
        mass: float | None = None,
        density: float | None = None,
        resolution: float | None = None,
        repair: float = 0,
        shell: float = 0.0,
        com: tuple[float, float, float] | None = None,
        densities: tuple[float, ...] = (),
        up: str = "z",
        max_normal: float | None = None,
        max_pressure: float | None = None,
        modulus: float | None = None,
        curvature_radius: float | None = None,
        region: str | None = None,
        forbid: str | None = None,
        size: float = 1.0,
    ) -> MeshObject:
        """Load an object from a mesh file.

        Args:
            path: STL, OBJ, PLY, GLB or DAE file.
            scale: Factor from the unit of the file to metres; None for the unit it declares (COLLADA), or metres.
            mass: Mass [kg]; from the density if that is given, 0.2 without either.
            density: Density [kg/m³].
            resolution: Spacing of the distance grid [m]; see :func:`load_mesh_solid`.
            repair: Whether to close holes of every size (1) or small ones only (0).
            shell: Thickness that the surface is given [m], half on each side: for sheets and open scans.
            com: Centre of mass in the file's frame, before size [m]; None for that of uniform density.
            densities: Density of each part [kg/m³], in the order of the file: centre of mass and inertia follow,
                and the mass if none is given.
            up: Axis of the file, x, y or z, that becomes z of its frame.
            max_normal: Largest normal force of a contact [N], of what is soft or breaks; None for no limit of its own.
            max_pressure: Largest pressure in the middle of a contact [Pa], see :class:`PressureLimit`, as the next two.
            modulus: Contact modulus of object and fingertip [Pa].
            curvature_radius: Smallest radius of curvature where it is touched [m]; None for flat.
            region: Where alone it may be touched, as :meth:`Zone.parse` reads it, or a named part of the file; None for
                anywhere.
            forbid: Where it may not be touched.
            size: Factor by which the solid is enlarged once it is loaded; its distance grid is scaled with it.

        Returns:
            The object.

        Raises:
            InvalidValueError: If a number is out of range, or mass and density are both given.
            FileFormatError: If the file can't be read or is no solid.
        """
        if mass is not None and density is not None:
            raise InvalidValueError("object mesh", "mass and density", "one of the two")
        if density is not None and len(densities):
            raise InvalidValueError("object mesh", "density and densities", "one of the two")
        given: dict[str, Any] = {"repair": repair, "shell": shell, "com": com, "densities": densities, "up": up}
        loaded = load_mesh_solid(path, scale=scale, resolution=resolution, **given)
        asked = ((region, True), (forbid, False))
        zones = tuple(zone_of(loaded, text, allowed) for text, allowed in asked if text is not None)
        if mass is None and loaded.densities:
            mass = loaded.parts_mass * size**3
        if density is not None:
            mass = positive("object mesh.density", density, unit="kg/m³") * loaded.volume * size**3
        mass, limit = DEFAULT_MASS if mass is None else mass, np.inf if max_normal is None else max_normal
        soft = PressureLimit.of_keys(max_pressure, modulus, curvature_radius)
        return cls(loaded, mass, size, limit, zones, soft)

    @property
    def path(self) -> str:
        """The file, as given."""
        return self.loaded.path

    @property
    def repairs(self) -> tuple[str, ...]:
        """What was done to its triangles, one line each."""
        return self.loaded.repairs

    @property
    def file_origin(self) -> Array:
        """Origin of the file's frame in O [m], of shape (3,)."""
        return readonly(self.size * self.loaded.file_origin)

    @property
    def size_doubted(self) -> bool:
        """Whether its longest side is no size for a hand, of which it has warned."""
        return not SMALL <= self.size * self.loaded.longest_side <= LARGE

    def resized(self, factor: float) -> MeshObject:
        """Return the same solid with every size multiplied by a factor, and the same mass."""
        soft = None if self.pressure_limit is None else self.pressure_limit.resized(factor)
        return replace(self, size=factor * self.size, pressure_limit=soft)

    def coal_geometry(self) -> Any:
        """Return the triangles as a coal geometry, made once."""
        return self._bounding_volumes

    @cached_property
    def _bounding_volumes(self) -> Any:
        """The triangles in a tree of bounding volumes."""
        model = coal.BVHModelOBBRSS()
        model.beginModel(len(self.loaded.faces), len(self.loaded.vertices))
        model.addVertices(self.size * self.loaded.vertices)
        model.addTriangles(np.array(self.loaded.faces))
        model.endModel()
        return model

    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance; see the base class."""
        found, size = self.loaded.grid.sample(points / self.size), self.size
        return SurfaceSample(size * found.distance, found.gradient, found.hessian / size)

    @property
    def edge_radius(self) -> float:
        """Triangles have sharp edges."""
        return 0.0

    def bearable_force(self, radius: float) -> float:
        """Return the largest normal force that it bears; see the base class."""
        by_pressure = np.inf if self.pressure_limit is None else self.pressure_limit.largest_force(radius)
        return min(self.max_normal_force, by_pressure)

    def nearest(self, points: Array) -> NearestPoints:
        """Return the nearest points of the triangles themselves; see the base class."""
        return self._triangles.nearest(points)

    def normal_spread(self, points: Array, radius: float) -> Array:
        """Return the spread of the triangles' normals; see the base class."""
        return normal_spread(self._triangles, points, radius)

    @cached_property
    def _triangles(self) -> Triangles:
        """The triangles in O."""
        return Triangles.of(self.mesh)

    def region(self, points: Array) -> tuple[Array, Array]:
        """Evaluate how far points are inside the zones that may be touched; see the base class."""
        if not self.zones:
            return super().region(points)
        margins, slopes = zip(*(zone.margins(self._in_file(points)) for zone in self.zones), strict=True)
        return self.size * np.hstack(margins), np.concatenate(slopes, axis=1)

    def _in_file(self, points: Array) -> Array:
        """Return points of O in the frame of the file, before the size [m]."""
        return points / self.size - self.loaded.file_origin

    def opposed_patches(self) -> tuple[Array, Array]:
        """Return points between smooth patches that face away from each other; see the base class."""
        return self._patches

    @cached_property
    def _patches(self) -> tuple[Array, Array]:
        """What is found once."""
        points, across = opposed_patches(self.mesh, self.field)
        kept = (self.region(points)[0] >= 0.0).all(axis=1)
        return points[kept], across[kept]

    @property
    def grasped_in_part(self) -> bool:
        """Whether only part of it may be touched."""
        return bool(self.zones)

    @property
    def distance_error(self) -> float:
        """Largest error of the signed distance on and up to 12 mm outside the surface, as measured [m]."""
        return self.size * self.loaded.grid.error

    @property
    def grid_resolution(self) -> float:
        """Spacing of the distance grid at the surface [m]."""
        return self.size * self.loaded.grid.axes.resolution

    @property
    def blur(self) -> float:
        """The spline's cubes are as wide as the spacing of its grid [m]."""
        return self.grid_resolution

    @property
    def half_extents(self) -> Array:
        """Half the edges of the bounding box that is symmetric about the centre of mass [m]."""
        return self.size * np.abs(self.loaded.bounds).max(axis=0)

    @property
    def inertia(self) -> Array:
        """Inertia about the centre of mass [kg m²], of shape (3, 3); beside a given one, about its own centre."""
        return readonly(self.mass * self.size**2 * self.loaded.gyration)

    @property
    def mesh(self) -> trimesh.Trimesh:
        """Triangle mesh in O [m], as read."""
        mesh = self.loaded.mesh
        mesh.vertices = self.size * self.loaded.vertices
        return mesh

    @classmethod
    def text_keys(cls) -> tuple[str, ...]:
        """Return the keys of the text form: the arguments of :meth:`load`."""
        sizes = ("path", "scale", "mass", "density", "resolution", "repair", "shell", "com", "densities")
        return (*sizes, "up", "max_normal", "max_pressure", "modulus", "curvature_radius", "region", "forbid", "size")

    @classmethod
    def of_values(cls, values: dict[str, Any]) -> MeshObject:
        """Load the object of the entries of a text form."""
        return cls.load(**values)

    @property
    def text(self) -> str:
        """The text form, which ``parse_object`` reads back; of a density it names the mass that follows."""
        parts = [f"mesh:{self.path}", f"scale={exact_text(self.loaded.scale)}", f"mass={exact_text(self.mass)}"]
        if self.loaded.resolution is not None:
            parts.append(f"resolution={exact_text(self.loaded.resolution)}")
        if self.size != 1.0:
            parts.append(f"size={exact_text(self.size)}")
        if self.loaded.shell:
            parts.append(f"shell={exact_text(self.loaded.shell)}")
        if self.loaded.up != "z":
            parts.append(f"up={self.loaded.up}")
        if self.loaded.densities:
            parts.append("densities=" + ",".join(exact_text(each) for each in self.loaded.densities))
        if self.max_normal_force < np.inf:
            parts.append(f"max_normal={exact_text(self.max_normal_force)}")
        if self.pressure_limit is not None:
            parts.append(self.pressure_limit.text)
        parts += [f"{zone.key}={zone.text}" for zone in self.zones]
        if self.loaded.com_given:
            parts.append("com=" + ",".join(exact_text(x) for x in -self.loaded.file_origin))
        return ",".join([*parts, "repair=1"] if self.loaded.repair else parts)
