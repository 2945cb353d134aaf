"""The distribution of contact forces (17) with derivatives: the fast form of :mod:`grasp_planner.model.compliance`."""

from __future__ import annotations

import numpy as np

from ..model.compliance import bent, softened
from ..problem.problem import GraspProblem
from ..spatial import Array
from .contact_geometry import ContactGeometry


class ForceDistribution:
    """Contact forces at one state for any external wrench, with derivatives by x = (q, w, δσ).

    With u = J S δσ, y = (K_m + K_c) u and λ = (G K_m Gᵀ)⁻¹ (G y + w_ext), eq. (17) reads f = y − K_m Gᵀ λ.
    """

    def __init__(self, problem: GraspProblem, geometry: ContactGeometry, delta_sigma: Array) -> None:
        jacobian = geometry.jacobian
        self.geometry = geometry
        self.joint_compliance = problem.joint_compliance
        self.contact_stiffness = problem.contact_springs
        softness = softened(jacobian, self.joint_compliance) @ jacobian.T
        softness.ravel()[:: len(softness) + 1] += problem.structural_compliances
        self.stiffness = np.linalg.inv(softness)  # K_m
        self.synergy_jacobian = jacobian @ problem.synergies.basis  # J_s
        self.joint_displacement = problem.synergies.basis @ delta_sigma  # S δσ
        self.motion = self.synergy_jacobian @ delta_sigma  # u
        self.pressed = self.stiffness @ self.motion + self.contact_stiffness * self.motion  # y
        self.spread = self.stiffness @ geometry.grasp.T  # K_m Gᵀ
        self.core_inverse = np.linalg.inv(geometry.grasp @ self.spread)

    def forces(self, wrench: Array) -> tuple[Array, Array]:
        """Return the contact forces under an external wrench.

        Args:
            wrench: w_ext in O [N, N m], of shape (6,); zero gives the internal forces alone.

        Returns:
            f, or the intensities λ [N], of shape (m,), and ∂f/∂x, of shape (m, n_x).
        """
        grasp, stiffness = self.geometry.grasp, self.stiffness
        multiplier = self.core_inverse @ (grasp @ self.pressed + wrench)  # λ
        forces = self.pressed - self.spread @ multiplier
        # df = e − K Gᵀ dλ, dλ = (G K Gᵀ)⁻¹ (dG f + G e),
        # e = K (du − dA a − dGᵀ λ) + K_c du, a = K (u − Gᵀ λ), dA = dJ C_q Jᵀ + J C_q dJᵀ.
        strain = stiffness @ (self.motion - grasp.T @ multiplier)  # a
        d_motion, d_softness = self._jacobian_products(strain)
        d_transpose, d_grasp = self.geometry.grasp_products(multiplier, forces)
        n_g = d_motion.shape[1]
        free = np.empty((len(forces), n_g + self.synergy_jacobian.shape[1]))
        springs = self.contact_stiffness[:, None]
        free[:, :n_g] = stiffness @ (d_motion - d_softness - d_transpose) + springs * d_motion
        free[:, n_g:] = stiffness @ self.synergy_jacobian + springs * self.synergy_jacobian
        right = grasp @ free
        right[:, :n_g] += d_grasp
        return forces, free - self.spread @ (self.core_inverse @ right)

    def balance(self, wrench: Array) -> tuple[Array, Array]:
        """Return what the forces leave of the load: nothing, by construction; no rows."""
        size = self.geometry.d_points.shape[2] + self.synergy_jacobian.shape[1]
        return np.zeros(0), np.zeros((0, size))

    def torques(self, forces: Array, d_forces: Array) -> tuple[Array, Array]:
        """Return τ = Jᵀ f [N m] and ∂τ/∂x, of shapes (n_q,) and (n_q, n_x)."""
        return torques_with_slopes(self.geometry, forces, d_forces)

    def _jacobian_products(self, strain: Array) -> tuple[Array, Array]:
        """Return dJ S δσ and (dJ C_q Jᵀ + J C_q dJᵀ) a for fixed S δσ and a, each of shape (m, n_g)."""
        d_jacobian, jacobian, c_q = self.geometry.d_jacobian, self.geometry.jacobian, self.joint_compliance
        n_g, m, n_q = d_jacobian.shape
        vectors = np.column_stack([self.joint_displacement, bent(c_q, jacobian.T @ strain)])
        products = (d_jacobian.reshape(n_g * m, n_q) @ vectors).reshape(n_g, m, 2)
        d_softness = products[:, :, 1].T + softened(jacobian, c_q) @ (strain @ d_jacobian).T
        return products[:, :, 0].T, d_softness


def torques_with_slopes(geometry: ContactGeometry, forces: Array, d_forces: Array) -> tuple[Array, Array]:
    """Return τ = Jᵀ f [N m] and ∂τ/∂x, of shapes (n_q,) and (n_q, n_x)."""
    d_jacobian = geometry.d_jacobian
    d_torques = geometry.jacobian.T @ d_forces
    d_torques[:, : len(d_jacobian)] += (forces @ d_jacobian).T
    return geometry.jacobian.T @ forces, d_torques
