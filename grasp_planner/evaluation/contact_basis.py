"""Contacts that are no hard fingers: the geometry of hard ones, with its derivatives, carried over to intensities.

The fast form of :meth:`grasp_planner.model.contact_model.ContactModel.grasp_matrix` and ``hand_jacobian``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model.contact_model import ContactModel
from ..spatial import Array, skew


@dataclass(frozen=True)
class HeldBasis:
    """The holding bases of n_c contacts at one state, with derivatives by the n_g = n_q + 6 variables (q, w).

    Attributes:
        basis: H, of shape (n_c, 6, d).
        d_basis: ∂H, of shape (n_c, 6, d, n_g).
        points: Contact points c in O [m], of shape (n_c, 3).
        d_points: ∂c, of shape (n_c, 3, n_g).
        covectors: ν = H_fᵀ n, of shape (n_c, d).
        d_covectors: ∂ν, of shape (n_c, d, n_g).
    """

    basis: Array
    d_basis: Array
    points: Array
    d_points: Array
    covectors: Array
    d_covectors: Array

    @classmethod
    def at(cls, model: ContactModel, points: Array, d_points: Array, normals: Array, d_normals: Array) -> HeldBasis:
        """Return the bases at contacts."""
        return cls(
            basis=model.basis(normals),
            d_basis=model.basis_slope(normals) @ d_normals[:, None],
            points=points,
            d_points=d_points,
            covectors=model.covectors(normals),
            d_covectors=model.covector_slope(normals) @ d_normals,
        )

    @property
    def grasp(self) -> Array:
        """G = [H_f; c × H_f + H_m], of shape (6, d n_c)."""
        return self._moved(self.basis).transpose(1, 0, 2).reshape(6, -1)

    def d_grasp(self) -> Array:
        """Return ∂G, variable first, of shape (n_g, 6, d n_c)."""
        n_g = self.d_points.shape[2]
        change = np.moveaxis(self.d_basis, 3, 0)
        change = np.array(self._moved(change))
        change[:, :, 3:] += skew(self.d_points.transpose(2, 0, 1)) @ self.basis[:, :3]
        return change.transpose(0, 2, 1, 3).reshape(n_g, 6, -1)

    def products(self, covector: Array, intensities: Array) -> tuple[Array, Array]:
        """Return ∂(Gᵀ g) for a fixed covector g and ∂(G λ) for fixed intensities λ, of shapes (m, n_g), (6, n_g)."""
        force, moment = covector[:3], covector[3:]
        # Gᵀ g = H_fᵀ (g_f − c × g_m) + H_mᵀ g_m
        at_point = np.hstack([force - np.cross(self.points, moment), np.tile(moment, (len(self.points), 1))])
        d_transpose = np.einsum("cidg,ci->cdg", self.d_basis, at_point)
        d_transpose += self.basis[:, :3].transpose(0, 2, 1) @ (skew(moment) @ self.d_points)
        each = intensities.reshape(self.covectors.shape)
        change = np.einsum("cidg,cd->cig", self.d_basis, each)
        change[:, 3:] += skew(self.points) @ change[:, :3]
        forces = np.einsum("cid,cd->ci", self.basis[:, :3], each)
        change[:, 3:] -= skew(forces) @ self.d_points
        return d_transpose.reshape(-1, d_transpose.shape[2]), change.sum(axis=0)

    def jacobian(self, twists: Array, d_twists: Array) -> tuple[Array, Array]:
        """Return J = Hᵀ (v; ω) and its derivatives.

        Args:
            twists: (v; ω) of the touching points by the joints, of shape (n_c, 6, n_q).
            d_twists: Their derivatives, variable first, of shape (n_g, n_c, 6, n_q).

        Returns:
            Arrays of shapes (d n_c, n_q) and (n_g, d n_c, n_q).
        """
        transposed = self.basis.transpose(0, 2, 1)
        n_g, n_q = len(d_twists), twists.shape[2]
        change = transposed @ d_twists + self.d_basis.transpose(3, 0, 2, 1) @ twists
        return (transposed @ twists).reshape(-1, n_q), change.reshape(n_g, -1, n_q)

    def forces(self, intensities: Array, d_intensities: Array) -> tuple[Array, Array]:
        """Return contact forces H_f λ and their derivatives by x = (q, w, δσ).

        Args:
            intensities: λ, of shape (n_c, d).
            d_intensities: ∂λ/∂x, of shape (d n_c, n_x).

        Returns:
            Arrays of shapes (n_c, 3) and (3 n_c, n_x).
        """
        upper, n_g = self.basis[:, :3], self.d_points.shape[2]
        change = upper @ d_intensities.reshape(*self.covectors.shape, -1)
        change[:, :, :n_g] += np.einsum("cidg,cd->cig", self.d_basis[:, :3], intensities)
        return np.einsum("cid,cd->ci", upper, intensities), change.reshape(3 * len(intensities), -1)

    def _moved(self, held: Array) -> Array:
        """Return force and moment about O of force and moment about the contact points, of shape (…, n_c, 6, d)."""
        return np.concatenate([held[..., :3, :], held[..., 3:, :] + skew(self.points) @ held[..., :3, :]], axis=-2)
