"""Round and box-shaped objects, with signed distances in closed form."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import coal
import numpy as np

from ..exceptions import InvalidValueError
from ..spatial import Array
from .base import GraspObject, SurfaceSample, check_sizes, rounded_solid, vector_lengths

if TYPE_CHECKING:
    import trimesh


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

    @property
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
        x, y, z = points.T
        rho = np.sqrt(x * x + y * y)
        safe = np.maximum(rho, 1e-12)
        radial, tangent = np.zeros((2, len(points), 3))
        tangent[:, 1] = radial[:, 0] = x / safe
        radial[:, 1] = y / safe
        tangent[:, 0] = -radial[:, 1]
        ring = tangent[:, :, None] * tangent[:, None, :] / safe[:, None, None]
        if not self.caps:
            return SurfaceSample(rho - self.radius, radial, ring)
        side = np.where(z < 0.0, -1.0, 1.0)
        over = np.array([rho - (self.radius - self.edge), np.abs(z) - (self.height / 2 - self.edge)])
        distance, (by_rho, by_z), curvature = _profile(over)
        gradient = by_rho[:, None] * radial
        gradient[:, 2] = by_z * side
        # ∇²φ: ring curvature φ_ρ/ρ along the circumference, plus the curvature of the profile.
        along = -by_z[:, None] * radial
        along[:, 2] = by_rho * side
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
        return np.stack([limit - points[:, 2], limit + points[:, 2]], axis=-1), gradient

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
        over = np.abs(points[:, 2]) - self.height / 2
        arms = np.array(points)
        arms[:, 2] = np.where(over > 0.0, np.copysign(over, points[:, 2]), 0.0)
        axes = np.ones_like(points)
        axes[:, 2] = over > 0.0
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
        over = np.abs(points) - (self.half_extents - self.edge)
        outside = np.maximum(over, 0.0)
        length, direction, hessian = vector_lengths(outside, (over > 0.0).astype(float))
        inside = over.max(axis=1) <= 0.0
        face = np.eye(3)[np.argmax(over, axis=1)]
        sign = np.where(points < 0.0, -1.0, 1.0)
        distance = np.where(inside, over.max(axis=1), length) - self.edge
        gradient = np.where(inside[:, None], face, direction) * sign
        hessian = np.where(inside[:, None, None], 0.0, hessian) * sign[:, :, None] * sign[:, None, :]
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


def _profile(over: Array) -> tuple[Array, tuple[Array, Array], Array]:
    """Return distance, gradient and curvature of a rectangle's corner region, from the overhangs (ρ, z) (2, m)."""
    outside = np.maximum(over, 0.0)
    length = np.sqrt(outside[0] * outside[0] + outside[1] * outside[1])
    safe = np.maximum(length, 1e-12)
    most = np.maximum(over[0], over[1])
    inside, side_first = most <= 0.0, over[0] >= over[1]
    by_rho = np.where(inside, side_first, outside[0] / safe)
    by_z = np.where(inside, ~side_first, outside[1] / safe)
    corner = (over[0] > 0.0) & (over[1] > 0.0)
    return np.where(inside, most, length), (by_rho, by_z), np.where(corner, 1.0 / safe, 0.0)
