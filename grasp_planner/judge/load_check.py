"""The independent check of the load cases: the hand's passive answer and the limits, one clear formula a function."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model.compliance import command_map, series_stiffness, weighted_right_inverse
from ..model.friction import friction_margins, normal_forces
from ..problem.problem import GraspProblem
from ..problem.tendon_drive import passive_compliance
from ..spatial import Array


def response_matrix(problem: GraspProblem, grasp: Array, jacobian: Array) -> Array:
    """Return R = G_K^R of the stiffness of hand and contacts in series.

    Args:
        problem: The problem.
        grasp: G, of shape (6, d n_c).
        jacobian: J [m/rad], of shape (d n_c, n_q).

    Returns:
        R, of shape (d n_c, 6): a disturbance Δw changes the contact forces by −R Δw.
    """
    stiffness = series_stiffness(jacobian, passive_compliance(problem), problem.contact_springs)
    return weighted_right_inverse(grasp, stiffness)


def command_matrix(problem: GraspProblem, grasp: Array, jacobian: Array) -> Array:
    """Return P of the stiffness of hand and contacts in series.

    Args:
        problem: The problem.
        grasp: G, of shape (6, d n_c).
        jacobian: J [m/rad], of shape (d n_c, n_q).

    Returns:
        P [N/rad], of shape (d n_c, n_s): moving the references by S Δσ changes the contact forces by P Δσ.
    """
    stiffness = series_stiffness(jacobian, problem.joint_compliance, problem.contact_springs)
    return command_map(grasp, jacobian, problem.synergies.basis, stiffness)


def displacement_matrix(problem: GraspProblem, grasp: Array, jacobian: Array) -> Array:
    """Return K Gᵀ of the stiffness of hand and contacts in series.

    Args:
        problem: The problem.
        grasp: G, of shape (6, d n_c).
        jacobian: J [m/rad], of shape (d n_c, n_q).

    Returns:
        K Gᵀ, of shape (d n_c, 6): a twist ν of the object, palm and references held, changes f by −K Gᵀ ν.
    """
    return series_stiffness(jacobian, passive_compliance(problem), problem.contact_springs) @ grasp.T


def case_forces(forces: Array, response: Array, cases: Array) -> Array:
    """Return the contact forces f − R Δw_k of load cases [N], of shape (n_k, n_c, d).

    Args:
        forces: Nominal f, for contacts that are no hard fingers their intensities [N], of shape (n_c, d).
        response: R, of shape (d n_c, 6), or with K Gᵀ behind it (d n_c, 12).
        cases: Δw_k in O [N, N m], of shape (n_k, 6), or with ν_k behind it (n_k, 12).
    """
    return forces - (cases @ response.T).reshape(len(cases), *forces.shape)


@dataclass(frozen=True)
class LoadCheck:
    """What the worst of all load cases makes of a grasp.

    Attributes:
        friction: Least μ/s f_n − |f_t| of any contact [N].
        least_normal: Least normal force of any contact [N].
        largest_normal: Largest normal force of any contact [N].
        torque: Most by which a joint torque exceeds its limit, negative where all are within [N m].
    """

    friction: float
    least_normal: float
    largest_normal: float
    torque: float


def check_loads(problem: GraspProblem, forces: Array, normals: Array, jacobian: Array, grasp: Array) -> LoadCheck:
    """Return what the load cases of a problem make of a grasp.

    Args:
        problem: The problem.
        forces: Nominal f, for contacts that are no hard fingers their intensities [N], of shape (n_c, d).
        normals: Unit normals into the object, or the covectors of the intensities, of shape (n_c, d).
        jacobian: J [m/rad], of shape (d n_c, n_q).
        grasp: G, of shape (6, d n_c).

    Returns:
        The worst of all cases, the undisturbed grasp among them.
    """
    loads, mass = problem.loads, problem.grasp_object.mass
    response = _answer(problem, grasp, jacobian)
    friction = problem.friction / loads.friction_safety
    cones = friction_margins(case_forces(forces, response, loads.cases(mass)), normals, friction)
    rows = np.einsum("ij,ijk->ik", normals, response.reshape(*normals.shape, -1))
    low, high = _extremes(problem, normal_forces(forces, normals), rows)
    least, largest = float(low.min()), float(high.max())
    low, high = _extremes(problem, jacobian.T @ forces.ravel(), jacobian.T @ response)
    excess = float((np.maximum(high, -low) - problem.torque_limits).max())
    return LoadCheck(friction=float(cones.min()), least_normal=least, largest_normal=largest, torque=excess)


def load_force_changes(problem: GraspProblem, grasp: Array, jacobian: Array) -> Array:
    """Return by how much the load cases of a problem change the contact forces [N], of shape (n_k, n_c, d).

    Args:
        problem: The problem.
        grasp: G, of shape (6, d n_c).
        jacobian: J [m/rad], of shape (d n_c, n_q).
    """
    still = np.zeros((len(problem.frames), problem.contact_model.dimension))
    return case_forces(still, _answer(problem, grasp, jacobian), problem.loads.cases(problem.grasp_object.mass))


def _answer(problem: GraspProblem, grasp: Array, jacobian: Array) -> Array:
    """Return what turns load cases into the change of forces, of shape (d n_c, 6 or 12)."""
    response: Array = np.zeros((len(jacobian), 6))
    if problem.loads.disturbed:
        response = response_matrix(problem, grasp, jacobian)
    if problem.loads.displaced:
        response = np.hstack([response, displacement_matrix(problem, grasp, jacobian)])
    return response


def _extremes(problem: GraspProblem, nominal: Array, rows: Array) -> tuple[Array, Array]:
    """Return least and largest values of v − a·Δw over the listed cases and, by |a| times the radius, the spheres."""
    loads = problem.loads
    low = high = nominal
    for case in loads.listed():
        low, high = np.minimum(low, nominal - rows @ case), np.maximum(high, nominal - rows @ case)
    for part, radius in loads.spheres(problem.grasp_object.mass):
        swing = radius * np.linalg.norm(rows[:, part], axis=1)
        low, high = np.minimum(low, nominal - swing), np.maximum(high, nominal + swing)
    return low, high
