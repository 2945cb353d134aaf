"""Soft synergies: stiffness of the hand at the contacts, distribution of contact forces, the actual posture."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from ..checks import finite_array
from ..exceptions import InvalidValueError
from ..spatial import Array


def softened(jacobian: Array, joint: npt.ArrayLike) -> Array:
    """Return J C_q, how far unit torques move what a Jacobian maps.

    Args:
        jacobian: J, of shape (…, n_q).
        joint: C_q [rad/(N m)], a scalar, a diagonal of shape (n_q,) or a matrix of shape (n_q, n_q).

    Returns:
        J C_q, of the shape of J.
    """
    c_q = np.asarray(joint, dtype=float)
    return jacobian @ c_q if c_q.ndim == 2 else jacobian * c_q


def bent(joint: npt.ArrayLike, torques: Array) -> Array:
    """Return C_q τ, the angles by which torques bend the joints [rad].

    Args:
        joint: C_q [rad/(N m)], a scalar, a diagonal of shape (n_q,) or a matrix of shape (n_q, n_q).
        torques: τ [N m], of shape (n_q,), or several in columns, of shape (…, n_q, k).

    Returns:
        The angles, of the shape of the torques.
    """
    c_q = np.asarray(joint, dtype=float)
    if c_q.ndim == 2:
        return c_q @ torques
    return (c_q[:, None] if c_q.ndim == 1 and torques.ndim > 1 else c_q) * torques


def joint_stiffness(joint: npt.ArrayLike) -> Array:
    """Return K_q = C_q⁻¹ [N m/rad], of a diagonal its diagonal, of a matrix the matrix."""
    c_q = np.asarray(joint, dtype=float)
    return np.asarray(np.linalg.inv(c_q) if c_q.ndim == 2 else 1.0 / c_q)


def hand_stiffness(jacobian: Array, structural: npt.ArrayLike, joint: npt.ArrayLike) -> Array:
    """Return K_m = (C_s + J C_q Jᵀ)⁻¹, the stiffness of the hand seen at the contacts.

    [Mavrogiannis2014] below eq. (12), where both compliances are diagonal; here that of the joints may be full.

    Args:
        jacobian: J, of shape (3 n_c, n_q).
        structural: C_s [m/N], a scalar or of shape (3 n_c,).
        joint: C_q [rad/(N m)], a scalar, a diagonal of shape (n_q,) or a matrix of shape (n_q, n_q).

    Returns:
        K_m [N/m], symmetric positive definite, of shape (3 n_c, 3 n_c).
    """
    c_s = np.broadcast_to(np.asarray(structural, dtype=float), (len(jacobian),))
    return np.linalg.inv(np.diag(c_s) + softened(jacobian, joint) @ jacobian.T)


def series_stiffness(jacobian: Array, joint: npt.ArrayLike, contact: npt.ArrayLike) -> Array:
    """Return K = (C_c + J C_q Jᵀ)⁻¹, C_c = 1/K_c: the springs of joints and contacts in series.

    The stiffness with which the hand, its references held, answers a motion of the object. The structural
    compliance C_s, which in [Mavrogiannis2014] weighs the distribution of forces and with 0.1 m/N would let any
    object sag by centimetres, has no part in it.

    Args:
        jacobian: J, of shape (3 n_c, n_q).
        joint: C_q [rad/(N m)], a scalar, a diagonal of shape (n_q,) or a matrix of shape (n_q, n_q).
        contact: K_c [N/m], positive, a scalar or of shape (3 n_c,).

    Returns:
        K [N/m], symmetric positive definite, of shape (3 n_c, 3 n_c).
    """
    return hand_stiffness(jacobian, 1.0 / np.asarray(contact, dtype=float), joint)


def weighted_right_inverse(grasp: Array, stiffness: Array) -> Array:
    """Return G_K^R = K Gᵀ (G K Gᵀ)⁻¹, the right inverse of G weighted with a stiffness; eq. (12).

    Args:
        grasp: Grasp matrix G, of shape (6, 3 n_c).
        stiffness: K, of shape (3 n_c, 3 n_c).

    Returns:
        G_K^R, of shape (3 n_c, 6), with ``G G_K^R = I``.

    Raises:
        InvalidValueError: If G does not have rank 6.
    """
    core = grasp @ stiffness @ grasp.T
    if np.linalg.matrix_rank(grasp) < 6:
        raise InvalidValueError("grasp matrix", grasp.shape, "rank 6: at least three contacts not on one line")
    return np.linalg.solve(core, grasp @ stiffness.T).T


def internal_forces(
    grasp: Array, jacobian: Array, basis: Array, stiffness: Array, contact_stiffness: npt.ArrayLike
) -> Array:
    """Return the map from synergy displacements to internal contact forces.

    The second term of [Mavrogiannis2014] eq. (17): (I − G_K^R G)(K_m + K_c) J S; its columns lie in ker G.

    Args:
        grasp: G, of shape (6, 3 n_c).
        jacobian: J, of shape (3 n_c, n_q).
        basis: S, of shape (n_q, n_s).
        stiffness: K_m [N/m], of shape (3 n_c, 3 n_c).
        contact_stiffness: K_c [N/m], a scalar or of shape (3 n_c,).

    Returns:
        Map [N/rad], of shape (3 n_c, n_s).
    """
    m = jacobian.shape[0]
    k_c = np.diag(np.broadcast_to(np.asarray(contact_stiffness, dtype=float), (m,)))
    projector = np.eye(m) - weighted_right_inverse(grasp, stiffness) @ grasp
    return projector @ (stiffness + k_c) @ jacobian @ basis


def command_map(grasp: Array, jacobian: Array, basis: Array, stiffness: Array) -> Array:
    """Return P = (I − G_K^R G) K J S, what a change of the references S Δσ makes of the contact forces.

    K is the stiffness of contacts and joints in series: springs, balance and contact alone say what motors can change
    about a held grasp, whatever law planned its forces; [Prattichizzo2013]. Its columns lie in ker G.

    Args:
        grasp: G, of shape (6, 3 n_c).
        jacobian: J, of shape (3 n_c, n_q).
        basis: S, of shape (n_q, n_s).
        stiffness: K [N/m], of shape (3 n_c, 3 n_c).

    Returns:
        P [N/rad], of shape (3 n_c, n_s).
    """
    moved = stiffness @ jacobian @ basis
    return np.asarray(moved - weighted_right_inverse(grasp, stiffness) @ (grasp @ moved))


def contact_forces(
    grasp: Array,
    jacobian: Array,
    basis: Array,
    delta_sigma: Array,
    external_wrench: Array,
    stiffness: Array,
    contact_stiffness: npt.ArrayLike,
) -> Array:
    """Return the contact forces of the hand on the object; [Mavrogiannis2014] eq. (17).

    f = G_K^R (−w_ext) + (I − G_K^R G)(K_m + K_c) J S δσ.

    Args:
        grasp: G, of shape (6, 3 n_c).
        jacobian: J, of shape (3 n_c, n_q).
        basis: S, of shape (n_q, n_s).
        delta_sigma: Synergy displacement δσ [rad], of shape (n_s,).
        external_wrench: w_ext on the object in O [N, N m], of shape (6,).
        stiffness: K_m [N/m], of shape (3 n_c, 3 n_c).
        contact_stiffness: K_c [N/m], a scalar or of shape (3 n_c,).

    Returns:
        f [N], of shape (3 n_c,), stacked by contact; ``G f = −w_ext``.
    """
    particular = weighted_right_inverse(grasp, stiffness) @ (-external_wrench)
    return particular + internal_forces(grasp, jacobian, basis, stiffness, contact_stiffness) @ delta_sigma


def joint_torques(jacobian: Array, forces: Array) -> Array:
    """Return τ = Jᵀ f, the torques the joints exert for the contact forces; [Mavrogiannis2014] eq. (1).

    Args:
        jacobian: J, of shape (3 n_c, n_q).
        forces: f [N], of shape (3 n_c,).

    Returns:
        τ [N m], of shape (n_q,).
    """
    return jacobian.T @ forces


def actual_posture(
    reference: Array,
    joint_compliance: npt.ArrayLike,
    torques: Callable[[Array], Array],
    *,
    tolerance: float = 1e-12,
    max_iterations: int = 200,
) -> Array:
    """Return the self-consistent posture of a soft hand: the fixed point of q = q_r − C_q τ(q).

    [Mavrogiannis2014] eq. (10), choice A6: the torques are those at the actual posture. Found by damped
    fixed-point steps; the planner solves the same equation as a constraint instead.

    Args:
        reference: Reference posture q_r = q̄ + S σ [rad], of shape (n_q,).
        joint_compliance: C_q [rad/(N m)], a scalar, a diagonal of shape (n_q,) or a matrix of shape (n_q, n_q).
        torques: τ(q) [N m].
        tolerance: Largest change of a joint in the last step [rad].
        max_iterations: Steps before giving up.

    Returns:
        q [rad], of shape (n_q,).

    Raises:
        InvalidValueError: If the steps do not settle (the hand buckles under these torques).
    """
    reference = finite_array("reference", reference, np.shape(reference))
    q, damping, last = np.array(reference), 1.0, np.inf
    for _ in range(max_iterations):
        step = reference - bent(joint_compliance, torques(q)) - q
        size = float(np.abs(step).max())
        if size < tolerance:
            return q
        if size > last:
            damping *= 0.5
        last = size
        q = q + damping * step
    raise InvalidValueError("joint_compliance", joint_compliance, f"a hand that settles (last step {last:.1e} rad)")
