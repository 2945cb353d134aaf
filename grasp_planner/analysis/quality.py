"""Quality measures of the literature that follow from the matrices and contacts of a grasp, one short function each.

After the survey [Roa2015]; names and definitions are those of the papers cited there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..model.contact_model import ContactModel
from ..model.force_closure import HARD, force_closure_slope
from ..spatial import Array


def smallest_singular_value(matrix: Array) -> tuple[float, Array]:
    """Return σ_min(G) and its gradient u vᵀ: how far the grasp is from losing a wrench; [LiSastry1988]."""
    left, values, right = np.linalg.svd(matrix, full_matrices=False)
    return float(values[-1]), np.outer(left[:, -1], right[-1])


def ellipsoid_volume(matrix: Array) -> tuple[float, Array]:
    """Return √det(G Gᵀ), the product of the singular values, and its gradient; [LiSastry1988], [Yoshikawa1985]."""
    volume = float(np.prod(np.linalg.svd(matrix, compute_uv=False)))
    return volume, volume * np.linalg.pinv(matrix).T


def isotropy(matrix: Array) -> tuple[float, Array]:
    """Return σ_min/σ_max in [0, 1], 1 where all directions are alike, and its gradient; [KimOh1991]."""
    left, values, right = np.linalg.svd(matrix, full_matrices=False)
    ratio = float(values[-1] / values[0])
    least, most = np.outer(left[:, -1], right[-1]), np.outer(left[:, 0], right[0])
    return ratio, (least - ratio * most) / values[0]


def hand_object_jacobian(grasp: Array, jacobian: Array) -> Array:
    """Return H = (G Gᵀ)⁻¹ G J, joint velocities to the object's twist, of shape (6, n_q); [Prattichizzo2016]."""
    return np.asarray(np.linalg.lstsq(grasp.T, jacobian, rcond=None)[0])


def distance_to_singularity(grasp: Array, jacobian: Array) -> tuple[float, Array, Array]:
    """Return σ_min(H), H the hand-object Jacobian: how far hand and object are from a singular posture.

    With its gradients by G and by J, as :func:`manipulability` and :func:`uniformity` have them too.
    """
    return _of_both(smallest_singular_value, grasp, jacobian)


def manipulability(grasp: Array, jacobian: Array) -> tuple[float, Array, Array]:
    """Return the product of the singular values of H, the volume of the manipulability ellipsoid; [Yoshikawa1985]."""
    return _of_both(ellipsoid_volume, grasp, jacobian)


def uniformity(grasp: Array, jacobian: Array) -> tuple[float, Array, Array]:
    """Return σ_max/σ_min of H: 1 where the object moves alike in all directions; [Salisbury1982]."""
    ratio, by_grasp, by_jacobian = _of_both(isotropy, grasp, jacobian)
    return 1.0 / ratio, -by_grasp / ratio**2, -by_jacobian / ratio**2


def force_closure(
    points: Array, normals: Array, friction: npt.ArrayLike, model: ContactModel = HARD
) -> tuple[float, Array]:
    """Return how far inside the cones internal forces can be, 1 N a contact on average, and its gradient by G.

    The package's own margin, :func:`grasp_planner.model.force_closure.force_closure_margin`.
    """
    return force_closure_slope(points, normals, friction, model)


def grasp_polygon_area(points: Array) -> tuple[float, Array]:
    """Return the area [m²] of the contacts' polygon in their plane of least squares, and its gradient; [Mirtich1994].

    Corners are joined by their angle about the centroid; with three contacts it is the triangle's area.
    """
    plane = _Plane.of(points)
    x, y = plane.flat[plane.order].T
    twice = float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    slope = np.zeros_like(plane.flat)
    slope[plane.order] = np.column_stack([np.roll(y, -1) - np.roll(y, 1), np.roll(x, 1) - np.roll(x, -1)])
    return 0.5 * abs(twice), plane.by_points(0.5 * math.copysign(1.0, twice) * slope)


def polygon_shape(points: Array) -> tuple[float, Array]:
    """Return the deviation of the polygon's inner angles from a regular one's, over the largest; 0 is regular.

    [KimOh2001]: Σ |θ_i − θ̄| / θ_max with θ_max = (n − 2)(π − θ̄) + 2 θ̄. With its gradient, where no angle is θ̄.
    """
    plane = _Plane.of(points)
    corners, n = plane.flat[plane.order], len(points)
    sides = np.stack([np.roll(corners, 1, axis=0) - corners, np.roll(corners, -1, axis=0) - corners])
    lengths = np.linalg.norm(sides, axis=2, keepdims=True)
    angles = np.arccos(np.clip((sides[0] * sides[1]).sum(axis=1) / lengths.prod(axis=0)[:, 0], -1.0, 1.0))
    mean = math.pi * (n - 2) / n
    largest = (n - 2) * (math.pi - mean) + 2.0 * mean
    # An angle grows as one of its sides turns away from the other: by the normal of that side, over its length.
    across = np.stack([sides[..., 1], -sides[..., 0]], axis=2) / lengths**2
    inward = np.einsum("ci,ci->c", across[0], sides[1])
    slopes = across * (np.sign(inward) * np.array([[-1.0], [1.0]]))[:, :, None]
    slopes *= (np.sign(angles - mean) / largest)[None, :, None]
    by_corners = np.roll(slopes[0], -1, axis=0) + np.roll(slopes[1], 1, axis=0) - slopes.sum(axis=0)
    by_flat = np.zeros_like(by_corners)
    by_flat[plane.order] = by_corners
    return float(np.abs(angles - mean).sum() / largest), plane.by_points(by_flat)


def centroid_distance(points: Array, centre: Array) -> tuple[float, Array]:
    """Return the distance [m] of the contacts' centroid from the centre of mass, and its gradient; [Roa2015]."""
    away = points.mean(axis=0) - centre
    distance = float(np.linalg.norm(away))
    return distance, np.tile(away / max(distance, 1e-300) / len(points), (len(points), 1))


def joint_centring(q: Array, lower: Array, upper: Array) -> tuple[float, Array]:
    """Return the mean of ((q − middle)/(range/2))², 0 in the middle, 1 on the limits; [Liegeois1977]; and gradient."""
    half = 0.5 * (upper - lower)
    off = (q - 0.5 * (upper + lower)) / np.where(half > 0.0, half, np.inf)
    return float((off**2).mean()), 2.0 * off / np.where(half > 0.0, half, np.inf) / len(q)


def posture_deviation(q: Array, mean: Array) -> tuple[float, Array]:
    """Return the root mean square distance [rad] of the joints from a mean posture, and its gradient."""
    away = q - mean
    size = float(np.sqrt((away**2).mean()))
    return size, away / (len(q) * max(size, 1e-300))


def _of_both(
    measure: Callable[[Array], tuple[float, Array]], grasp: Array, jacobian: Array
) -> tuple[float, Array, Array]:
    """Return a measure of H and its gradients by G and J: (G Gᵀ) dH = dG (J − Gᵀ H) − G dGᵀ H + G dJ."""
    h = hand_object_jacobian(grasp, jacobian)
    value, by_h = measure(h)
    solved = np.linalg.lstsq(grasp @ grasp.T, by_h, rcond=None)[0]
    by_grasp = solved @ (jacobian - grasp.T @ h).T - h @ solved.T @ grasp
    return value, by_grasp, grasp.T @ solved


@dataclass(frozen=True)
class _Plane:
    """The plane of least squares of points, and how it moves with them.

    Attributes:
        flat: Coordinates in the plane about the centroid, of shape (n, 2).
        order: Indices of the points by their angle about the centroid, of shape (n,).
        axes: Unit axes, the plane's first, then the normal, by rows, of shape (3, 3).
        spread: Σ of squares along each axis, of shape (3,).
        heights: Distance of each point from the plane, of shape (n,).
    """

    flat: Array
    order: npt.NDArray[np.intp]
    axes: Array
    spread: Array
    heights: Array

    @classmethod
    def of(cls, points: Array) -> _Plane:
        """Return the plane of points."""
        away = points - points.mean(axis=0)
        spread, axes = np.linalg.eigh(away.T @ away)
        spread, axes = spread[::-1], axes[:, ::-1].T
        flat = away @ axes[:2].T
        return cls(flat, np.argsort(np.arctan2(flat[:, 1], flat[:, 0])), axes, spread, away @ axes[2])

    def by_points(self, by_flat: Array) -> Array:
        """Return the gradient by the points, of shape (n, 3), of what is unchanged as axes turn within the plane."""
        normal = self.axes[2]
        gradient = by_flat @ self.axes[:2]
        # As the plane tilts by t_k about the other axis, coordinates along axis k change by t_k times the heights.
        for k in range(2):
            tilt = float(by_flat[:, k] @ self.heights) / max(self.spread[k] - self.spread[2], 1e-300)
            gradient += tilt * (self.flat[:, k, None] * normal + self.heights[:, None] * self.axes[k])
        return gradient - gradient.mean(axis=0)
