"""Convex quadratic programs, by Clarabel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import clarabel
import numpy as np
from scipy import sparse

from ..spatial import Array


def solve_quadratic(
    hessian: Array, slope: Array, rows: Array, right: Array, cones: Sequence[Any], *, tolerance: float
) -> tuple[Array, Array] | None:
    """Solve min ½ xᵀ H x + g·x with b − A x in cones.

    Args:
        hessian: H, positive semidefinite, of shape (n, n).
        slope: g, of shape (n,).
        rows: A, of shape (m, n).
        right: b, of shape (m,).
        cones: Clarabel's cones, in the order of the rows.
        tolerance: Gap and infeasibility that are asked for.

    Returns:
        x, of shape (n,), and the multipliers of the rows, of shape (m,); None if the solver found none.
    """
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    upper = sparse.triu(sparse.csc_matrix(hessian)).tocsc()
    solution = clarabel.DefaultSolver(upper, slope, sparse.csc_matrix(rows), right, list(cones), settings).solve()
    status = clarabel.SolverStatus
    if solution.status not in (status.Solved, status.AlmostSolved, status.InsufficientProgress):
        return None
    return np.array(solution.x), np.array(solution.z)
