"""An ellipsoid with its true signed distance: the closest point by a safeguarded root search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import coal
import numpy as np

from ..spatial import Array, namespace
from .base import GraspObject, SurfaceSample, check_sizes

if TYPE_CHECKING:
    import trimesh

NEWTON_STEPS = 60
"""Most Newton steps; they climb monotonically to the root and take 5 to 10."""
OFF_FACE = 1e-9
"""How far points are kept off the inner medial face, in semi-axes."""


@dataclass(frozen=True, eq=False, repr=False)
class EllipsoidObject(GraspObject):
    """An ellipsoid with its axes along those of O.

    Attributes:
        x: Semi-axis along x [m].
        y: Semi-axis along y [m].
        z: Semi-axis along z [m].
        mass: Mass [kg].
    """

    kind: ClassVar[str] = "ellipsoid"
    x: float = 0.03
    y: float = 0.035
    z: float = 0.05
    mass: float = 0.2

    def __post_init__(self) -> None:
        check_sizes(self)

    def coal_geometry(self) -> Any:
        """Return the coal geometry."""
        return coal.Ellipsoid(self.x, self.y, self.z)

    def sample(self, points: Array) -> SurfaceSample:
        """Evaluate the signed distance; see the base class.

        The closest point y of p has y_i = a_i² p_i / (t + a_i²) with t the largest root of
        Σ (a_i p_i / (t + a_i²))² = 1 (Eberly, Distance from a point to an ellipsoid, 2013). The normal at y is the
        gradient, and with the shape operator W of the surface at y the Hessian is W (I + φ W)⁻¹.
        """
        xp, squares = namespace(points), self.half_extents**2
        points = _off_medial_face(points, self.half_extents)
        shifted = squares + _multiplier(points, self.half_extents)[:, None]
        closest = squares * points / shifted
        slope = closest / squares
        steepness = xp.sqrt((slope * slope).sum(axis=1))
        normal = slope / steepness[:, None]
        distance = ((points - closest) * normal).sum(axis=1)
        tangent = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        shape = tangent @ (tangent / squares[:, None]) / steepness[:, None, None]
        hessian = xp.linalg.solve(np.eye(3) + distance[:, None, None] * shape, shape)
        return SurfaceSample(distance, normal, hessian)

    def reach(self, way: Array) -> float:
        """Return how far it reaches along a unit vector; see the base class."""
        return float(np.linalg.norm(self.half_extents * way))

    @property
    def half_extents(self) -> Array:
        """Half the edges of the bounding box [m]."""
        return np.array([self.x, self.y, self.z])

    @property
    def mesh(self) -> trimesh.Trimesh:
        """Triangle mesh in O [m]."""
        import trimesh

        mesh = trimesh.creation.icosphere(subdivisions=4, radius=1.0)
        mesh.apply_scale(self.half_extents)
        return mesh


def _off_medial_face(points: Array, axes: Array) -> Array:
    """Return points with those on the inner medial face, which have two closest points, moved off by 1e-9 axes."""
    short = int(np.argmin(axes))
    least = OFF_FACE * axes[short]
    xp = namespace(points)
    on_face = (xp.abs(points[:, short]) < least) & (((points / axes) ** 2).sum(axis=1) < 1.0)
    if not on_face.any():
        return points
    return xp.where(on_face[:, None] & (np.arange(3) == short), xp.copysign(least, points), points)


def _multiplier(points: Array, axes: Array) -> Array:
    """Return the largest root t of Σ (a_i p_i / (t + a_i²))² = 1 for every point, of shape (n,)."""
    xp, products, squares = namespace(points), axes * points, axes * axes
    # Left of the root the sum is convex and falls, so that Newton's steps climb to the root without passing it.
    t = xp.maximum((xp.abs(products) - squares).max(axis=1), (OFF_FACE / 2 - 1.0) * squares.min())
    for _ in range(NEWTON_STEPS):
        ratio = products / (t[:, None] + squares)
        ratio *= ratio
        excess = ratio.sum(axis=1) - 1.0
        step = xp.maximum(excess, 0.0) / xp.maximum(2.0 * (ratio / (t[:, None] + squares)).sum(axis=1), 1e-300)
        t = t + step
        if (step <= 1e-15 * squares.max()).all():
            break
    return t
