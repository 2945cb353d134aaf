"""Small vector algebra shared by every layer: cross products, rotations, poses, read-only arrays.

Conventions: SI units; wrenches and twists have their linear part first; ``T_a_b`` is the pose of b in a.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from .exceptions import InvalidValueError
from .values import Value

Array = npt.NDArray[np.floating[Any]]
"""Array of real numbers, double precision throughout."""

Indices = npt.NDArray[np.integer[Any]]
"""Array of indices."""

ROTATION_TOLERANCE = 1e-5
"""How far a matrix that is given as a rotation may be from one: some write them with six digits."""

# The Levi-Civita symbol as a 9 x 3 matrix: (LEVI_CIVITA @ v).reshape(3, 3) is skew(v).
_LEVI_CIVITA = np.zeros((3, 3, 3))
_LEVI_CIVITA[[0, 1, 2], [2, 0, 1], [1, 2, 0]] = 1.0
_LEVI_CIVITA[[0, 1, 2], [1, 2, 0], [2, 0, 1]] = -1.0
_SKEW_FROM_VECTOR = np.ascontiguousarray(_LEVI_CIVITA.transpose(2, 0, 1).reshape(3, 9))


def namespace(values: npt.ArrayLike) -> Any:
    """Return the library whose functions take an array: its own, as JAX has one, or NumPy, also for lists."""
    found = getattr(values, "__array_namespace__", None)
    return np if found is None else found()


def skew(vectors: Array) -> Array:
    """Return the cross-product matrices of vectors: ``skew(a) @ b == a x b``.

    Args:
        vectors: Vectors, of shape (..., 3).

    Returns:
        Matrices, of shape (..., 3, 3).
    """
    return (vectors @ _SKEW_FROM_VECTOR).reshape(*vectors.shape[:-1], 3, 3)


def cross_rows(first: Array, second: Array) -> Array:
    """Return the cross products of rows; several times faster than ``np.cross`` for a few rows.

    Args:
        first: Vectors, of shape (m, 3).
        second: Vectors, of shape (m, 3).

    Returns:
        Products, of shape (m, 3).
    """
    return (skew(first) @ second[:, :, None])[:, :, 0]


def rotation_exp(vector: Array) -> Array:
    """Return the rotation matrix of a rotation vector (Rodrigues' formula).

    Args:
        vector: Rotation vector [rad], of shape (3,).

    Returns:
        Rotation matrix, of shape (3, 3).
    """
    a, b, _ = _exp_coefficients(vector)
    hat = skew(vector)
    return np.eye(3) + a * hat + b * (hat @ hat)


def rotation_left_jacobian(vector: Array) -> Array:
    """Return J_l with Exp(v + dv) = Exp(J_l(v) dv) Exp(v) to first order.

    Args:
        vector: Rotation vector v [rad], of shape (3,).

    Returns:
        Matrix, of shape (3, 3).
    """
    _, b, c = _exp_coefficients(vector)
    hat = skew(vector)
    return np.eye(3) + b * hat + c * (hat @ hat)


def _exp_coefficients(vector: Array) -> tuple[float, float, float]:
    """Return sin(t)/t, (1 - cos t)/t² and (t - sin t)/t³ for t = |vector|."""
    t2 = float(vector @ vector)
    if t2 < 1e-8:
        return 1.0 - t2 / 6.0, 0.5 - t2 / 24.0, 1.0 / 6.0 - t2 / 120.0
    t = math.sqrt(t2)
    return math.sin(t) / t, (1.0 - math.cos(t)) / t2, (t - math.sin(t)) / (t2 * t)


def rotation_between(source: Array, target: Array) -> Array:
    """Return the smallest rotation that takes one unit vector to another.

    Args:
        source: Unit vector, of shape (3,).
        target: Unit vector, of shape (3,).

    Returns:
        Rotation matrix R with ``R @ source == target``, of shape (3, 3).
    """
    cosine = float(source @ target)
    if cosine < -1.0 + 1e-12:
        # Half a turn about any axis normal to the source.
        helper = np.eye(3)[int(np.argmin(np.abs(source)))]
        axis = np.cross(source, helper)
        axis /= np.linalg.norm(axis)
        return 2.0 * np.outer(axis, axis) - np.eye(3)
    hat = skew(np.cross(source, target))
    return np.eye(3) + hat + hat @ hat / (1.0 + cosine)


def readonly(values: npt.ArrayLike) -> Array:
    """Return a read-only double-precision copy of an array."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


@dataclass(frozen=True, eq=False, repr=False)
class Pose(Value):
    """A pose T_a_b of a frame b in a frame a, which can't be changed; the algebra is Pinocchio's.

    Attributes:
        rotation: Rotation of b in a, of shape (3, 3), read-only.
        translation: Origin of b in a [m], of shape (3,), read-only.
    """

    rotation: Array
    translation: Array

    @classmethod
    def of(cls, pose: Any) -> Pose:
        """Return the pose of a pin.SE3, a 4 x 4 matrix or a pose.

        Raises:
            InvalidValueError: If it is none of these, not finite, or not turned by a rotation.
        """
        if isinstance(pose, Pose):
            return pose
        if not isinstance(pose, pin.SE3):
            matrix = np.asarray(pose) if isinstance(pose, np.ndarray | list | tuple) else None
            if matrix is None or matrix.shape != (4, 4):
                raise InvalidValueError("pose", pose, "a Pose, a pin.SE3 or a matrix of shape (4, 4)")
            pose = pin.SE3(np.asarray(matrix, dtype=float))
        found = cls.of_se3(pose)
        if not (np.isfinite(found.rotation).all() and np.isfinite(found.translation).all()):
            raise InvalidValueError("pose", found.homogeneous.tolist(), "finite numbers")
        skewed = np.abs(found.rotation @ found.rotation.T - np.eye(3)).max()
        if skewed > ROTATION_TOLERANCE or np.linalg.det(found.rotation) < 0.0:
            raise InvalidValueError("pose", found.rotation.tolist(), "a rotation matrix")
        return found

    @classmethod
    def of_se3(cls, pose: pin.SE3) -> Pose:
        """Return the pose of a pin.SE3 that Pinocchio has computed, unchecked."""
        return cls(pose.rotation, pose.translation)

    @classmethod
    def identity(cls) -> Pose:
        """Return the pose of a frame in itself."""
        return cls.of(pin.SE3.Identity())

    def se3(self) -> pin.SE3:
        """Return it as a new pin.SE3, for Pinocchio."""
        return pin.SE3(self.rotation, self.translation)

    @cached_property
    def homogeneous(self) -> Array:
        """The 4 x 4 matrix, read-only."""
        return readonly(self.se3().homogeneous)

    def inverse(self) -> Pose:
        """Return T_b_a."""
        return Pose.of_se3(self.se3().inverse())

    def act(self, point: npt.ArrayLike) -> Array:
        """Return a point of b in a [m], of shape (3,)."""
        return np.array(self.se3().act(np.array(point, dtype=float)))

    def __mul__(self, other: Any) -> Pose:
        """Return T_a_c of this T_a_b and another T_b_c, a Pose or a pin.SE3."""
        if not isinstance(other, Pose | pin.SE3):
            return NotImplemented
        return Pose.of_se3(self.se3() * (other.se3() if isinstance(other, Pose) else other))

    def __rmul__(self, other: Any) -> Pose:
        """Return T_c_b of a pin.SE3 T_c_a and this T_a_b."""
        return Pose.of_se3(other * self.se3()) if isinstance(other, pin.SE3) else NotImplemented

    def near(self, other: Any, tolerance: float = 1e-9) -> bool:
        """Return whether another pose is the same to a tolerance in every number of the matrix [1, m]."""
        return bool(np.abs(self.homogeneous - Pose.of(other).homogeneous).max() <= tolerance)

    def _shown(self) -> dict[str, Any]:
        """Print where it is and how it is turned, as a rotation vector [rad]."""
        return {"translation": self.translation, "turn": np.array(pin.log3(np.array(self.rotation)))}
