"""Where the contacts of a hand can go, and where its opposing finger meets the others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from ..spatial import Array
from .configuration import HandConfiguration
from .hand import Hand

SAMPLES = 2000
"""Random postures that a workspace is made of."""
NEAR = 0.01
"""Distance to a place of another finger within which both reach it, and edge of the cells of a volume [m]."""


@dataclass(frozen=True)
class Workspace:
    """Where contacts went in random postures, in the palm frame.

    Attributes:
        thumb: Places of the opposing finger's contacts [m], of shape (n, 3).
        others: Places of the other fingers' contacts [m], of shape (m, 3).
        shared: Which places of the opposing finger others reach too, of shape (n,).
        volume: Volume of the cells that the opposing finger reaches [m³].
    """

    thumb: Array
    others: Array
    shared: npt.NDArray[np.bool_]
    volume: float

    @property
    def overlap(self) -> float:
        """Share of the places of the opposing finger that others reach too."""
        return float(self.shared.mean())


def find_workspace(hand: Hand, contact_set: str, n_thumb: int, rng: np.random.Generator) -> Workspace:
    """Return where the contacts of a set go.

    Args:
        hand: The hand.
        contact_set: Name of the set, the contacts of the opposing finger first.
        n_thumb: How many these are.
        rng: Source of the postures, uniform within joint limits.
    """
    frames = hand.contact_frames(contact_set)
    postures = rng.uniform(hand.lower, hand.upper, size=(SAMPLES, hand.n_joints))
    places = np.array([HandConfiguration(hand, q).contact_centres(frames) for q in postures])
    thumb, others = places[:, :n_thumb].reshape(-1, 3), places[:, n_thumb:].reshape(-1, 3)
    shared = np.zeros(len(thumb), dtype=bool)
    if len(others):
        shared = cKDTree(others).query(thumb)[0] < NEAR
    cells = np.unique(np.floor(thumb / NEAR).astype(int), axis=0)
    return Workspace(thumb, others, shared, len(cells) * NEAR**3)
