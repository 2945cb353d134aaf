"""What came near among many starts: moved at random it begins again, where hardly any other start gets so far.

Some objects are held in so few postures that no random start of thousands ends in one; but near a state that nearly
meets every requirement others come nearer, and near those others again.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..multistart.states import States, rotations_exp
from ..problem.problem import GraspProblem

KEPT = 24
"""Most states that are kept."""
ALIKE_PLACE, ALIKE_ANGLE = 2e-3, 0.02
"""Distances of palms [m] and of joint angles [rad] within which of two states the nearer is kept."""
SIGMA_STEP, PLACE_STEP, TURN_STEP = 0.15, 0.006, 0.15
"""Standard deviations by which σ [rad], place [m] and rotation vector [rad] of a palm are moved."""


class NearStates:
    """States that came nearest to feasible in the rounds so far, no two of them alike."""

    def __init__(self, problem: GraspProblem) -> None:
        self._problem = problem
        self._kept: list[tuple[float, States]] = []

    def __len__(self) -> int:
        return len(self._kept)

    def learn(self, found: Sequence[tuple[float, States]]) -> None:
        """Keep states, given with their costs and each a batch of one, that are nearer than what is kept."""
        kept: list[tuple[float, States]] = []
        for cost, state in sorted([*self._kept, *found], key=lambda each: each[0]):
            if len(kept) < KEPT and not any(_alike(state, other) for _, other in kept):
                kept.append((cost, state))
        self._kept = kept

    def moved(self, number: int, rng: np.random.Generator) -> States:
        """Return so many of those kept, any of them, each moved at random along the synergies and with its palm.

        Args:
            number: How many, at least one; some have to be kept.
            rng: Source of random numbers.
        """
        hand, basis = self._problem.hand, self._problem.synergies.basis
        chosen = [self._kept[index][1] for index in rng.integers(len(self._kept), size=number)]
        joints = np.concatenate([each.joints for each in chosen])
        joints = joints + rng.normal(0.0, SIGMA_STEP, (number, basis.shape[1])) @ basis.T
        turned = rotations_exp(rng.normal(0.0, TURN_STEP, (number, 3)))
        return States(
            np.clip(joints, hand.lower, hand.upper),
            np.concatenate([each.rotation for each in chosen]) @ turned,
            np.concatenate([each.translation for each in chosen]) + rng.normal(0.0, PLACE_STEP, (number, 3)),
            np.concatenate([each.forces for each in chosen]),
        )


def _alike(first: States, second: States) -> bool:
    """Return whether two states, each a batch of one, are nearly one."""
    apart = float(np.linalg.norm(first.translation - second.translation))
    return apart < ALIKE_PLACE and float(np.abs(first.joints - second.joints).max()) < ALIKE_ANGLE
