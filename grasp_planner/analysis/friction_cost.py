"""The cost of a force distribution that keeps away from every contact's limits, and its least by Newton's method.

V(f) = Σ_i Σ_j v(s_ij) with, for contact i, s = f_min − n·f (least normal force), ‖f‖ − f_max, ‖f‖/√(1 + μ²) − n·f (the
friction cone); v(s) = 1/(2 s²) for s < −k and the quadratic with the same value, slope and curvature beyond, so that it
is defined, convex and twice differentiable everywhere. [Bicchi1995], [Gabiccini2011].

For other contact models than hard fingers, intensities and covectors stand for forces and normals, d numbers for three.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..checks import positive
from ..spatial import Array
from ..values import Value


@dataclass(frozen=True)
class ContactLimits:
    """What each contact bears, the same for all.

    Attributes:
        friction: μ.
        min_normal: f_min [N].
        max_force: f_max, of the whole force [N].
        threshold: k [N], from where on the cost is quadratic.
    """

    friction: float = 0.8
    min_normal: float = 0.0
    max_force: float = 30.0
    threshold: float = 0.01

    def __post_init__(self) -> None:
        for name in ("friction", "max_force", "threshold"):
            positive(name, getattr(self, name))

    def distances(self, forces: Array, normals: Array) -> Array:
        """Return s, negative where a limit is kept [N]: normal force, size, cone; of shape (n_c, 3)."""
        size, normal = np.linalg.norm(forces, axis=1), np.einsum("ij,ij->i", forces, normals)
        cone = size / np.sqrt(1.0 + self.friction**2) - normal
        return np.column_stack([self.min_normal - normal, size - self.max_force, cone])

    def keeps(self, forces: Array, normals: Array) -> bool:
        """Return whether every force is in its cone by at least k."""
        return bool((self.distances(forces, normals)[:, 2] <= -self.threshold).all())


@dataclass(frozen=True, eq=False, repr=False)
class FrictionCost(Value):
    """The cost V and its derivatives by the forces.

    Attributes:
        value: V [1/N²].
        gradient: ∂V/∂f, of shape (3 n_c,).
        hessian: ∂²V/∂f², of shape (3 n_c, 3 n_c).
        by_normals: ∂V/∂normals, of shape (n_c, 3).
    """

    value: float
    gradient: Array
    hessian: Array
    by_normals: Array


@dataclass(frozen=True, eq=False, repr=False)
class BestForces(Value):
    """Forces that an optimisation found.

    Attributes:
        forces: f [N], of shape (n_c, 3), or intensities, of shape (n_c, d).
        value: What was made small there.
        coordinates: y in f = f₀ + E y.
    """

    forces: Array
    value: float
    coordinates: Array


def contact_cost(
    forces: npt.ArrayLike, normals: Array, limits: ContactLimits, counted: Array | None = None
) -> FrictionCost:
    """Return V of contact forces with gradient and Hessian.

    Args:
        forces: f of the hand on the object [N], of shape (n_c, 3) or (3 n_c,).
        normals: Unit normals into the object, of shape (n_c, 3).
        limits: What the contacts bear.
        counted: Which of the three limits count for each contact, 0 or 1, of shape (n_c, 3); all by default.

    Returns:
        The cost.
    """
    n_c, d = normals.shape
    forces = np.asarray(forces, dtype=float).reshape(n_c, d)
    size = np.linalg.norm(forces, axis=1)
    unit = forces / np.maximum(size, 1e-12)[:, None]
    round_ = (np.eye(d) - unit[:, :, None] * unit[:, None, :]) / np.maximum(size, 1e-12)[:, None, None]
    slanted = 1.0 / np.sqrt(1.0 + limits.friction**2)
    distances = limits.distances(forces, normals)
    share = np.ones(distances.shape) if counted is None else counted
    value, slope, curvature = (share * part for part in _barrier(distances, limits.threshold))
    # ∂s/∂f of the three limits is a u − c n.
    shares = np.array([[0.0, 1.0], [1.0, 0.0], [slanted, 1.0]])
    first = shares[None, :, :1] * unit[:, None] - shares[None, :, 1:] * normals[:, None]
    gradient = np.einsum("ij,ijk->ik", slope, first)
    blocks = np.einsum("ij,ijk,ijl->ikl", curvature, first, first) + (slope @ shares[:, 0])[:, None, None] * round_
    hessian = np.zeros((n_c, d, n_c, d))
    hessian[np.arange(n_c), :, np.arange(n_c)] = blocks
    by_normals = -(slope @ shares[:, 1])[:, None] * forces
    return FrictionCost(float(value.sum()), gradient.ravel(), hessian.reshape(d * n_c, d * n_c), by_normals)


def least_friction_cost(
    particular: npt.ArrayLike,
    basis: Array,
    normals: Array,
    limits: ContactLimits,
    *,
    start: npt.ArrayLike | None = None,
    counted: Array | None = None,
    tolerance: float = 1e-10,
    max_iterations: int = 200,
) -> BestForces:
    """Return the forces f₀ + E y of least V: convex, by Newton steps with backtracking.

    Args:
        particular: f₀ [N], of shape (3 n_c,): what balances the wrench.
        basis: E, of shape (3 n_c, k).
        normals: Unit normals into the object, of shape (n_c, 3).
        limits: What the contacts bear.
        start: First y; zero by default.
        counted: Which limits count, as for :func:`contact_cost`.
        tolerance: Newton decrement, relative to V, at which it ends.
        max_iterations: Most steps.

    Returns:
        The forces; they may break limits, which ``limits.distances`` tells, where no others exist.
    """
    fixed = np.asarray(particular, dtype=float).ravel()
    y = np.zeros(basis.shape[1]) if start is None else np.array(start, dtype=float)
    cost = contact_cost(fixed + basis @ y, normals, limits, counted)
    for _ in range(max_iterations):
        gradient = basis.T @ cost.gradient
        step = -np.linalg.lstsq(basis.T @ cost.hessian @ basis, gradient, rcond=1e-14)[0]
        decrement = -float(gradient @ step)
        if decrement <= tolerance**2 * max(cost.value, 1e-12):
            break
        length = 1.0
        following = contact_cost(fixed + basis @ (y + step), normals, limits, counted)
        while following.value > cost.value - 1e-4 * length * decrement and length > 1e-12:
            length *= 0.5
            following = contact_cost(fixed + basis @ (y + length * step), normals, limits, counted)
        if following.value >= cost.value:
            break
        y, cost = y + length * step, following
    return BestForces((fixed + basis @ y).reshape(normals.shape), cost.value, y)


def _barrier(s: Array, k: float) -> tuple[Array, Array, Array]:
    """Return v(s), v'(s), v''(s)."""
    inside = s < -k
    safe = np.where(inside, s, -1.0)
    a, b, c = 1.5 / k**4, 4.0 / k**3, 3.0 / k**2
    return (
        np.where(inside, 0.5 / safe**2, a * s**2 + b * s + c),
        np.where(inside, -1.0 / safe**3, 2.0 * a * s + b),
        np.where(inside, 3.0 / safe**4, 2.0 * a),
    )
