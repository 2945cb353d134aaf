"""The references of a closing hand: from an open hand to a touching one to the plan's squeeze."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..judge.clearance_check import hand_clearances, penetration
from ..judge.posed_grasp import PosedGrasp
from ..model.contacts import find_contacts, fingertip_positions
from ..problem.problem import GraspProblem
from ..problem.term import above_zero
from ..spatial import Array, Pose

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

    def at(self, time: float) -> Array:
        """Return σ at a time: 0 open, 1 touching, 2 squeezing [rad], of shape (n_s,)."""
        if time <= 1.0:
            return self.open + time * (self.touching - self.open)
        return self.touching + (time - 1.0) * (self.squeezing - self.touching)


def reference_path(grasp: PosedGrasp, *, links: bool = True) -> ReferencePath:
    """Return how the references go from an open hand to a grasp.

    Args:
        grasp: The grasp.
        links: Whether no link may overlap when the hand is open; if not, only fingertips count.

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
    steps = [_opening_step(slopes, damping) for damping in OPENING_DAMPINGS]
    best, least = touching, np.inf
    for sigma in (touching + opening * step for opening in OPENINGS for step in steps):
        overlap = max(posture_overlaps(grasp.problem, free_posture(grasp, sigma), grasp.palm_pose, links=links))
        if overlap < least:
            best, least = sigma, overlap
        if overlap <= 0.0:
            break
    return ReferencePath(best, touching, grasp.sigma)


def _opening_step(slopes: Array, damping: float) -> Array:
    """Return the step of the references that opens the fingertips by 1 m on average, all alike where it can."""
    regular = damping**2 * np.eye(slopes.shape[1])
    step = np.linalg.solve(slopes.T @ slopes + regular, slopes.T @ np.ones(len(slopes)))
    return step / max(float((slopes @ step).mean()), 1e-3)


def free_posture(grasp: PosedGrasp, sigma: Array) -> Array:
    """Return the posture of the hand without contact, within its limits [rad], of shape (n_q,)."""
    hand = grasp.problem.hand
    return np.clip(grasp.problem.synergies.joint_angles(sigma), hand.lower, hand.upper)


def posture_overlaps(problem: GraspProblem, q: Array, palm_pose: Pose, *, links: bool = True) -> tuple[float, float]:
    """Return the deepest overlaps of the hand with the object and with itself at a posture [m].

    Args:
        problem: The problem.
        q: The posture [rad], of shape (n_q,).
        palm_pose: Pose of the palm in O.
        links: Whether all solids of the hand count; if not, only the fingertips and the object.
    """
    centres = fingertip_positions(problem.hand, problem.frames, q, palm_pose)
    gaps = find_contacts(centres, problem.radii, problem.grasp_object.solid).gaps
    overlap = above_zero(-gaps.min())
    if not links:
        return overlap, 0.0
    clearances = hand_clearances(problem, q, palm_pose)
    overlap = above_zero(np.maximum(overlap, penetration(clearances, "link_object")))
    return overlap, penetration(clearances, "self_collision")
