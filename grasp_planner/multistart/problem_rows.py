"""The springs problem as rows: everything that a search holds, for a batch of states."""

from __future__ import annotations

import numpy as np

from ..evaluation.edge_reserve import edge_reserve_and_slope, edges_count
from ..model.compliance import bent, softened
from ..problem.cone_reserve import cone_reserve
from ..problem.finger_share import shares_removed, wants_shares
from ..problem.problem import GraspProblem
from ..problem.tendon_drive import driving_tendons, tension_map
from ..problem.term import METRE, NEWTON, NEWTON_METRE, ONE, RADIAN, Unit
from ..spatial import Array, namespace, skew
from .clearances import BatchedClearances
from .contacts import BatchedContactEvaluator, BatchedContacts
from .loads import BatchedLoads
from .rows import Rows, side_by_side
from .states import States
from .tree import BatchedTree

UNITS: dict[str, Unit] = {
    "surface": METRE,
    "compliance": RADIAN,
    "equilibrium_force": NEWTON,
    "equilibrium_moment": NEWTON_METRE,
    "friction": NEWTON,
    "finger_share": NEWTON,
    "most_force": NEWTON,
    "region": METRE,
    "edge": RADIAN,
    "abduction_order": RADIAN,
    "tension": NEWTON,
    "load_friction": NEWTON,
    "load_min_normal": NEWTON,
    "load_max_normal": NEWTON,
    "load_torque": NEWTON_METRE,
    "load_force_norm": NEWTON,
    "link_object": METRE,
    "joint_centre": METRE,
    "self_collision": METRE,
    "ground": METRE,
    "tip_patch": ONE,
    "tangency": ONE,
}
"""Units of the rows, by the name of their requirement."""


class BatchedProblem:
    """Evaluates the rows of a problem whose forces come from springs.

    Attributes:
        problem: The problem.
        n_variables: Length of x = (q, v, w, f).
    """

    def __init__(self, problem: GraspProblem) -> None:
        self.problem = problem
        self.n_variables = problem.hand.n_joints + 6 + 3 * len(problem.frames)
        tree = BatchedTree(problem.hand)
        self._contacts = BatchedContactEvaluator(problem, tree)
        self._loads = BatchedLoads(problem) if problem.loads.active else None
        self._clearances = BatchedClearances(problem, tree) if problem.clearance.needs_geometry else None
        self._complement = problem.synergies.complement()
        self._tendons = driving_tendons(problem)
        self._pulls = np.zeros((0, 0)) if self._tendons is None else tension_map(problem, self._tendons)

    def contacts(self, states: States) -> BatchedContacts:
        """Return the contacts of states."""
        return self._contacts.evaluate(states)

    def rows(self, states: States) -> list[Rows]:
        """Return the rows of states, those of the same requirements for any states."""
        problem, contacts = self.problem, self.contacts(states)
        found = [
            Rows("surface", contacts.gaps, side_by_side([contacts.d_gaps], self.n_variables), equality=True),
            *self._springs(contacts),
            Rows("equilibrium_force", contacts.balance[:, :3], contacts.d_balance[:, :3], equality=True),
            Rows("equilibrium_moment", contacts.balance[:, 3:], contacts.d_balance[:, 3:], equality=True),
            Rows("friction", *contacts.cone_margins(problem.friction - cone_reserve(problem))),
            *self._shares(contacts),
            Rows("most_force", *contacts.force_room),
            *self._region(contacts),
            *self._edge(contacts),
        ]
        if problem.clearance.remark1 and len(problem.abduction_differences):
            order = problem.abduction_differences
            slope = namespace(states.joints).broadcast_to(order, (len(states), *order.shape))
            found.append(Rows("abduction_order", states.joints @ order.T, side_by_side([slope], self.n_variables)))
        if self._loads is not None:
            found += self._loads.rows(contacts)
        if self._clearances is not None:
            found += self._clearances.rows(contacts)
        return found

    def _springs(self, contacts: BatchedContacts) -> list[Rows]:
        """Return S_⊥ᵀ (q − q̄ + C_q τ), and what is left to the limits of tensions."""
        problem, compliance = self.problem, self.problem.joint_compliance
        off = contacts.states.joints - problem.synergies.mean + softened(contacts.torques, compliance)
        slope = bent(compliance, contacts.d_torques) + np.eye(problem.hand.n_joints, self.n_variables)
        found = [Rows("compliance", off @ self._complement, self._complement.T @ slope, equality=True)]
        if self._tendons is not None and self._pulls.size:
            rows = np.vstack([self._pulls, -self._pulls])
            room = np.concatenate([-self._tendons.least, self._tendons.largest])
            kept = np.isfinite(room)
            found.append(Rows("tension", off @ rows[kept].T + room[kept], rows[kept] @ slope))
        return found

    def _shares(self, contacts: BatchedContacts) -> list[Rows]:
        """Return what normal forces have more than their least share."""
        if not wants_shares(self.problem):
            return []
        kept = shares_removed(self.problem)
        return [Rows("finger_share", contacts.normal_forces @ kept.T, kept @ contacts.d_normal_forces)]

    def _region(self, contacts: BatchedContacts) -> list[Rows]:
        """Return how far contacts are inside the part of the surface that may be touched."""
        points, moved = _in_object(contacts)
        margins, gradients = self.problem.grasp_object.region(points.reshape(-1, 3))
        if margins.shape[1] == 0:
            return []
        slope = gradients.reshape(*points.shape[:2], -1, 3) @ moved.swapaxes(2, 3)
        count = len(points)
        derivative = side_by_side([slope.reshape(count, -1, slope.shape[3])], self.n_variables)
        return [Rows("region", margins.reshape(count, -1), derivative)]

    def _edge(self, contacts: BatchedContacts) -> list[Rows]:
        """Return how far contacts are from edges."""
        problem, count = self.problem, len(contacts.states)
        if not edges_count(problem):
            return []
        points, moved = _in_object(contacts)
        turned = contacts.states.rotation[:, None]
        normals = (turned @ contacts.normals[..., None])[..., 0]
        still, turning = contacts.d_normals[:, :, :-3], contacts.d_normals[:, :, -3:] + skew(contacts.normals)
        leant = namespace(still).concatenate([still, turning], axis=2) @ turned.swapaxes(2, 3)
        value, slope = edge_reserve_and_slope(problem.grasp_object, points, normals, moved, leant)
        derivative = side_by_side([slope.reshape(count, -1, slope.shape[3])], self.n_variables)
        return [Rows("edge", value.reshape(count, -1), derivative)]


def _in_object(contacts: BatchedContacts) -> tuple[Array, Array]:
    """Return the contact points in O [m], of shape (B, n_c, 3), and their derivatives, of shape (B, n_c, n_g, 3)."""
    states = contacts.states
    turned = states.rotation[:, None]
    points = (turned @ contacts.points[..., None])[..., 0] + states.translation[:, None]
    slope = contacts.d_points
    # With the palm's own motion; row k of skew(p) is e_k × p.
    moved = [slope[:, :, :-6], slope[:, :, -6:-3] + np.eye(3), slope[:, :, -3:] + skew(contacts.points)]
    return points, namespace(points).concatenate(moved, axis=2) @ turned.swapaxes(2, 3)
