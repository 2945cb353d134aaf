"""A push on a held object: how the hand answers, its motors at rest, and how much of its friction every finger uses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..grasp.grasp import Grasp
from ..judge.load_check import response_matrix
from ..spatial import Array

GOOD, NEAR, LOST = (67, 170, 110), (236, 170, 40), (220, 38, 60)
"""Colours of a finger that uses nothing, four fifths and all of its friction."""
NEARLY = 0.8


PUSH_SCALE, PUSH_BEGINS = 0.02, 0.06
"""Length of a push [m/N], and how far from the object's centre its arrow ends [m]."""


@dataclass(frozen=True)
class PushedGrasp:
    """A pushed grasp.

    Attributes:
        push: The force on the object in O [N], of shape (3,).
        forces: Of the hand on the object [N], of shape (n_c, 3).
        use: Share of its friction that every contact uses, |f_t|/(μ f_n); infinite where it pulls, of shape (n_c,).
    """

    push: Array
    forces: Array
    use: Array

    @property
    def colours(self) -> np.ndarray:
        """Colour of every force: green, amber from four fifths of the friction on, red where it slips."""
        low, high = np.clip(self.use / NEARLY, 0.0, 1.0), self.use >= 1.0
        mixed = np.array(GOOD) + low[:, None] * (np.array(NEAR) - np.array(GOOD))
        return np.where(high[:, None], np.array(LOST), mixed).astype(np.uint8)

    def text(self, names: list[str]) -> str:
        """Return what every finger uses (Markdown)."""
        rows = ["| contact | force N | of its friction |", "|---|--:|--:|"]
        for name, force, use in zip(names, self.forces, self.use, strict=True):
            share = f"{100.0 * use:.0f} %" if np.isfinite(use) else "lifted off"
            rows.append(f"| {name} | {np.linalg.norm(force):.2f} | {share}{' ✘ slips' if use >= 1.0 else ''} |")
        return "\n".join(rows)


def pushed(grasp: Grasp, push: Array) -> PushedGrasp:
    """Return how a hand answers to a push on the object's centre, its motors at rest: f − R Δw.

    Args:
        grasp: The grasp.
        push: The force in O [N], of shape (3,).
    """
    problem = grasp.problem
    response = response_matrix(problem, grasp.grasp_matrix, grasp.hand_jacobian)
    change = response @ np.concatenate([push, np.zeros(3)])
    intensities = grasp.intensities - change.reshape(grasp.intensities.shape)
    forces = problem.contact_model.forces(intensities, grasp.contacts.normals)
    normal = np.einsum("ij,ij->i", forces, grasp.contacts.normals)
    across = np.linalg.norm(forces - normal[:, None] * grasp.contacts.normals, axis=1)
    use = np.where(normal > 0.0, across / (problem.friction * np.maximum(normal, 1e-12)), np.inf)
    return PushedGrasp(push, forces, use)


def push_arrow(push: Array) -> Array:
    """Return begin and end of the arrow of a push in O [m], of shape (2, 3)."""
    size = float(np.linalg.norm(push))
    way = push / size if size > 0.0 else np.array([0.0, 0.0, -1.0])
    return np.array([-(PUSH_BEGINS + PUSH_SCALE * size) * way, -PUSH_BEGINS * way])


def push_from(point: Array) -> Array:
    """Return the push whose arrow begins at a point in O [m]; the inverse of :func:`push_arrow`."""
    distance = float(np.linalg.norm(point))
    if distance < 1e-9:
        return np.zeros(3)
    return -point / distance * max(0.0, distance - PUSH_BEGINS) / PUSH_SCALE
