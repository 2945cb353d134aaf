"""How the hand closes: its references from an open hand to a touching one to the plan's squeeze."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contacts import find_contacts, fingertip_positions
from ..grasp import Grasp
from ..spatial import Array

OPENINGS = (0.02, 0.015, 0.01, 0.006, 0.003)
"""Distances the open fingertips keep from the object [m]; the first that all of them reach is taken."""
DAMPING = 1e-3
"""Damping of the least-squares problems [m/rad]."""


@dataclass(frozen=True)
class ReferencePath:
    """References σ [rad] of the stages of a closing hand, each of shape (n_s,).

    Attributes:
        open: The hand is open.
        touching: The free hand's fingertips are where they touch, as well as the synergies can.
        squeezing: The plan's own references.
    """

    open: Array
    touching: Array
    squeezing: Array

    def stages(self) -> tuple[tuple[Array, Array], ...]:
        """Return where each stage begins and ends."""
        return (self.open, self.touching), (self.touching, self.squeezing)


def reference_path(grasp: Grasp) -> ReferencePath:
    """Return how the references go from an open hand to a grasp.

    Args:
        grasp: The grasp.

    Returns:
        The references.
    """
    synergies, n_s = grasp.problem.synergies, grasp.problem.n_synergies
    by_sigma = grasp.hand_jacobian @ synergies.basis
    regular = DAMPING**2 * np.eye(n_s)
    # The free hand stands at q̄ + S σ: its fingertips are at the contacts where J (q̄ + S σ − q) = 0.
    away = grasp.hand_jacobian @ (grasp.joint_angles - grasp.reference_joint_angles)
    touching = grasp.sigma + np.linalg.solve(by_sigma.T @ by_sigma + regular, by_sigma.T @ away)
    slopes = -np.einsum("ij,ijk->ik", grasp.contacts.normals, by_sigma.reshape(-1, 3, n_s))
    step = np.linalg.solve(slopes.T @ slopes + regular, slopes.T @ np.ones(len(slopes)))
    candidates = [touching + opening * step for opening in OPENINGS]
    gaps = [float(free_gaps(grasp, sigma).min()) for sigma in candidates]
    clear = next((k for k, gap in enumerate(gaps) if gap > 0.0), int(np.argmax(gaps)))
    return ReferencePath(candidates[clear], touching, grasp.sigma)


def free_posture(grasp: Grasp, sigma: Array) -> Array:
    """Return the posture of the hand without contact, within its limits [rad], of shape (n_q,)."""
    hand = grasp.problem.hand
    return np.clip(grasp.problem.synergies.joint_angles(sigma), hand.lower, hand.upper)


def free_gaps(grasp: Grasp, sigma: Array) -> Array:
    """Return the gaps of the fingertips of the hand without contact [m], of shape (n_c,)."""
    problem = grasp.problem
    centres = fingertip_positions(problem.hand, problem.frames, free_posture(grasp, sigma), grasp.palm_pose)
    return find_contacts(centres, problem.radii, problem.grasp_object.solid).gaps
