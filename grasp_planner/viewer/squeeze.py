"""The best squeeze: what motors can do to hold the object with the least force at the contacts as they are."""

from __future__ import annotations

import numpy as np

from ..grasp.grasp import Grasp
from ..judge.load_check import command_matrix
from ..model.compliance import internal_forces
from ..model.force_closure import solve_cone_program
from ..spatial import Array

ROOM = 1e-5
"""Margin kept inside the friction cones [N]."""


def best_squeeze(grasp: Grasp) -> Array | None:
    """Return the δσ of least F with every contact force in its friction cone; where springs make the forces, these.

    A second-order cone program in (δσ, F), exact for the contacts and the Jacobian of the grasp; eq. (17), (30). Where
    springs make the forces, motors change them by P Δσ from what they are, and by nothing else.

    Args:
        grasp: The grasp; by (17) its own squeeze is not used.

    Returns:
        δσ [rad], of shape (n_s,), or intensities of the contacts [N], of shape (n_c, d); None if there are none.
    """
    problem = grasp.problem
    springs, model = problem.parameters.force_law == "springs", problem.contact_model
    if springs:
        by_sigma = command_matrix(problem, grasp.grasp_matrix, grasp.hand_jacobian)
        fixed = grasp.intensities.ravel()
    else:
        stiffness, k_c = grasp.stiffness, problem.contact_springs
        by_sigma = internal_forces(grasp.grasp_matrix, grasp.hand_jacobian, problem.synergies.basis, stiffness, k_c)
        fixed = grasp.intensities.ravel() - by_sigma @ grasp.delta_sigma
    # Columns scaled to 1 N, so that the solver sees numbers of order one.
    size = np.maximum(np.linalg.norm(by_sigma, axis=0), 1e-9)
    scaled = by_sigma / size
    (n_c, d), n_s = grasp.intensities.shape, by_sigma.shape[1]
    normals = np.zeros((n_c, d * n_c))
    for i, covector in enumerate(grasp.covectors):
        normals[i, d * i : d * i + d] = covector
    rows = [np.concatenate([np.zeros((1, n_s)), normals @ scaled])]
    rows[0] = np.hstack([rows[0], np.eye(n_c + 1)[:, :1]])
    right = [np.concatenate([[0.0], normals @ fixed])]
    for block in model.cone_rows(grasp.contacts.normals, problem.friction, d * n_c):
        rows.append(np.hstack([block @ scaled, np.zeros((1 + d, 1))]))
        right.append(block @ fixed - ROOM * np.eye(1 + d)[0])
    solution = solve_cone_program(np.eye(n_s + 1)[-1], np.zeros((0, n_s + 1)), np.zeros(0), rows, right)
    if solution is None:
        return None
    found = solution[:n_s] / size
    return (fixed + by_sigma @ found).reshape(n_c, d) if springs else found
