"""The protocol of objects: a signed distance with gradient and Hessian, a mass, a mesh and a text form.

Everything is in the object frame O: origin at the centre of mass, axes fixed to the object.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..checks import positive
from ..exceptions import InvalidValueError
from ..spatial import Array, namespace, readonly
from ..values import Value, exact_text
from .triangles import NearestPoints

if TYPE_CHECKING:
    import trimesh


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


@dataclass(frozen=True, eq=False, repr=False)
class GraspObject(Value, ABC):
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

    @property
    def size_doubted(self) -> bool:
        """Whether it has itself warned of a size that is none for a hand."""
        return False

    @property
    def distance_error(self) -> float:
        """Largest error of :meth:`sample`'s distance near the surface against the exact solid [m]."""
        return 0.0

    @property
    def blur(self) -> float:
        """How far from a sharp edge of the exact solid :meth:`sample` rounds it [m]."""
        return 0.0

    @abstractmethod
    def coal_geometry(self) -> Any:
        """Return the exact solid as a coal geometry in O, for checks independent of :meth:`sample`."""

    @abstractmethod
    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance with gradient and Hessian.

        Args:
            points: Points in O [m], of shape (n, 3).

        Returns:
            Distance, gradient and Hessian at the points.
        """

    def field(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance with gradient and Hessian at points of any arrangement, in one call.

        Args:
            points: Points in O [m], of shape (..., 3).

        Returns:
            Distance, gradient and Hessian, of shapes (...,), (..., 3) and (..., 3, 3).
        """
        points = namespace(points).asarray(points, dtype=float)
        found, shape = self.sample(points.reshape(-1, 3)), points.shape
        return SurfaceSample(
            found.distance.reshape(shape[:-1]), found.gradient.reshape(shape), found.hessian.reshape(*shape, 3)
        )

    def distances(self, points: Array) -> Array:
        """Return the signed distance [m] at points (..., 3), of shape (...,)."""
        return self.field(points).distance

    def gradients(self, points: Array) -> Array:
        """Return the gradient of the signed distance at points (..., 3), of shape (..., 3)."""
        return self.field(points).gradient

    def hessians(self, points: Array) -> Array:
        """Return the Hessian of the signed distance [1/m] at points (..., 3), of shape (..., 3, 3)."""
        return self.field(points).hessian

    def nearest(self, points: Array) -> NearestPoints:
        """Return the nearest points of the exact surface, for checks; of closed forms, by :meth:`sample`.

        Args:
            points: Points in O [m], of shape (n, 3).

        Returns:
            Signed distances, nearest points and outward normals there.
        """
        found = self.sample(points)
        return NearestPoints(found.distance, points - found.distance[:, None] * found.gradient, found.gradient)

    @property
    def edge_radius(self) -> float:
        """Radius of the sharpest edges that a finger may meet [m]; infinite for none, 0 for those of triangles."""
        return float("inf")

    def bearable_force(self, radius: float) -> float:
        """Return the largest normal force that it bears under a fingertip of a radius [m]; infinite unless told [N]."""
        return float("inf")

    @property
    def grasped_in_part(self) -> bool:
        """Whether a hand has to close on part of it, whatever its size."""
        return False

    def normal_spread(self, points: Array, radius: float) -> Array:
        """Return the widest angle between normals of the exact surface within a distance of points of it.

        Args:
            points: Points on the surface in O [m], of shape (n, 3).
            radius: The distance [m]; closed forms are looked at this far off in eight directions.

        Returns:
            The angles [rad], of shape (n,); NaN where a point is none.
        """
        if np.isinf(self.edge_radius):
            return np.where(np.isfinite(points).all(axis=-1), 0.0, np.nan)
        normals = self.gradients(points)
        first = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        second, angles = np.cross(normals, first), np.arange(8) * np.pi / 4
        around = np.cos(angles)[:, None] * first[:, None] + np.sin(angles)[:, None] * second[:, None]
        found = np.concatenate([normals[:, None], self.gradients(points[:, None] + radius * around)], axis=1)
        found /= np.linalg.norm(found, axis=-1, keepdims=True)
        return np.asarray(np.arccos(np.clip(found @ found.swapaxes(1, 2), -1.0, 1.0)).max(axis=(1, 2)))

    def region(self, points: Array) -> tuple[Array, Array]:
        """Evaluate the limits of the surface that may be touched.

        Args:
            points: Contact points in O [m], of shape (n, 3).

        Returns:
            Margins [m], not negative where contact is allowed, of shape (n, k), and their gradients, of shape
            (n, k, 3); k = 0 where the whole surface may be touched.
        """
        return np.zeros((len(points), 0)), np.zeros((len(points), 0, 3))

    def opposed_patches(self) -> tuple[Array, Array]:
        """Return where a hand may close on part of the object: points between patches that face away from each other.

        Returns:
            The points in O [m] and the unit directions across, of shape (n, 3) each; none where a hand closes on the
            object as a whole.
        """
        return np.zeros((0, 3)), np.zeros((0, 3))

    @property
    @abstractmethod
    def half_extents(self) -> Array:
        """Half the edges of the bounding box in O [m], of shape (3,)."""

    def reach(self, way: Array) -> float:
        """Return how far it reaches from its centre of mass along a unit vector of shape (3,) [m]."""
        return float((np.asarray(self.mesh.vertices) @ way).max())

    @property
    def length_scale(self) -> float:
        """A characteristic length [m]: the smallest half extent."""
        return float(self.half_extents.min())

    def resized(self, factor: float) -> GraspObject:
        """Return the same shape with every size multiplied by a factor, and the same mass."""
        sizes = {f.name: factor * getattr(self, f.name) for f in fields(self) if f.name not in ("mass", "caps")}
        return replace(self, **sizes)

    @classmethod
    def text_keys(cls) -> tuple[str, ...]:
        """Return the keys of the text form."""
        return tuple(field.name for field in fields(cls))

    @classmethod
    def of_values(cls, values: dict[str, Any]) -> GraspObject:
        """Return the object of the entries of a text form."""
        return cls(**values)

    @property
    def text(self) -> str:
        """The text form, which :func:`parse_object` reads back."""
        values = (f"{f.name}={exact_text(getattr(self, f.name))}" for f in fields(self))
        return f"{self.kind}:{','.join(values)}"

    @property
    @abstractmethod
    def mesh(self) -> trimesh.Trimesh:
        """Triangle mesh in O [m], for pictures."""

    @property
    def inertia(self) -> Array:
        """Inertia about the centre of mass, of uniform density within :attr:`mesh` [kg m²], of shape (3, 3)."""
        mesh = self.mesh
        return readonly(mesh.moment_inertia * (self.mass / mesh.volume))


SIZES, MASSES = (1e-6, 1000.0), (1e-9, 1e6)
"""Least and largest size [m] and mass [kg] of an object."""


def check_sizes(shape: GraspObject, edge_limit: Callable[[], float] = lambda: np.inf) -> None:
    """Check every size and the mass of a shape to be positive and the edge radius to fit; make them floats.

    Args:
        shape: The shape, its edge radius the last of its fields.
        edge_limit: Largest edge radius [m], asked for when the sizes are checked.
    """
    for field in fields(shape):
        value = getattr(shape, field.name)
        name = f"object {shape.kind}.{field.name}"
        if field.name == "edge":
            number = positive(name, value)
            if not 1e-6 <= number <= edge_limit():
                raise InvalidValueError(name, value, f"between 1e-06 and {edge_limit():g} m")
        else:
            unit = "kg" if field.name == "mass" else "m"
            low, high = MASSES if field.name == "mass" else SIZES
            number = positive(name, value, zero_allowed=field.name == "caps", unit=unit, at_most=high)
            if number < low and field.name != "caps":
                raise InvalidValueError(name, value, f"at least {low:g} {unit}")
        object.__setattr__(shape, field.name, number)


def rounded_solid(core: Any, edge: float) -> Any:
    """Return a coal geometry swept by a sphere of a radius [m]."""
    core.setSweptSphereRadius(edge)
    return core


def vector_lengths(points: Array, axes: Array) -> tuple[Array, Array, Array]:
    """Return length, direction and Hessian of the length of vectors, over the axes that count."""
    xp = namespace(points)
    length = xp.sqrt((points * points).sum(axis=1))
    safe = xp.maximum(length, 1e-12)
    direction = points / safe[:, None]
    identity = np.eye(3) * axes[..., None, :]
    hessian = (identity - direction[:, :, None] * direction[:, None, :]) / safe[:, None, None]
    return length, direction, hessian
