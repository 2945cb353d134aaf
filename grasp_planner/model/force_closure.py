"""What the contacts could do with any forces in their cones: the force floor, and force closure.

Two small second-order cone programs, solved by Clarabel. They know nothing of synergies, which is the point:
the floor tells what the synergies cost, the margin is a certificate independent of the planner.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import clarabel
import numpy as np
from scipy import sparse

from ..spatial import Array, skew
from .contacts import grasp_matrix


def force_norm_floor(points: Array, normals: Array, friction: float, external_wrench: Array) -> float:
    """Return the least F = √(Σ f_n²) of any contact forces in the cones that balance an external wrench.

    Args:
        points: Contact points in O [m], of shape (n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).
        friction: Coefficient of friction μ.
        external_wrench: w_ext on the object [N, N m], of shape (6,).

    Returns:
        The floor [N]; infinite if no such forces exist.
    """
    # Variables (f, t): minimise t with ‖f_n‖ ≤ t, G f = −w_ext, f in the cones.
    n_c = len(points)
    size = 3 * n_c + 1
    normal_map = np.zeros((n_c, size))
    for i, normal in enumerate(normals):
        normal_map[i, 3 * i : 3 * i + 3] = normal
    norm_rows = np.vstack([np.eye(size)[-1], normal_map])
    cost = np.eye(size)[-1]
    equality = np.hstack([grasp_matrix(points), np.zeros((6, 1))])
    cones = [norm_rows, *cone_rows(normals, friction, size)]
    solution = solve_cone_program(cost, equality, -external_wrench, cones, [np.zeros(len(rows)) for rows in cones])
    return math.inf if solution is None else float(solution[-1])


def force_closure_margin(points: Array, normals: Array, friction: float) -> float:
    """Return how far inside the friction cones internal forces can be, for unit mean normal force.

    The grasp is force-closed if and only if the margin is positive and G has rank 6: then a scaled internal
    force absorbs any wrench. The margin is max s with G f = 0, μ f_n − |f_t| ≥ s, mean f_n = 1.

    Args:
        points: Contact points in O [m], of shape (n_c, 3).
        normals: Unit normals into the object, of shape (n_c, 3).
        friction: Coefficient of friction μ.

    Returns:
        Margin, at most μ; negative infinity if G lacks rank 6 or no internal force exists.
    """
    grasp = grasp_matrix(points)
    scale = np.repeat([1.0, 1.0 / max(float(np.ptp(points, axis=0).max()), 1e-9)], 3)
    if len(points) < 3 or np.linalg.matrix_rank(scale[:, None] * grasp, tol=1e-6) < 6:
        return -math.inf
    # Variables (f, s): s is subtracted in the first row of every cone.
    n_c = len(points)
    size = 3 * n_c + 1
    equality = np.zeros((7, size))
    equality[:6, :-1] = scale[:, None] * grasp
    equality[6, :-1] = normals.ravel() / n_c
    cones = cone_rows(normals, friction, size)
    for rows in cones:
        rows[0, -1] = -1.0
    solution = solve_cone_program(-np.eye(size)[-1], equality, np.eye(7)[6], cones, [np.zeros(4)] * n_c)
    return -math.inf if solution is None else float(solution[-1])


def cone_rows(normals: Array, friction: float, size: int) -> list[Array]:
    """Return for each contact the rows A with A x = (μ f_n, f_t), which has to lie in the second-order cone.

    Args:
        normals: Unit normals into the object, of shape (n_c, 3).
        friction: Coefficient of friction μ.
        size: Number of variables x; the first 3 n_c are the contact forces.

    Returns:
        One array of shape (4, size) for each contact.
    """
    rows: list[Array] = []
    for i, normal in enumerate(normals):
        block = np.zeros((4, size))
        block[0, 3 * i : 3 * i + 3] = friction * normal
        # −skew(n)² projects onto the tangent plane.
        block[1:, 3 * i : 3 * i + 3] = -skew(normal) @ skew(normal)
        rows.append(block)
    return rows


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
    return np.array(solution.x)
