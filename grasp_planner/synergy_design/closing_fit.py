"""How well synergies close a hand around an object: what they reach as a rigid hand, before compliance helps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..grasp.grasp import Grasp
from ..planning.preparation import ROUND, best_prepared
from ..planning.starts import random_start, standard_start
from ..problem.problem import GraspProblem


@dataclass(frozen=True)
class ClosingFit:
    """The best fit of a rigid hand along its synergies.

    Attributes:
        n_synergies: n_s.
        gap: Largest gap between a contact and the surface [m].
        cone_share: Least (μ f_n − |f_t|)/|f| of the contact forces; negative outside the cone.
    """

    n_synergies: int
    gap: float
    cone_share: float


def closing_fit(problem: GraspProblem, seed: int = 0) -> ClosingFit:
    """Fit a rigid hand to an object along few synergies: the best of forty prepared starts.

    Args:
        problem: The problem, of at most four synergies.
        seed: Seed of the starts.

    Returns:
        The fit.
    """
    rng = np.random.default_rng(seed)
    starts = [standard_start(problem), *(random_start(problem, rng) for _ in range(ROUND - 1))]
    start = best_prepared(problem, starts)[0].start
    grasp = Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma)
    sizes = np.maximum(np.linalg.norm(grasp.intensities, axis=1), 1e-9)
    share = float((grasp.friction_margins / sizes).min())
    return ClosingFit(problem.n_synergies, float(np.abs(grasp.contacts.gaps).max()), share)
