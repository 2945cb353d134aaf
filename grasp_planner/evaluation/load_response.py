"""The hand's passive answer to disturbances and what it leaves of the limits, with derivatives by x.

The fast form of :mod:`grasp_planner.judge.load_check`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..model.compliance import bent, softened
from ..problem.problem import GraspProblem
from ..problem.tendon_drive import passive_compliance
from ..spatial import Array
from .contact_geometry import ContactGeometry

CONE_SMOOTHING = 1e-3
"""ε in √(|f_t|² + ε²), a smooth and conservative length of the tangential force [N]."""
SPHERE_SMOOTHING = 1e-9
"""The same for the answer to the worst disturbance of a sphere, per unit of disturbance."""


@dataclass(frozen=True)
class LoadState:
    """What is left of the limits over all load cases; residuals ≥ 0 are met. Derivatives have x as last axis.

    Attributes:
        friction: μ/s f_n − √(|f_t|² + ε²) of every case and contact [N], contact first, of shape (n_c n_k,).
        normal: Normal forces less their least, then their largest less them, in the worst cases [N].
        torque: Joint torques to their limits, in the worst cases [N m].
        d_friction: ∂friction/∂x.
        d_normal: ∂normal/∂x.
        d_torque: ∂torque/∂x.
    """

    friction: Array
    normal: Array
    torque: Array
    d_friction: Array
    d_normal: Array
    d_torque: Array


@dataclass(frozen=True)
class PassiveResponse:
    """What disturbances do: forces change by −R d, R = G_K^R or (G_K^R, K Gᵀ), K hand and contacts in series.

    Attributes:
        matrix: R, of shape (m, 6 or 12).
        derivative: ∂R by (q, w), of shape (m, 6 or 12, n_g).
        torques: Jᵀ R, of shape (n_q, 6 or 12).
        d_torques: ∂(Jᵀ R) by (q, w), of shape (n_q, 6 or 12, n_g).
    """

    matrix: Array
    derivative: Array
    torques: Array
    d_torques: Array


def passive_response(
    geometry: ContactGeometry, joint_compliance: Array, contact_stiffness: npt.ArrayLike, *, displaced: bool = False
) -> PassiveResponse:
    """Return the passive answer of the hand with its derivatives.

    R = K Gᵀ Λ with K = (1/K_c + J C_q Jᵀ)⁻¹. To a wrench Λ = (G K Gᵀ)⁻¹, and with B = K (dGᵀ Λ − d(J C_q Jᵀ) R):
    dR = B − K Gᵀ Λ (dG R + G B). To a displacement Λ is the identity and dR = B.

    Args:
        geometry: Contacts with derivatives.
        joint_compliance: C_q [rad/(N m)], a diagonal of shape (n_q,) or a matrix of shape (n_q, n_q).
        contact_stiffness: K_c [N/m], one number or of shape (m,).
        displaced: Whether to append the answer to displacements of the object.

    Returns:
        R, Jᵀ R and their derivatives.
    """
    jacobian, grasp, d_jacobian = geometry.jacobian, geometry.grasp, geometry.d_jacobian
    n_g, m, n_q = d_jacobian.shape
    soft = softened(jacobian, joint_compliance)
    compliance = soft @ jacobian.T
    compliance.ravel()[:: m + 1] += 1.0 / np.asarray(contact_stiffness)
    stiffness = np.linalg.inv(compliance)
    spread = stiffness @ grasp.T
    core = np.linalg.inv(grasp @ spread)
    if displaced:
        core = np.hstack([core, np.eye(6)])  # Λ
    matrix = spread @ core
    torques = jacobian.T @ matrix
    size = matrix.shape[1]

    # Third axis of what follows: the unit disturbances; second: the variables.
    by_torque = (d_jacobian.reshape(-1, n_q) @ bent(joint_compliance, torques)).reshape(n_g, m, size)
    turned = np.matmul(d_jacobian.transpose(0, 2, 1), matrix)  # dJᵀ R, (n_g, n_q, size)
    d_grasp, moved = geometry.d_grasp_rows  # dG, the rows of it that move
    free = np.matmul(d_grasp.transpose(0, 2, 1), core[moved]) - by_torque - np.matmul(soft, turned)
    inner = stiffness @ free.transpose(1, 0, 2).reshape(m, -1)  # B
    right = grasp @ inner
    right[moved] += np.matmul(d_grasp, matrix).transpose(1, 0, 2).reshape(d_grasp.shape[1], -1)
    if displaced:  # G R stays the identity for wrenches only
        right.reshape(6, n_g, size)[:, :, 6:] = 0.0
    change = (inner - matrix[:, :6] @ right).reshape(m, n_g, size)
    derivative = np.ascontiguousarray(change.transpose(0, 2, 1))
    d_torques = turned.transpose(1, 2, 0) + (jacobian.T @ derivative.reshape(m, -1)).reshape(n_q, size, n_g)
    return PassiveResponse(matrix, derivative, torques, d_torques)


class LoadEvaluator:
    """Evaluates the load cases of a problem."""

    def __init__(self, problem: GraspProblem) -> None:
        loads, mass = problem.loads, problem.grasp_object.mass
        self.problem = problem
        self._cases = loads.cases(mass)
        self._compliance = passive_compliance(problem)
        self._listed = loads.listed()[1:] if loads.spheres(mass) else loads.listed()
        self._spheres = loads.spheres(mass)
        self._friction = problem.friction / loads.friction_safety
        self._max_normal = problem.max_normal_force
        self._limited = np.flatnonzero(np.isfinite(problem.torque_limits))

    def evaluate(
        self, geometry: ContactGeometry, forces: tuple[Array, Array], torques: tuple[Array, Array]
    ) -> LoadState:
        """Evaluate what is left of the limits.

        Args:
            geometry: Contacts with derivatives.
            forces: Nominal f [N], of shape (m,), and ∂f/∂x.
            torques: Nominal τ = Jᵀ f [N m], of shape (n_q,), and ∂τ/∂x.

        Returns:
            The state of the load cases.
        """
        response = self._response(geometry)
        friction, d_friction = self._cones(geometry, *forces, response)
        normal, d_normal = self._normal_forces(geometry, *forces, response)
        torque, d_torque = self._torques(*torques, response)
        return LoadState(friction, normal, torque, d_friction, d_normal, d_torque)

    def _response(self, geometry: ContactGeometry) -> PassiveResponse:
        """Return the passive answer, or zeros where nothing disturbs."""
        problem, loads = self.problem, self.problem.loads
        if loads.disturbed:
            stiffness = problem.contact_springs
            return passive_response(geometry, self._compliance, stiffness, displaced=loads.displaced)
        n_g, m, n_q = geometry.d_jacobian.shape
        return PassiveResponse(np.zeros((m, 6)), np.zeros((m, 6, n_g)), np.zeros((n_q, 6)), np.zeros((n_q, 6, n_g)))

    def _cones(
        self, geometry: ContactGeometry, forces: Array, d_forces: Array, response: PassiveResponse
    ) -> tuple[Array, Array]:
        """Return the friction margins of all contacts in all cases and their derivatives."""
        normals, cases, friction = geometry.covectors, self._cases, self._friction[:, None]
        (n_c, d), n_k = normals.shape, len(cases)
        n_x, n_g = d_forces.shape[1], geometry.d_covectors.shape[2]
        # Contact first: (n_c, n_k, d).
        each = forces.reshape(n_c, 1, d) - (response.matrix.reshape(n_c, d, -1) @ cases.T).transpose(0, 2, 1)
        normal = (each @ normals[:, :, None])[:, :, 0]
        tangential = each - normal[:, :, None] * normals[:, None, :]
        length = np.sqrt(np.einsum("ikj,ikj->ik", tangential, tangential) + CONE_SMOOTHING**2)
        by_force = friction[:, :, None] * normals[:, None, :] - tangential / length[:, :, None]
        by_normal = (friction + normal / length)[:, :, None] * each
        by_response = -(by_force[:, :, :, None] * cases[None, :, None, :]).reshape(n_c, n_k, -1)
        derivative = by_force @ d_forces.reshape(n_c, d, n_x)
        moving = np.concatenate([geometry.d_covectors, response.derivative.reshape(n_c, -1, n_g)], axis=1)
        derivative[:, :, :n_g] += np.concatenate([by_normal, by_response], axis=2) @ moving
        return (friction * normal - length).ravel(), derivative.reshape(n_c * n_k, n_x)

    def _normal_forces(
        self, geometry: ContactGeometry, forces: Array, d_forces: Array, response: PassiveResponse
    ) -> tuple[Array, Array]:
        """Return how far normal forces stay from their limits in the worst cases, and derivatives."""
        normals, d_normals = geometry.covectors, geometry.d_covectors
        (n_c, d), n_g = normals.shape, d_normals.shape[2]
        row = normals[:, None, :]
        value = (row @ forces.reshape(n_c, d, 1))[:, 0, 0]
        slope = (row @ d_forces.reshape(n_c, d, -1))[:, 0]
        slope[:, :n_g] += (forces.reshape(n_c, 1, d) @ d_normals)[:, 0]
        matrix = response.matrix.reshape(n_c, d, -1)
        answer = (row @ matrix)[:, 0]
        d_answer = (row @ response.derivative.reshape(n_c, d, -1)).reshape(n_c, -1, n_g)
        d_answer += matrix.transpose(0, 2, 1) @ d_normals
        low, high = self._worst(value, slope, answer, d_answer)
        rows, slopes = [low[0] - self.problem.loads.min_normal_force], [low[1]]
        if np.isfinite(self._max_normal):
            rows.append(self._max_normal - high[0])
            slopes.append(-high[1])
        return np.concatenate(rows), np.vstack(slopes)

    def _torques(self, torques: Array, d_torques: Array, response: PassiveResponse) -> tuple[Array, Array]:
        """Return how far joint torques stay from their limits in the worst cases, and derivatives."""
        limited = self._limited
        if not limited.size:
            return np.zeros(0), np.zeros((0, d_torques.shape[1]))
        value, slope = torques[limited], d_torques[limited]
        low, high = self._worst(value, slope, response.torques[limited], response.d_torques[limited])
        limits = self.problem.torque_limits[limited]
        bounds = np.tile(limits, len(low[0]) // len(limits))
        return np.concatenate([bounds + low[0], bounds - high[0]]), np.vstack([low[1], -high[1]])

    def _worst(
        self, value: Array, slope: Array, answer: Array, d_answer: Array
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Return the least and the largest values of v − a·Δw over the listed cases and each sphere.

        Args:
            value: v, of shape (r,).
            slope: ∂v/∂x, of shape (r, n_x).
            answer: a, of shape (r, 6 or 12).
            d_answer: ∂a by (q, w), of shape (r, 6 or 12, n_g).

        Returns:
            Least values with derivatives and largest values with derivatives, a block of r rows for each listed
            case and each sphere.
        """
        n_g = d_answer.shape[2]
        low: list[Array] = []
        high: list[Array] = []
        d_low: list[Array] = []
        d_high: list[Array] = []
        for case in self._listed:
            changed = np.array(slope)
            changed[:, :n_g] -= case @ d_answer
            for values, slopes in ((low, d_low), (high, d_high)):
                values.append(value - answer @ case)
                slopes.append(changed)
        for part, radius in self._spheres:
            along = answer[:, part]
            length = np.sqrt(np.einsum("ij,ij->i", along, along) + SPHERE_SMOOTHING**2)
            d_length = (along[:, None, :] @ d_answer[:, part])[:, 0] / length[:, None]
            for sign, values, slopes in ((-1.0, low, d_low), (1.0, high, d_high)):
                changed = np.array(slope)
                changed[:, :n_g] += sign * radius * d_length
                values.append(value + sign * radius * length)
                slopes.append(changed)
        return (np.concatenate(low), np.vstack(d_low)), (np.concatenate(high), np.vstack(d_high))
