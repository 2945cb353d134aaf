"""What wrenches a grasp can exert with bounded forces: the exact ε of [FerrariCanny1992], rays, tasks.

The space is known by its support function h(d) = max d·w, in closed form for a cone: of a contact with the pull
g = G_iᵀ d it is max(0, ν·g + μ |g − (ν·g) ν|) for normal forces up to 1, ν the normal of a hard finger and the covector
of any other :class:`~grasp_planner.model.contact_model.ContactModel`. Bounding the sum of all normal forces ("L1") the
contacts' values enter by their maximum, bounding each ("Linf") by their sum. No cone is cut into facets.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ..exceptions import InvalidValueError, NameNotFoundError
from ..model.contact_model import ContactModel
from ..model.force_closure import HARD, solve_cone_program
from ..spatial import Array
from ..values import Value

Bound = Literal["L1", "Linf"]
BOUNDS: tuple[Bound, ...] = ("L1", "Linf")
ROUNDING = 1e-13
"""Share of a pull across the normal that counts as none."""
BATCH = 8
"""How many of the nearest facets get a new point before the hull is built anew."""


@dataclass(frozen=True, eq=False, repr=False)
class WrenchSpace(Value):
    """The wrenches of contacts with friction cones and bounded normal forces.

    Attributes:
        grasp: G, of shape (6, d n_c); moments divided by a length where a ball is to be measured in.
        normals: Unit normals into the object, of shape (n_c, 3).
        friction: μ of each contact, of shape (n_c,).
        bound: ``L1``: the normal forces sum to at most 1; ``Linf``: each is at most 1.
        model: What the contacts transmit.
    """

    grasp: Array
    normals: Array
    friction: Array
    bound: Bound = "L1"
    model: ContactModel = HARD

    @classmethod
    def of(
        cls,
        grasp: Array,
        normals: Array,
        friction: float | Array,
        *,
        bound: Bound = "L1",
        length: float = 1.0,
        model: ContactModel = HARD,
    ) -> WrenchSpace:
        """Return the space with moments divided by a length [m].

        Raises:
            NameNotFoundError: If there is no such bound.
            InvalidValueError: If μ is negative or the shapes do not fit.
        """
        if bound not in BOUNDS:
            raise NameNotFoundError("bound", str(bound), BOUNDS)
        normals = np.asarray(normals, dtype=float).reshape(-1, 3)
        if np.shape(grasp) != (6, model.dimension * len(normals)):
            raise InvalidValueError("G", np.shape(grasp), f"of shape (6, {model.dimension * len(normals)})")
        mu = np.broadcast_to(np.asarray(friction, dtype=float), (len(normals),))
        if not (mu >= 0.0).all():
            raise InvalidValueError("friction", mu.tolist(), "0 or more")
        if not model.has_friction:
            mu = np.ones(len(normals))  # nothing is tangential: any μ > 0 says that contacts press
        return cls(np.repeat([1.0, 1.0 / length], 3)[:, None] * grasp, normals, mu, bound, model)

    @cached_property
    def covectors(self) -> Array:
        """ν of every contact, of shape (n_c, d)."""
        return self.model.covectors(self.normals)

    def support(self, direction: Array) -> tuple[float, Array]:
        """Return h(d) and forces f that reach it, of shape (d n_c,)."""
        pull = (self.grasp.T @ direction).reshape(self.covectors.shape)
        along = np.einsum("ij,ij->i", pull, self.covectors)
        across = pull - along[:, None] * self.covectors
        size = np.linalg.norm(across, axis=1)
        values = along + self.friction * size
        # What rounding leaves across is no direction; a contact without friction has none at all.
        tangential = size > ROUNDING * np.linalg.norm(pull, axis=1)
        unit = np.where(tangential[:, None], across, 0.0) / np.maximum(size, 1e-300)[:, None]
        best = self.covectors + self.friction[:, None] * unit
        if self.bound == "L1":
            keep = np.arange(len(values)) == int(np.argmax(values))
        else:
            keep = np.ones(len(values), dtype=bool)
        keep &= values > 0.0
        return float(values[keep].sum()), (best * keep[:, None]).ravel()


@dataclass(frozen=True, eq=False, repr=False)
class Epsilon(Value):
    """The largest ball of wrenches in a space.

    Attributes:
        value: ε ≥ 0; 0 without force closure.
        bound: An upper bound; ε is between value and it.
        direction: The unit wrench in whose direction the space reaches least, of shape (6,).
        gradient: ∂ε/∂G, of shape (6, d n_c), where the direction is the only one.
        facets: How many facets the certificate has.
    """

    value: float
    bound: float
    direction: Array
    gradient: Array
    facets: int


def epsilon(space: WrenchSpace, *, tolerance: float = 1e-6, max_points: int = 600) -> Epsilon:
    """Return ε, the radius of the largest ball about the origin in a wrench space, with a certificate.

    The hull of points on the boundary lies within the space, so the nearest of its facets is a lower bound; the
    support in its direction is an upper one and gives the next point, until both meet; after [Zheng2013].

    Args:
        space: The space.
        tolerance: Relative gap at which it ends.
        max_points: Most points; then the bounds are apart.

    Returns:
        The value, both bounds and the gradient.
    """
    points = np.array([space.grasp @ space.support(d)[1] for d in np.vstack([np.eye(6), -np.eye(6), *_diagonals()])])
    nothing = Epsilon(0.0, 0.0, np.eye(6)[0], np.zeros_like(space.grasp), 0)
    if np.linalg.matrix_rank(points, tol=1e-12) < 6:
        return nothing
    low, best, direction, facets = 0.0, np.inf, np.eye(6)[0], 0
    points = np.vstack([points, np.zeros((1, 6))])
    while True:
        planes = _facets(points)
        if planes is None:
            break
        nearest = planes[np.argsort(-planes[:, -1])[:BATCH]]
        low, facets = max(low, float(-nearest[0, -1])), len(planes)
        d = nearest[0, :6] / np.linalg.norm(nearest[0, :6])
        d, high = _descended(space, d) if low > 0.0 else (d, space.support(d)[0])
        if high < best:
            best, direction = high, d
        reached = np.array([space.grasp @ space.support(plane[:6])[1] for plane in nearest])
        beyond = np.einsum("ij,ij->i", nearest[:, :6], reached) + nearest[:, -1] > 1e-9
        if best - low <= tolerance * best or not beyond.any() or len(points) >= max_points:
            break
        points = np.vstack([points, np.unique(reached[beyond].round(12), axis=0)])
    if low <= 1e-12:
        return nothing
    # Where the space reaches least, the ray along d ends: those forces, unlike any others of h(d), make d stationary.
    return Epsilon(min(low, best), best, direction, np.outer(direction, reach(space, direction)[1]), facets)


def _facets(points: Array) -> Array | None:
    """Return normals and offsets of the facets of a hull, of shape (m, 7); None if there is none.

    Where points are too nearly in one plane they are joggled, by far less than any tolerance here. Built anew each
    time: after an error an incremental hull may end the whole process.
    """
    for options in ("Qx Q12", "QJ Q12"):
        try:
            return np.asarray(ConvexHull(points, qhull_options=options).equations)
        except QhullError:
            continue
    return None


def _descended(space: WrenchSpace, direction: Array) -> tuple[Array, float]:
    """Return a direction near another in which the space reaches less, after a few projected steps, and h."""
    value, forces = space.support(direction)
    step = 0.1
    for _ in range(30):
        reached = space.grasp @ forces
        slope = reached - (direction @ reached) * direction
        size = float(np.linalg.norm(slope))
        if size < 1e-12 or step < 1e-6:
            break
        following = direction - step * slope / size
        following /= np.linalg.norm(following)
        trial, trial_forces = space.support(following)
        if trial < value:
            direction, value, forces, step = following, trial, trial_forces, 1.5 * step
        else:
            step *= 0.3
    return direction, value


def _diagonals() -> Array:
    """Return the 64 diagonals of the cube in six dimensions."""
    return np.array(np.meshgrid(*[[-1.0, 1.0]] * 6)).reshape(6, -1).T / np.sqrt(6.0)


def reach(space: WrenchSpace, direction: Array) -> tuple[float, Array]:
    """Return the largest s with s d in the space, 0 if none, and forces f with G f = s d; by a cone program."""
    n_c, d = space.covectors.shape
    size = d * n_c + 1
    cones = space.model.cone_rows(space.normals, space.friction, size)
    normal = np.zeros((n_c, size))
    for i, covector in enumerate(space.covectors):
        normal[i, d * i : d * i + d] = covector
    bounds = [-normal.sum(axis=0)[None]] if space.bound == "L1" else [-row[None] for row in normal]
    equality = np.hstack([space.grasp, -np.asarray(direction, dtype=float)[:, None]])
    last = np.eye(size)[-1]
    offsets = [np.zeros(1 + d)] * n_c + [np.ones(1)] * len(bounds) + [np.zeros(1)]
    found = solve_cone_program(-last, equality, np.zeros(6), [*cones, *bounds, last[None]], offsets)
    return (0.0, np.zeros(size - 1)) if found is None else (max(0.0, float(found[-1])), found[:-1])


def task_epsilon(space: WrenchSpace, ellipsoid: Array, *, tolerance: float = 1e-6) -> Epsilon:
    """Return the largest ρ with ρ T b in the space for every unit b: a task wrench space; [LiSastry1988], [Borst2004].

    Args:
        space: The space.
        ellipsoid: T, of shape (6, 6), regular: the task is the ellipsoid T b.
        tolerance: As for ε.

    Returns:
        ρ; its gradient is by T⁻¹ G.

    Raises:
        InvalidValueError: If T is singular.
    """
    if np.linalg.matrix_rank(ellipsoid) < 6:
        raise InvalidValueError("ellipsoid", "singular", "a regular 6 × 6 matrix")
    turned = replace(space, grasp=np.linalg.solve(ellipsoid, space.grasp))
    return epsilon(turned, tolerance=tolerance)
