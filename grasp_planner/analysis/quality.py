"""Quality measures of the literature that follow from the matrices and contacts of a grasp, one short function each.

After the survey [Roa2015]; names and definitions are those of the papers cited there.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from ..model.contact_model import ContactModel
from ..model.force_closure import HARD, force_closure_margin
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


def distance_to_singularity(grasp: Array, jacobian: Array) -> float:
    """Return σ_min(H), H the hand-object Jacobian: how far hand and object are from a singular posture."""
    return smallest_singular_value(hand_object_jacobian(grasp, jacobian))[0]


def manipulability(grasp: Array, jacobian: Array) -> float:
    """Return the product of the singular values of H, the volume of the manipulability ellipsoid; [Yoshikawa1985]."""
    return ellipsoid_volume(hand_object_jacobian(grasp, jacobian))[0]


def uniformity(grasp: Array, jacobian: Array) -> float:
    """Return σ_max/σ_min of H: 1 where the object moves alike in all directions; [Salisbury1982]."""
    return 1.0 / isotropy(hand_object_jacobian(grasp, jacobian))[0]


def force_closure(points: Array, normals: Array, friction: npt.ArrayLike, model: ContactModel = HARD) -> float:
    """Return how far inside the cones internal forces can be, 1 N a contact on average; the package's own margin."""
    return force_closure_margin(points, normals, friction, model)


def grasp_polygon_area(points: Array) -> float:
    """Return the area [m²] of the contacts' polygon in their plane of least squares; [Mirtich1994] for three."""
    flat = _in_plane(points)
    order = np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))
    x, y = flat[order].T
    return float(0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def polygon_shape(points: Array) -> float:
    """Return the mean deviation of the polygon's inner angles from a regular one's, over the largest; 0 is regular.

    [KimOh2001]: Σ |θ_i − θ̄| / θ_max with θ_max = (n − 2)(π − θ̄) + 2 θ̄.
    """
    flat = _in_plane(points)
    flat = flat[np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))]
    n = len(flat)
    before, after = np.roll(flat, 1, axis=0) - flat, np.roll(flat, -1, axis=0) - flat
    cosine = (before * after).sum(axis=1) / (np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1))
    mean = math.pi * (n - 2) / n
    largest = (n - 2) * (math.pi - mean) + 2.0 * mean
    return float(np.abs(np.arccos(np.clip(cosine, -1.0, 1.0)) - mean).sum() / largest)


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


def _in_plane(points: Array) -> Array:
    """Return the points in the two directions in which they spread most, about their centroid, of shape (n, 2)."""
    away = points - points.mean(axis=0)
    return np.asarray(away @ np.linalg.svd(away, full_matrices=False)[2][:2].T)
