"""What the contacts could do with any forces in their cones: the force floor, and force closure.

Two small second-order cone programs, solved by Clarabel. They know nothing of synergies, which is the point:
the floor tells what the synergies cost, the margin is a certificate independent of the planner.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import clarabel
import numpy as np
import numpy.typing as npt
from scipy import sparse

from ..spatial import Array
from .contact_model import ContactModel, HardFinger
from .friction import normal_forces

HARD = HardFinger()
"""The contacts of the paper."""
RANK = 1e-6
"""Singular value of G, moments over the size of the grasp, above which it counts."""
SHOWN = 1e-6
"""Margin of friction, per mean normal force, above which forces show force closure."""
TURNS, INNER, LEAST_NORMAL = 5, 0.9, 0.05
"""How often forces are brought inside, to what share of the cones, and the least normal force, at first about 2."""


def force_norm_floor(
    points: Array,
    normals: Array,
    friction: npt.ArrayLike,
    external_wrench: Array,
    model: ContactModel = HARD,
    *,
    changes: Array | None = None,
    least_normal: float = 0.0,
) -> float:
    """Return the least F = √(Σ f_n²) of any contact forces in the cones that balance an external wrench.

    With load cases these are the undisturbed forces f, and f + Δf_k has to be in the cones in every case.

    Args:
        points: Contact points in O [m], of shape (n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).
        friction: Coefficient of friction μ, one number or one for each contact.
        external_wrench: w_ext on the object [N, N m], of shape (6,).
        model: What the contacts transmit.
        changes: Δf_k, by which load cases change the forces [N], of shape (n_k, n_c, d); none if left out.
        least_normal: Least normal force of every contact in every case [N].

    Returns:
        The floor [N]; infinite if no such forces exist.
    """
    # Variables (λ, t): minimise t with ‖f_n‖ ≤ t, G λ = −w_ext, λ and every λ + Δf_k in the cones.
    n_c, d = len(points), model.dimension
    size = d * n_c + 1
    normal_map = np.zeros((n_c, size))
    for i, covector in enumerate(model.covectors(normals)):
        normal_map[i, d * i : d * i + d] = covector
    norm_rows = np.vstack([np.eye(size)[-1], normal_map])
    cost = np.eye(size)[-1]
    equality = np.hstack([model.grasp_matrix(points, normals), np.zeros((6, 1))])
    cones, offsets = [norm_rows], [np.zeros(len(norm_rows))]
    own = model.cone_rows(normals, friction, size)
    for change in np.zeros((1, n_c, d)) if changes is None else changes:
        moved = np.append(change, 0.0)
        cones += [*own, *normal_map[:, None]]
        offsets += [*(rows @ moved for rows in own), *(normal_map @ moved - least_normal)[:, None]]
    solution = solve_cone_program(cost, equality, -external_wrench, cones, offsets)
    return math.inf if solution is None else float(solution[-1])


def force_closure_margin(points: Array, normals: Array, friction: npt.ArrayLike, model: ContactModel = HARD) -> float:
    """Return how far inside the friction cones internal forces can be, for unit mean normal force.

    The grasp is force-closed if and only if the margin is positive and G has rank 6: then a scaled internal
    force absorbs any wrench. The margin is max s with G λ = 0, μ f_n − |λ − f_n ν| ≥ s, mean f_n = 1; for a hard
    finger λ is the force f, and the length is |f_t|.

    Args:
        points: Contact points in O [m], of shape (n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).
        friction: Coefficient of friction μ, one number or one for each contact.
        model: What the contacts transmit.

    Returns:
        Margin, at most the mean μ; negative infinity if G lacks rank 6 or no internal force exists.
    """
    return force_closure_slope(points, normals, friction, model)[0]


def shows_force_closure(
    points: Array, normals: Array, friction: npt.ArrayLike, intensities: Array, model: ContactModel = HARD
) -> bool:
    """Return whether forces inside the cones are found soon that show that a grasp is force-closed.

    From forces that are known, by turns their internal part is taken and what is outside the cones is brought in. Where
    that ends inside, :func:`force_closure_margin`, a cone program, is positive; otherwise nothing is known.

    Args:
        points: Contact points in O [m], of shape (n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).
        friction: Coefficient of friction μ, one number or one for each contact.
        intensities: The forces, or what the contacts transmit, of shape (n_c, d).
        model: What that is.
    """
    if len(points) < model.fewest_contacts or not (np.isfinite(intensities).all() and np.isfinite(points).all()):
        return False
    scaled = _units(points)[:, None] * model.grasp_matrix(points, normals)
    _, values, rows = np.linalg.svd(scaled, full_matrices=False)
    if len(values) < 6 or values[-1] <= RANK:
        return False
    covectors, coefficients = model.covectors(normals), np.broadcast_to(friction, len(normals))
    found = covectors + intensities / max(float(np.abs(normal_forces(intensities, covectors)).mean()), 1e-12)
    for _ in range(TURNS):
        found = found - (rows.T @ (rows @ found.ravel())).reshape(found.shape)
        normal = normal_forces(found, covectors)
        tangential = found - normal[:, None] * covectors
        length = np.linalg.norm(tangential, axis=1)
        if (coefficients * normal - length > SHOWN * np.abs(normal).mean()).all():
            return True
        inner = INNER * coefficients
        normal = np.maximum(np.maximum(normal, (normal + length / np.maximum(inner, 1e-12)) / 2), LEAST_NORMAL)
        shorter = np.minimum(1.0, inner * normal / np.maximum(length, 1e-12))
        found = normal[:, None] * covectors + shorter[:, None] * tangential
    return False


def force_closure_slope(
    points: Array, normals: Array, friction: npt.ArrayLike, model: ContactModel = HARD
) -> tuple[float, Array]:
    """Return :func:`force_closure_margin` and its gradient by G at fixed cones.

    By the dual ω of G λ = 0, a twist, the gradient is ω λᵀ where the best λ is the only one.

    Args:
        points: Contact points in O [m], of shape (n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).
        friction: Coefficient of friction μ, one number or one for each contact.
        model: What the contacts transmit.

    Returns:
        The margin and ∂margin/∂G, of shape (6, d n_c); zero without a margin.
    """
    grasp = model.grasp_matrix(points, normals)
    scale = _units(points)
    nothing = (-math.inf, np.zeros_like(grasp))
    if len(points) < model.fewest_contacts or np.linalg.matrix_rank(scale[:, None] * grasp, tol=RANK) < 6:
        return nothing
    # Variables (λ, s): s is subtracted in the first row of every cone.
    n_c = len(points)
    size = grasp.shape[1] + 1
    equality = np.zeros((7, size))
    equality[:6, :-1] = scale[:, None] * grasp
    equality[6, :-1] = model.covectors(normals).ravel() / n_c
    cones = model.cone_rows(normals, friction, size)
    for rows in cones:
        rows[0, -1] = -1.0
    solution = solve_cone_pair(
        -np.eye(size)[-1], equality, np.eye(7)[6], cones, [np.zeros(len(rows)) for rows in cones]
    )
    if solution is None:
        return nothing
    found, duals = solution
    return float(found[-1]), -np.outer(scale * duals[:6], found[:-1])


def _units(points: Array) -> Array:
    """Return what brings forces and moments to one unit, moments over the size of the grasp, of shape (6,)."""
    return np.repeat([1.0, 1.0 / max(float(np.ptp(points, axis=0).max()), 1e-9)], 3)


def solve_cone_program(
    cost: Array, equality: Array, right: Array, cones: Sequence[Array], offsets: Sequence[Array]
) -> Array | None:
    """Minimise cost·x with equality x = right and cones[k] x + offsets[k] in the second-order cone.

    Args:
        cost: Of shape (n,).
        equality: Of shape (p, n).
        right: Of shape (p,).
        cones: Rows of each cone, of shape (d_k, n); a single row is an inequality ≥ 0.
        offsets: Of shape (d_k,) each.

    Returns:
        The solution, of shape (n,), or None if the solver found none.
    """
    found = solve_cone_pair(cost, equality, right, cones, offsets)
    return None if found is None else found[0]


def solve_cone_pair(
    cost: Array, equality: Array, right: Array, cones: Sequence[Array], offsets: Sequence[Array]
) -> tuple[Array, Array] | None:
    """Solve what :func:`solve_cone_program` does and return also the duals, those of the p equalities first."""
    a = sparse.csc_matrix(np.vstack([equality, *(-rows for rows in cones)]))
    b = np.concatenate([right, *offsets])
    kinds = [clarabel.ZeroConeT(len(right)), *(clarabel.SecondOrderConeT(len(rows)) for rows in cones)]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    size = len(cost)
    solver = clarabel.DefaultSolver(sparse.csc_matrix((size, size)), cost, a, b, kinds, settings)
    solution = solver.solve()
    if solution.status not in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
        return None
    return np.array(solution.x), np.array(solution.z)
