"""Load cases for a batch of states: friction, normal forces and joint torques under the hand's passive answer.

Values are exact; derivatives hold that answer, R = G_K^R, fixed against the palm, which is enough to find feasible
points and half of the work. :mod:`grasp_planner.evaluation.load_response` has the full ones.
"""

from __future__ import annotations

import numpy as np

from ..evaluation.load_response import CONE_SMOOTHING
from ..model.compliance import softened
from ..problem.problem import GraspProblem
from ..problem.tendon_drive import passive_compliance
from ..spatial import Array, namespace
from .contacts import BatchedContacts
from .rows import Rows, own_columns


class BatchedLoads:
    """Evaluates the load cases of a problem."""

    def __init__(self, problem: GraspProblem) -> None:
        self.problem, self.loads = problem, problem.loads
        mass = problem.grasp_object.mass
        self._cases = self.loads.cases(mass)
        self._compliance = passive_compliance(problem)
        self._listed = self.loads.listed()
        self._spheres = self.loads.spheres(mass)
        self._friction = problem.friction[:, None] / self.loads.friction_safety

    def rows(self, contacts: BatchedContacts) -> list[Rows]:
        """Return the rows of all limits at the contacts of a batch of states."""
        answer = self._answer(contacts)
        found = [self._cones(contacts, answer), *self._normals(contacts, answer), *self._torques(contacts, answer)]
        if self.loads.max_force_norm is not None:
            size = contacts.force_norm
            slope = (contacts.normal_forces[..., None] * contacts.d_normal_forces).sum(axis=1) / size[:, None]
            found.append(Rows("load_force_norm", self.loads.max_force_norm - size[:, None], -slope[:, None]))
        return found

    def _answer(self, contacts: BatchedContacts) -> Array:
        """Return R in P of a unit disturbance in O, of shape (B, 3 n_c, 6 or 12): forces change by −R d."""
        count, n_c, n_q, _ = contacts.velocities.shape
        xp, size = namespace(contacts.points), self.loads.size
        if not self.loads.disturbed:
            return xp.zeros((count, 3 * n_c, size))
        jacobian = contacts.velocities.transpose(0, 1, 3, 2).reshape(count, 3 * n_c, n_q)
        soft = softened(jacobian, self._compliance) @ jacobian.transpose(0, 2, 1)
        soft += np.eye(3 * n_c) / self.problem.parameters.contact_stiffness
        grasp = contacts.d_balance[:, :, -3 * n_c :]  # G, what moves balance by forces
        spread = xp.linalg.solve(soft, grasp.transpose(0, 2, 1))  # K Gᵀ
        matrix = spread @ xp.linalg.inv(grasp @ spread)
        if self.loads.displaced:
            matrix = xp.concatenate([matrix, spread], axis=2)
        turned = contacts.states.rotation.transpose(0, 2, 1)
        blocks = matrix.reshape(count, 3 * n_c, size // 3, 3).transpose(0, 2, 1, 3) @ turned[:, None]
        return blocks.transpose(0, 2, 1, 3).reshape(count, 3 * n_c, size)

    def _cones(self, contacts: BatchedContacts, answer: Array) -> Rows:
        """Return what is left of the cones of μ/s, of every contact in every case."""
        forces, normals = contacts.states.forces, contacts.normals
        xp, (count, n_c, _) = namespace(forces), forces.shape
        changes = (answer @ self._cases.T).reshape(count, n_c, 3, -1).transpose(0, 1, 3, 2)
        each = forces[:, :, None] - changes  # (B, n_c, n_k, 3)
        normal = (each @ normals[..., None])[..., 0]
        tangential = each - normal[..., None] * normals[:, :, None]
        length = xp.sqrt(xp.einsum("bikl,bikl->bik", tangential, tangential) + CONE_SMOOTHING**2)
        by_force = self._friction[..., None] * normals[:, :, None] - tangential / length[..., None]
        by_normal = (self._friction + normal / length)[..., None] * each
        by_motion = by_normal @ contacts.d_normals.transpose(0, 1, 3, 2)
        derivative = xp.concatenate([by_motion, own_columns(by_force)], axis=3)
        value = self._friction * normal - length
        return Rows("load_friction", value.reshape(count, -1), derivative.reshape(count, -1, derivative.shape[3]))

    def _normals(self, contacts: BatchedContacts, answer: Array) -> list[Rows]:
        """Return how far normal forces stay from their limits in the worst cases."""
        count, n_c, _ = contacts.normals.shape
        rows = (contacts.normals[:, :, None] @ answer.reshape(count, n_c, 3, -1))[:, :, 0]
        low, high = self._worst(contacts.normal_forces, rows)
        found = [Rows("load_min_normal", low - self.loads.min_normal_force, contacts.d_normal_forces)]
        if np.isfinite(self.problem.max_normal_force):
            found.append(Rows("load_max_normal", self.problem.max_normal_force - high, -contacts.d_normal_forces))
        return found

    def _torques(self, contacts: BatchedContacts, answer: Array) -> list[Rows]:
        """Return how far joint torques stay from their limits in the worst cases."""
        limits = self.problem.torque_limits
        limited = np.flatnonzero(np.isfinite(limits))
        if not limited.size:
            return []
        count, n_c, n_q, _ = contacts.velocities.shape
        jacobian = contacts.velocities.transpose(0, 2, 1, 3).reshape(count, n_q, 3 * n_c)[:, limited]
        low, high = self._worst(contacts.torques[:, limited], jacobian @ answer)
        slope = contacts.d_torques[:, limited]
        xp = namespace(slope)
        value = xp.concatenate([limits[limited] + low, limits[limited] - high], axis=1)
        return [Rows("load_torque", value, xp.concatenate([slope, -slope], axis=1))]

    def _worst(self, value: Array, rows: Array) -> tuple[Array, Array]:
        """Return least and largest values of v − a·d over the listed cases and the spheres, of shape (B, k)."""
        xp = namespace(value)
        listed = value[..., None] - rows @ self._listed.T
        low, high = listed.min(axis=2), listed.max(axis=2)
        for part, radius in self._spheres:
            swing = radius * xp.linalg.norm(rows[..., part], axis=2)
            low, high = xp.minimum(low, value - swing), xp.maximum(high, value + swing)
        return low, high
