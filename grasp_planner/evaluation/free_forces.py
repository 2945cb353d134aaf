"""Contact forces as variables: springs, equilibrium and friction decide which hold, as eq. (10), (11), (30) say.

Equation (17) confines internal forces to what the synergies can change; the springs of a compliant hand know no such
bound: any f with G f + w_ext = 0 and q = q̄ + S σ − C_q Jᵀ f for some σ is at rest [Prattichizzo2013, Gabiccini2011].
"""

from __future__ import annotations

import numpy as np

from ..problem.problem import GraspProblem
from ..spatial import Array, skew
from .contact_geometry import ContactGeometry
from .force_distribution import torques_with_slopes
from .variables import VariableLayout


class FreeForces:
    """Intensities λ of the contacts at one state, by x itself in the palm frame, with derivatives by x = (q, w, λ)."""

    def __init__(self, problem: GraspProblem, geometry: ContactGeometry, layout: VariableLayout, x: Array) -> None:
        self.geometry, self.layout = geometry, layout
        self.synergy_jacobian = geometry.jacobian @ problem.synergies.basis  # J_s
        self._intensities = turned_intensities(x[layout.forces].reshape(geometry.covectors.shape), geometry.rotation)

    def forces(self, wrench: Array) -> tuple[Array, Array]:
        """Return λ in O [N], of shape (d n_c,), and ∂λ/∂x, of shape (d n_c, n_x), whatever the external wrench."""
        layout, (n_c, d) = self.layout, self._intensities.shape
        derivative = np.zeros((n_c, d, layout.size))
        turn = np.eye(d)
        if d >= 3:
            turn[:3, :3] = self.geometry.rotation
            derivative[:, :3, layout.rotation] = -skew(self._intensities[:, :3]) @ self.geometry.turn
        turned = np.zeros((n_c, d, n_c, d))
        turned[np.arange(n_c), :, np.arange(n_c)] = turn
        derivative[:, :, layout.forces] = turned.reshape(n_c, d, d * n_c)
        return self._intensities.ravel(), derivative.reshape(d * n_c, layout.size)

    def balance(self, wrench: Array) -> tuple[Array, Array]:
        """Return G λ + w_ext [N, N m], of shape (6,), and its derivatives by x, of shape (6, n_x)."""
        forces, derivative = self.forces(wrench)
        result = self.geometry.grasp @ derivative
        _, d_grasp = self.geometry.grasp_products(np.zeros(6), forces)
        result[:, : d_grasp.shape[1]] += d_grasp
        return self.geometry.grasp @ forces + wrench, result

    def torques(self, forces: Array, d_forces: Array) -> tuple[Array, Array]:
        """Return τ = Jᵀ f [N m] and ∂τ/∂x, of shapes (n_q,) and (n_q, n_x)."""
        return torques_with_slopes(self.geometry, forces, d_forces)


def turned_intensities(intensities: Array, rotation: Array) -> Array:
    """Return intensities in another frame: their forces turn, torques about normals and normal forces stay.

    Args:
        intensities: λ, of shape (n_c, d).
        rotation: Rotation of the present frame in the other one, of shape (3, 3).

    Returns:
        λ in the other frame, of shape (n_c, d).
    """
    if intensities.shape[1] < 3:
        return intensities
    return np.hstack([intensities[:, :3] @ rotation.T, intensities[:, 3:]])
