"""The references of a closing hand: from an open hand to a touching one to the plan's squeeze."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..hand.configuration import HandConfiguration
from ..judge.clearance_check import configuration_clearances, penetration
from ..judge.posed_grasp import PosedGrasp
from ..model.compliance import softened
from ..model.contacts import find_contacts, fingertip_positions
from ..problem.problem import GraspProblem
from ..problem.tendon_drive import driving_tendons
from ..problem.term import above_zero
from ..spatial import Array, Pose
from .contact_law import block_diagonal
from .onward import Onward, way_on

OPENINGS = (0.02, 0.012, 0.006, 0.0025)
"""Mean distances of the open fingertips from the object [m] …"""
OPENING_DAMPINGS = (0.1, 0.03, 0.005)
"""… reached with steps of the references damped as these [m/rad]; the first open posture without overlap is taken."""
MANNERS = (("stiffness", 0.03), ("surface", 0.03), ("alike", 0.1), ("stiffness", 0.1))
"""How the touching references are chosen: what weighs the way of a free fingertip from its contact (its stiffness;
along the surface rather than through it; every way alike), and the damping towards the planned posture [m/rad]."""
THROUGH = 0.2
"""Weight of a way through the surface against one along it: the finger then only touches sooner or later."""
RIGID = 0.2
"""Least compliance of a fingertip that counts, relative to the mean: a stretched finger has directions without any."""


@dataclass(frozen=True)
class ReferencePath:
    """References σ [rad] of the stages of a closing hand, each of shape (n_s,).

    Attributes:
        open: The hand is open.
        touching: The free hand's fingertips are where they touch, as well as the synergies can.
        squeezing: The plan's own references, or beyond them.
        factor: How far they go beyond the plan's: from touching this many times as far.
        overlap: Deepest overlap of the open hand with the object or with itself [m].
        onward: How the references go on from squeezing to press harder; None where that is not known.
    """

    open: Array
    touching: Array
    squeezing: Array
    overlap: float = 0.0
    factor: float = 1.0
    onward: Onward | None = None

    def beyond(self, factor: float) -> ReferencePath:
        """Return the path that goes on from touching a number of times as far."""
        squeezing = self.touching + factor * (self.squeezing - self.touching)
        return replace(self, squeezing=squeezing, factor=factor * self.factor)

    def stages(self) -> tuple[tuple[Array, Array], ...]:
        """Return where each stage begins and ends."""
        return (self.open, self.touching), (self.touching, self.squeezing)

    def at(self, time: float) -> Array:
        """Return σ at a time: 0 open, 1 touching, 2 squeezing [rad], of shape (n_s,)."""
        if time <= 1.0:
            return self.open + time * (self.touching - self.open)
        return self.touching + (time - 1.0) * (self.squeezing - self.touching)


def reference_paths(grasp: PosedGrasp, *, links: bool = True) -> Iterator[ReferencePath]:
    """Yield ways in which the references go from an open hand to a grasp, the usual one first.

    Args:
        grasp: The grasp.
        links: Whether no link may overlap when the hand is open; if not, only fingertips count.

    Yields:
        The references; with one synergy there is one way only.
    """
    problem, synergies = grasp.problem, grasp.problem.synergies
    jacobian = grasp.configuration.contact_jacobian(problem.frames, grasp.contacts.points)
    by_sigma = jacobian @ synergies.basis
    slopes = -np.einsum("ij,ijk->ik", grasp.contacts.normals, by_sigma.reshape(-1, 3, problem.n_synergies))
    steps = [_opening_step(slopes, damping) for damping in OPENING_DAMPINGS]
    onward = way_on(grasp)
    # The free hand stands at q̄ + S σ: its fingertips are at the contacts where J (q̄ + S σ − q) = 0.
    near = synergies.coordinates(grasp.joint_angles)
    away = jacobian @ (grasp.joint_angles - synergies.joint_angles(near))
    for kind, damping in MANNERS[: len(MANNERS) if problem.n_synergies > 1 else 1]:
        weights = _weights(grasp, jacobian, kind)
        rows = weights @ by_sigma
        normal = rows.T @ rows + damping**2 * synergies.basis.T @ synergies.basis
        touching = near + np.linalg.solve(normal, rows.T @ (weights @ away))
        opened, overlap = _opened(grasp, touching, steps, links)
        yield ReferencePath(opened, touching, grasp.sigma, overlap, onward=onward)


def reference_path(grasp: PosedGrasp, *, links: bool = True) -> ReferencePath:
    """Return the first way from an open hand to a grasp that begins without overlap; if none does, with the least."""
    best: ReferencePath | None = None
    for path in reference_paths(grasp, links=links):
        if best is None or path.overlap < best.overlap:
            best = path
        if best.overlap <= 0.0:
            break
    assert best is not None
    return best


def _opened(grasp: PosedGrasp, touching: Array, steps: list[Array], links: bool) -> tuple[Array, float]:
    """Return the references of the open hand, as wide as it opens without overlap, and the overlap that remains [m]."""
    best, least = touching, np.inf
    lowest = _slack(grasp.problem)
    for sigma in (np.maximum(touching + opening * step, lowest) for opening in OPENINGS for step in steps):
        overlap = max(posture_overlaps(grasp.problem, free_posture(grasp, sigma), grasp.palm_pose, links=links))
        if overlap < least:
            best, least = sigma, overlap
        if overlap <= 0.0:
            break
    return best, least


def _slack(problem: GraspProblem) -> Array:
    """Return the references that tendons can't go below, those without tension [rad], of shape (n_s,)."""
    tendons = driving_tendons(problem)
    if tendons is None:
        return np.full(problem.n_synergies, -np.inf)
    return tendons.least * tendons.scales(problem.joint_compliance)


def _weights(grasp: PosedGrasp, jacobian: Array, kind: str) -> Array:
    """Return what weighs ways of the fingertips, of shape (3 n_c, 3 n_c), about 1 in size."""
    n_c = len(grasp.problem.frames)
    normals = grasp.contacts.normals
    blocks = np.tile(np.eye(3), (n_c, 1, 1))
    if kind == "surface":
        blocks = blocks - (1.0 - THROUGH) * normals[:, :, None] * normals[:, None, :]
    elif kind == "stiffness":
        tips = softened(jacobian, grasp.problem.joint_compliance) @ jacobian.T
        compliance = tips.reshape(n_c, 3, n_c, 3)[np.arange(n_c), :, np.arange(n_c), :]
        values, axes = np.linalg.eigh(compliance)
        mean = values.mean()
        relative = np.sqrt(1.0 / (values / mean + RIGID)) if mean > 0.0 else np.ones_like(values)
        blocks = (axes * relative[:, None, :]) @ axes.transpose(0, 2, 1)
    return block_diagonal(blocks)


def _opening_step(slopes: Array, damping: float) -> Array:
    """Return the step of the references that opens the fingertips by 1 m on average, all alike where it can."""
    regular = damping**2 * np.eye(slopes.shape[1])
    step = np.linalg.solve(slopes.T @ slopes + regular, slopes.T @ np.ones(len(slopes)))
    return step / max(float((slopes @ step).mean()), 1e-3)


def free_posture(grasp: PosedGrasp, sigma: Array) -> Array:
    """Return the posture of the hand without contact, within its limits [rad], of shape (n_q,)."""
    hand = grasp.problem.hand
    return np.clip(grasp.problem.synergies.joint_angles(sigma), hand.lower, hand.upper)


def posture_overlaps(
    problem: GraspProblem, q: Array, palm_pose: Pose, *, links: bool = True
) -> tuple[float, float, float]:
    """Return the deepest overlaps of the hand with the object, with itself and with the table at a posture [m].

    Args:
        problem: The problem.
        q: The posture [rad], of shape (n_q,).
        palm_pose: Pose of the palm in O.
        links: Whether all solids of the hand count; if not, only the fingertips and the object.

    Returns:
        The three overlaps; that with the table is 0 where the problem has none.
    """
    centres = fingertip_positions(problem.hand, problem.frames, q, palm_pose)
    gaps = find_contacts(centres, problem.radii, problem.grasp_object.solid).gaps
    overlap = above_zero(-gaps.min())
    if not links:
        return overlap, 0.0, 0.0
    clearances = configuration_clearances(problem, HandConfiguration(problem.hand, q, palm_pose), near=0.0)
    overlap = above_zero(np.maximum(overlap, penetration(clearances, "link_object")))
    return overlap, penetration(clearances, "self_collision"), penetration(clearances, "ground")
