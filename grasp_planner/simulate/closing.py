"""How the hand closes: its references from an open hand to a touching one to the plan's squeeze."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..grasp.grasp import Grasp
from ..spatial import Array
from .gate import check_posture
from .protocol import Geometry

OPENINGS = (0.02, 0.012, 0.006, 0.003, 0.0015)
"""Mean distances of the open fingertips from the object [m] …"""
OPENING_DAMPINGS = (0.1, 0.03, 0.01, 0.001)
"""… reached with steps of the references damped as these [m/rad]; the first open posture without overlap is taken."""
DAMPING = 1e-3
"""Damping of the least-squares problem of the touching references [m/rad]."""


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


def reference_path(grasp: Grasp, geometry: Geometry = "links") -> ReferencePath:
    """Return how the references go from an open hand to a grasp.

    Args:
        grasp: The grasp.
        geometry: What of the hand must not overlap when it is open.

    Returns:
        The references.
    """
    synergies, n_s = grasp.problem.synergies, grasp.problem.n_synergies
    jacobian = grasp.configuration.contact_jacobian(grasp.problem.frames, grasp.contacts.points)
    by_sigma = jacobian @ synergies.basis
    regular = DAMPING**2 * np.eye(n_s)
    # The free hand stands at q̄ + S σ: its fingertips are at the contacts where J (q̄ + S σ − q) = 0.
    away = jacobian @ (grasp.joint_angles - grasp.reference_joint_angles)
    touching = grasp.sigma + np.linalg.solve(by_sigma.T @ by_sigma + regular, by_sigma.T @ away)
    slopes = -np.einsum("ij,ijk->ik", grasp.contacts.normals, by_sigma.reshape(-1, 3, n_s))
    candidates = [
        touching + opening * _opening_step(slopes, damping) for opening in OPENINGS for damping in OPENING_DAMPINGS
    ]
    reports = []
    for sigma in candidates:
        reports.append(check_posture(grasp, free_posture(grasp, sigma), "open", geometry, 0.0))
        if reports[-1].passed:
            break
    overlaps = [max(report.object_overlap, report.self_overlap) for report in reports]
    return ReferencePath(candidates[int(np.argmin(overlaps))], touching, grasp.sigma)


def _opening_step(slopes: Array, damping: float) -> Array:
    """Return the step of the references that opens the fingertips by 1 m on average, all alike where it can."""
    regular = damping**2 * np.eye(slopes.shape[1])
    step = np.linalg.solve(slopes.T @ slopes + regular, slopes.T @ np.ones(len(slopes)))
    return step / max(float((slopes @ step).mean()), 1e-3)


def free_posture(grasp: Grasp, sigma: Array) -> Array:
    """Return the posture of the hand without contact, within its limits [rad], of shape (n_q,)."""
    hand = grasp.problem.hand
    return np.clip(grasp.problem.synergies.joint_angles(sigma), hand.lower, hand.upper)
