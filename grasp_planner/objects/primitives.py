"""Round and box-shaped objects, with signed distances in closed form."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import coal
import numpy as np

from ..exceptions import InvalidValueError
from ..spatial import Array, namespace, readonly
from .base import GraspObject, SurfaceSample, check_sizes, rounded_solid, vector_lengths

if TYPE_CHECKING:
    import trimesh

ACROSS, UP = readonly([1.0, 1.0, 0.0]), readonly([0.0, 0.0, 1.0])
"""What of a vector is across the axis of a solid of revolution, and the axis."""
QUARTER_TURN = readonly([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
"""Turns what is across the axis by 90°, of rows."""


@dataclass(frozen=True, eq=False, repr=False)
class Sphere(GraspObject):
    """A ball.

    Attributes:
        radius: Radius [m].
        mass: Mass [kg].
    """

    kind: ClassVar[str] = "sphere"
    radius: float = 0.03
    mass: float = 0.2

    def __post_init__(self) -> None:
        check_sizes(self)

    def coal_geometry(self) -> Any:
        """Return the coal geometry."""
        return coal.Sphere(self.radius)

    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance; see the base class."""
        distance, gradient, hessian = vector_lengths(points, np.ones(3))
        return SurfaceSample(distance - self.radius, gradient, hessian)

    def reach(self, way: Array) -> float:
        """Return how far it reaches along a unit vector; see the base class."""
        return self.radius

    @property
    def half_extents(self) -> Array:
        """Half the edges of the bounding box [m]."""
        return np.full(3, self.radius)

    @property
    def mesh(self) -> trimesh.Trimesh:
        """Triangle mesh in O [m]."""
        import trimesh

        return trimesh.creation.icosphere(subdivisions=3, radius=self.radius)


@dataclass(frozen=True, eq=False, repr=False)
class Cylinder(GraspObject):
    """A cylinder around the z axis.

    By default fingertips may touch its side only, as in [Mavrogiannis2014]: the signed distance is that of the
    side, and :meth:`region` keeps contacts between the rims. With ``caps=1`` they may touch the caps too; the
    edges are then rounded so that normals exist everywhere.

    Attributes:
        radius: Radius [m].
        height: Height along z [m].
        mass: Mass [kg].
        caps: Whether fingertips may touch the caps (1) or the side only (0).
        edge: Radius of the rounded edges [m]; without caps, the strip at each rim that is not touched.
    """

    kind: ClassVar[str] = "cylinder"
    radius: float = 0.03
    height: float = 0.15
    mass: float = 0.2
    caps: float = 0
    edge: float = 0.002

    def __post_init__(self) -> None:
        check_sizes(self, edge_limit=lambda: min(self.radius, self.height / 2))
        if self.caps not in (0, 1):
            raise InvalidValueError("object cylinder.caps", self.caps, "0 or 1")

    @cached_property
    def solid(self) -> GraspObject:
        """The cylinder with its caps."""
        return self if self.caps else replace(self, caps=1)

    def coal_geometry(self) -> Any:
        """Return the coal geometry, with caps and rounded edges."""
        return rounded_solid(coal.Cylinder(self.radius - self.edge, self.height - 2 * self.edge), self.edge)

    @property
    def edge_radius(self) -> float:
        """Radius of the edges [m]; infinite without caps, as then the rims are not touched."""
        return self.edge if self.caps else float("inf")

    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance; see the base class."""
        # The profile in the half plane (ρ, z) is a line or a rectangle with rounded corners, revolved about z.
        xp = namespace(points)
        x, y, z = points.T
        rho = xp.sqrt(x * x + y * y)
        safe = xp.maximum(rho, 1e-12)
        radial = points * ACROSS / safe[:, None]
        tangent = radial @ QUARTER_TURN
        ring = tangent[:, :, None] * tangent[:, None, :] / safe[:, None, None]
        if not self.caps:
            return SurfaceSample(rho - self.radius, radial, ring)
        side = xp.where(z < 0.0, -1.0, 1.0)
        over = rho - (self.radius - self.edge), xp.abs(z) - (self.height / 2 - self.edge)
        distance, (by_rho, by_z), curvature = _profile(*over)
        gradient = by_rho[:, None] * radial + (by_z * side)[:, None] * UP
        # ∇²φ: ring curvature φ_ρ/ρ along the circumference, plus the curvature of the profile.
        along = (by_rho * side)[:, None] * UP - by_z[:, None] * radial
        hessian = by_rho[:, None, None] * ring
        hessian += curvature[:, None, None] * along[:, :, None] * along[:, None, :]
        return SurfaceSample(distance - self.edge, gradient, hessian)

    def region(self, points: Array) -> tuple[Array, Array]:
        """Evaluate how far points are from the rims; see the base class."""
        if self.caps:
            return super().region(points)
        limit = self.height / 2 - self.edge
        gradient = np.zeros((len(points), 2, 3))
        gradient[:, 0, 2], gradient[:, 1, 2] = -1.0, 1.0
        return namespace(points).stack([limit - points[:, 2], limit + points[:, 2]], axis=-1), gradient

    def reach(self, way: Array) -> float:
        """Return how far it reaches along a unit vector; see the base class."""
        return float(self.radius * np.hypot(way[0], way[1]) + 0.5 * self.height * abs(way[2]))

    @property
    def half_extents(self) -> Array:
        """Half the edges of the bounding box in O [m]."""
        return np.array([self.radius, self.radius, self.height / 2])

    @property
    def mesh(self) -> trimesh.Trimesh:
        """Triangle mesh in O [m]."""
        import trimesh

        return trimesh.creation.cylinder(radius=self.radius, height=self.height, sections=64)


@dataclass(frozen=True, eq=False, repr=False)
class Capsule(GraspObject):
    """A cylinder around the z axis that ends in half balls.

    Attributes:
        radius: Radius [m].
        height: Distance between the centres of the half balls [m]; 2 · radius more from end to end.
        mass: Mass [kg].
    """

    kind: ClassVar[str] = "capsule"
    radius: float = 0.03
    height: float = 0.08
    mass: float = 0.2

    def __post_init__(self) -> None:
        check_sizes(self)

    def coal_geometry(self) -> Any:
        """Return the coal geometry."""
        return coal.Capsule(self.radius, self.height)

    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance; see the base class."""
        xp = namespace(points)
        over = xp.abs(points[:, 2]) - self.height / 2
        beyond = xp.copysign(xp.maximum(over, 0.0), points[:, 2])
        arms = points * ACROSS + beyond[:, None] * UP
        axes = ACROSS + (over > 0.0)[:, None] * UP
        distance, gradient, hessian = vector_lengths(arms, axes)
        return SurfaceSample(distance - self.radius, gradient, hessian)

    def reach(self, way: Array) -> float:
        """Return how far it reaches along a unit vector; see the base class."""
        return float(self.radius + 0.5 * self.height * abs(way[2]))

    @property
    def half_extents(self) -> Array:
        """Half the edges of the bounding box [m]."""
        return np.array([self.radius, self.radius, self.height / 2 + self.radius])

    @property
    def mesh(self) -> trimesh.Trimesh:
        """Triangle mesh in O [m]."""
        import trimesh

        mesh = trimesh.creation.capsule(height=self.height, radius=self.radius, count=[32, 32])
        mesh.apply_translation(-mesh.bounds.mean(axis=0))
        return mesh


@dataclass(frozen=True, eq=False, repr=False)
class Box(GraspObject):
    """A box with rounded edges.

    Attributes:
        x: Edge along x [m].
        y: Edge along y [m].
        z: Edge along z [m].
        mass: Mass [kg].
        edge: Radius of the rounded edges [m]; under 3 mm, plans that look at real geometry keep off them.
    """

    kind: ClassVar[str] = "box"
    x: float = 0.05
    y: float = 0.05
    z: float = 0.1
    mass: float = 0.2
    edge: float = 0.001

    def __post_init__(self) -> None:
        check_sizes(self, edge_limit=lambda: min(self.x, self.y, self.z) / 2)

    def coal_geometry(self) -> Any:
        """Return the coal geometry, with rounded edges."""
        return rounded_solid(coal.Box(*(2 * (self.half_extents - self.edge))), self.edge)

    @property
    def edge_radius(self) -> float:
        """Radius of the edges [m]."""
        return self.edge

    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance; see the base class."""
        xp = namespace(points)
        over = xp.abs(points) - (self.half_extents - self.edge)
        outside = xp.maximum(over, 0.0)
        length, direction, hessian = vector_lengths(outside, (over > 0.0).astype(float))
        inside = over.max(axis=1) <= 0.0
        face = xp.take(xp.eye(3), over.argmax(axis=1), axis=0)
        sign = xp.where(points < 0.0, -1.0, 1.0)
        distance = xp.where(inside, over.max(axis=1), length) - self.edge
        gradient = xp.where(inside[:, None], face, direction) * sign
        hessian = xp.where(inside[:, None, None], 0.0, hessian) * sign[:, :, None] * sign[:, None, :]
        return SurfaceSample(distance, gradient, hessian)

    def reach(self, way: Array) -> float:
        """Return how far it reaches along a unit vector; see the base class."""
        return float((self.half_extents - self.edge) @ np.abs(way) + self.edge)

    @property
    def half_extents(self) -> Array:
        """Half the edges of the bounding box [m]."""
        return np.array([self.x, self.y, self.z]) / 2

    @property
    def mesh(self) -> trimesh.Trimesh:
        """Triangle mesh in O [m]."""
        import trimesh

        return trimesh.creation.box(extents=2 * self.half_extents)


def _profile(rho: Array, z: Array) -> tuple[Array, tuple[Array, Array], Array]:
    """Return distance, gradient and curvature of a rectangle's corner region, from the overhangs ρ and z (m,)."""
    xp = namespace(rho)
    by_rho, by_z = xp.maximum(rho, 0.0), xp.maximum(z, 0.0)
    length = xp.sqrt(by_rho * by_rho + by_z * by_z)
    safe = xp.maximum(length, 1e-12)
    most = xp.maximum(rho, z)
    inside, side_first = most <= 0.0, rho >= z
    gradient = xp.where(inside, side_first, by_rho / safe), xp.where(inside, ~side_first, by_z / safe)
    corner = (rho > 0.0) & (z > 0.0)
    return xp.where(inside, most, length), gradient, xp.where(corner, 1.0 / safe, 0.0)
