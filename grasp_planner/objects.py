"""What is grasped: a signed distance with gradient and Hessian, a mass, and the text form ``shape:key=value,…``.

Everything is in the object frame O: origin at the centre of mass, axes fixed to the object.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar

import coal
import numpy as np

from .exceptions import InvalidValueError, NameNotFoundError
from .spatial import Array, positive


@dataclass(frozen=True)
class SurfaceSample:
    """The signed distance at n points.

    Attributes:
        distance: φ, negative inside [m], of shape (n,).
        gradient: ∇φ, the outward direction, of shape (n, 3).
        hessian: ∇²φ, the curvature [1/m], of shape (n, 3, 3).
    """

    distance: Array
    gradient: Array
    hessian: Array


@dataclass(frozen=True)
class GraspObject(ABC):
    """An object with a smooth surface and a mass [kg].

    Subclasses give the signed distance; its gradient has length one wherever it is differentiable.
    """

    kind: ClassVar[str]
    convex: ClassVar[bool] = True

    @property
    @abstractmethod
    def mass(self) -> float:
        """Mass [kg]."""

    @property
    def solid(self) -> GraspObject:
        """The body that links have to keep clear of: the object itself, unless only part of it may be touched."""
        return self

    def coal_geometry(self) -> Any:
        """Return the exact solid as a coal geometry in O, for checks independent of :meth:`sample`.

        Raises:
            InvalidValueError: If its kind has none.
        """
        raise InvalidValueError("object", self.kind, "an object with a coal geometry")

    @abstractmethod
    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance with gradient and Hessian.

        Args:
            points: Points in O [m], of shape (n, 3).

        Returns:
            Distance, gradient and Hessian at the points.
        """

    def region(self, points: Array) -> tuple[Array, Array]:
        """Evaluate the limits of the surface that may be touched.

        Args:
            points: Contact points in O [m], of shape (n, 3).

        Returns:
            Margins [m], not negative where contact is allowed, of shape (n, k), and their gradients, of shape
            (n, k, 3); k = 0 where the whole surface may be touched.
        """
        return np.zeros((len(points), 0)), np.zeros((len(points), 0, 3))

    @property
    @abstractmethod
    def half_extents(self) -> Array:
        """Half the edges of the bounding box in O [m], of shape (3,)."""

    @property
    def length_scale(self) -> float:
        """A characteristic length [m]: the smallest half extent."""
        return float(self.half_extents.min())

    def resized(self, factor: float) -> GraspObject:
        """Return the same shape with every size multiplied by a factor, and the same mass."""
        sizes = {f.name: factor * getattr(self, f.name) for f in fields(self) if f.name not in ("mass", "caps")}
        return replace(self, **sizes)

    @property
    def text(self) -> str:
        """The text form, which :func:`parse_object` reads back."""
        values = (f"{f.name}={getattr(self, f.name):.12g}" for f in fields(self))
        return f"{self.kind}:{','.join(values)}"


@dataclass(frozen=True)
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
        _check_sizes(self)

    def coal_geometry(self) -> Any:
        """Return the coal geometry."""
        return coal.Sphere(self.radius)

    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance; see the base class."""
        distance, gradient, hessian = _rounded(points, np.ones(3))
        return SurfaceSample(distance - self.radius, gradient, hessian)

    @property
    def half_extents(self) -> Array:
        """Half the edges of the bounding box [m]."""
        return np.full(3, self.radius)


@dataclass(frozen=True)
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
        _check_sizes(self, edge_limit=min(self.radius, self.height / 2))
        if self.caps not in (0, 1):
            raise InvalidValueError("object cylinder.caps", self.caps, "0 or 1")

    @property
    def solid(self) -> GraspObject:
        """The cylinder with its caps."""
        return self if self.caps else replace(self, caps=1)

    def coal_geometry(self) -> Any:
        """Return the coal geometry, with caps and rounded edges."""
        return _rounded_solid(coal.Cylinder(self.radius - self.edge, self.height - 2 * self.edge), self.edge)

    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance; see the base class."""
        # The profile in the half plane (ρ, z) is a line or a rectangle with rounded corners, revolved about z.
        x, y, z = points.T
        rho = np.sqrt(x * x + y * y)
        safe = np.maximum(rho, 1e-12)
        zero = np.zeros_like(x)
        radial = np.stack([x / safe, y / safe, zero], axis=-1)
        tangent = np.stack([-radial[:, 1], radial[:, 0], zero], axis=-1)
        ring = tangent[:, :, None] * tangent[:, None, :] / safe[:, None, None]
        if not self.caps:
            return SurfaceSample(rho - self.radius, radial, ring)
        side = np.where(z < 0.0, -1.0, 1.0)
        over = np.stack([rho - (self.radius - self.edge), np.abs(z) - (self.height / 2 - self.edge)], axis=-1)
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

    @property
    def half_extents(self) -> Array:
        """Half the edges of the bounding box in O [m]."""
        return np.array([self.radius, self.radius, self.height / 2])


@dataclass(frozen=True)
class Box(GraspObject):
    """A box with rounded edges.

    Attributes:
        x: Edge along x [m].
        y: Edge along y [m].
        z: Edge along z [m].
        mass: Mass [kg].
        edge: Radius of the rounded edges [m].
    """

    kind: ClassVar[str] = "box"
    x: float = 0.05
    y: float = 0.05
    z: float = 0.1
    mass: float = 0.2
    edge: float = 0.005

    def __post_init__(self) -> None:
        _check_sizes(self, edge_limit=min(self.x, self.y, self.z) / 2)

    def coal_geometry(self) -> Any:
        """Return the coal geometry, with rounded edges."""
        return _rounded_solid(coal.Box(*(2 * (self.half_extents - self.edge))), self.edge)

    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance; see the base class."""
        over = np.abs(points) - (self.half_extents - self.edge)
        outside = np.maximum(over, 0.0)
        length, direction, hessian = _rounded(outside, (over > 0.0).astype(float))
        inside = over.max(axis=1) <= 0.0
        face = np.eye(3)[np.argmax(over, axis=1)]
        sign = np.where(points < 0.0, -1.0, 1.0)
        distance = np.where(inside, over.max(axis=1), length) - self.edge
        gradient = np.where(inside[:, None], face, direction) * sign
        hessian = np.where(inside[:, None, None], 0.0, hessian) * sign[:, :, None] * sign[:, None, :]
        return SurfaceSample(distance, gradient, hessian)

    @property
    def half_extents(self) -> Array:
        """Half the edges of the bounding box [m]."""
        return np.array([self.x, self.y, self.z]) / 2


SHAPES: dict[str, type[GraspObject]] = {shape.kind: shape for shape in (Sphere, Cylinder, Box)}
"""Shapes by the name used in the text form."""


def parse_object(text: str) -> GraspObject:
    """Return the object of a text such as ``cylinder:radius=0.03,height=0.15,mass=0.2``.

    Args:
        text: Shape name, optionally followed by a colon and comma-separated ``key=value`` pairs in SI units.

    Returns:
        The object; keys left out have their defaults.

    Raises:
        NameNotFoundError: If the shape or a key does not exist.
        InvalidValueError: If a value is not a positive number, or a key is given twice.
    """
    kind, _, rest = text.strip().partition(":")
    if kind not in SHAPES:
        raise NameNotFoundError("object shape", kind, SHAPES)
    shape = SHAPES[kind]
    known = tuple(field.name for field in fields(shape))
    values: dict[str, float] = {}
    for part in filter(None, rest.split(",")):
        key, equals, number = (piece.strip() for piece in part.partition("="))
        if not equals:
            raise InvalidValueError(f"object {kind}", part, f"key=value with a key out of {', '.join(known)}")
        if key not in known:
            raise NameNotFoundError(f"key of object {kind}", key, known)
        if key in values:
            raise InvalidValueError(f"object {kind}.{key}", part, "a key given once")
        try:
            values[key] = float(number)
        except ValueError:
            raise InvalidValueError(f"object {kind}.{key}", number, "a number in SI units") from None
    return shape(**values)


def _check_sizes(shape: GraspObject, edge_limit: float = np.inf) -> None:
    """Check every size and the mass of a shape to be positive, and the edge radius to fit."""
    for field in fields(shape):
        value = getattr(shape, field.name)
        name = f"object {shape.kind}.{field.name}"
        if field.name == "edge":
            if not 1e-6 <= positive(name, value) <= edge_limit:
                raise InvalidValueError(name, value, f"between 1e-06 and {edge_limit:g} m")
        else:
            positive(name, value, zero_allowed=field.name == "caps", unit="kg" if field.name == "mass" else "m")


def _rounded_solid(core: Any, edge: float) -> Any:
    """Return a coal geometry swept by a sphere of a radius [m]."""
    core.setSweptSphereRadius(edge)
    return core


def _rounded(points: Array, axes: Array) -> tuple[Array, Array, Array]:
    """Return length, direction and Hessian of the length of vectors, over the axes that count."""
    length = np.sqrt((points * points).sum(axis=1))
    safe = np.maximum(length, 1e-12)
    direction = points / safe[:, None]
    identity = np.eye(3) * np.broadcast_to(axes, points.shape)[:, None, :]
    hessian = (identity - direction[:, :, None] * direction[:, None, :]) / safe[:, None, None]
    return length, direction, hessian


def _profile(over: Array) -> tuple[Array, tuple[Array, Array], Array]:
    """Return distance, gradient and curvature of a rectangle's corner region, from the overhangs (ρ, z)."""
    outside = np.maximum(over, 0.0)
    length = np.hypot(outside[:, 0], outside[:, 1])
    safe = np.maximum(length, 1e-12)
    inside = over.max(axis=1) <= 0.0
    side_first = over[:, 0] >= over[:, 1]
    distance = np.where(inside, over.max(axis=1), length)
    by_rho = np.where(inside, side_first, outside[:, 0] / safe)
    by_z = np.where(inside, ~side_first, outside[:, 1] / safe)
    corner = (over > 0.0).all(axis=1)
    return distance, (by_rho, by_z), np.where(corner, 1.0 / safe, 0.0)
