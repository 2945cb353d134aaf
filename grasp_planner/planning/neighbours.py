"""Starts near others: near grasps that were found, with less force to take, and near what came nearest to feasible.

Near a feasible grasp others are found after a few steps, and force comes down from one to the next. And some objects
are held in so few postures that no random start of thousands ends in one; but near a state that nearly meets every
requirement others come nearer, and near those others again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..grasp.grasp import Grasp
from ..multistart.states import States, rotations_exp
from ..problem.problem import GraspProblem
from .ranking import alike

MOST_GRASPS = 256
"""How many grasps are remembered, those with the least F."""
LESS_FORCE = 0.6, 1.2
"""Range of F that a start may take, as a share of what the grasp it is near takes: as a rule less, and sometimes more,
as the way to other grasps leads past such."""
MOST_STATES = 24
"""Most states that are remembered."""
ALIKE_PLACE, ALIKE_ANGLE = 2e-3, 0.02
"""Distances of palms [m] and of joint angles [rad] within which of two states the nearer is kept."""


@dataclass(frozen=True)
class Spread:
    """Standard deviations of starts around a state.

    Attributes:
        sigma: Of σ [rad].
        place: Of the palm's place [m].
        turn: Of its rotation vector [rad].
    """

    sigma: float
    place: float
    turn: float


NEAR_GRASPS, NEAR_STATES = Spread(0.045, 0.0045, 0.075), Spread(0.15, 0.006, 0.15)


class StartsNear(Protocol):
    """Something that starts can be made near."""

    def __len__(self) -> int:
        """Return how much is remembered."""

    def states(self, number: int, rng: np.random.Generator) -> States:
        """Return so many states near what is remembered, which is not nothing."""


class NearGrasps:
    """Starts near grasps of a problem, of those alike the one with the least F."""

    def __init__(self, problem: GraspProblem) -> None:
        self._problem = problem
        self._grasps: list[Grasp] = []

    def __len__(self) -> int:
        return len(self._grasps)

    def add(self, grasp: Grasp) -> None:
        """Remember a feasible grasp; if there are too many, forget the one that takes the most force."""
        pairs = [(each, alike(grasp, each)) for each in self._grasps]
        if any(same and each.force_norm <= grasp.force_norm for each, same in pairs):
            return
        kept = [each for each, same in pairs if not same]
        self._grasps = sorted([*kept, grasp], key=lambda each: each.force_norm)[:MOST_GRASPS]

    def states(self, number: int, rng: np.random.Generator) -> States:
        """Return states near remembered grasps, with a bound of F each."""
        chosen = [self._grasps[row] for row in rng.integers(len(self._grasps), size=number)]
        rotations = np.array([grasp.palm_pose.rotation for grasp in chosen])
        states = States(
            np.array([grasp.joint_angles for grasp in chosen]),
            rotations,
            np.array([grasp.palm_pose.translation for grasp in chosen]),
            np.array([grasp.forces for grasp in chosen]) @ rotations,
            np.array([grasp.force_norm for grasp in chosen]) * rng.uniform(*LESS_FORCE, number),
        )
        return _spread(states, self._problem, NEAR_GRASPS, rng)


class NearStates:
    """Starts near the states that came nearest to feasible, no two of which are alike."""

    def __init__(self, problem: GraspProblem) -> None:
        self._problem = problem
        self._kept: list[tuple[float, States]] = []

    def __len__(self) -> int:
        return len(self._kept)

    def add(self, found: Sequence[tuple[float, States]]) -> None:
        """Keep states, given with their costs and each a batch of one, that are nearer than what is kept."""
        kept: list[tuple[float, States]] = []
        for cost, state in sorted([*self._kept, *found], key=lambda each: each[0]):
            if len(kept) < MOST_STATES and not any(_alike(state, other) for _, other in kept):
                kept.append((cost, state))
        self._kept = kept

    def states(self, number: int, rng: np.random.Generator) -> States:
        """Return states near those kept, free to take any force."""
        first, *others = (self._kept[row][1] for row in rng.integers(len(self._kept), size=number))
        free = replace(first.joined(*others), most_force=np.full(number, np.inf))
        return _spread(free, self._problem, NEAR_STATES, rng)


def _spread(states: States, problem: GraspProblem, spread: Spread, rng: np.random.Generator) -> States:
    """Return states moved at random along the synergies and with their palms."""
    number, hand, basis = len(states), problem.hand, problem.synergies.basis
    joints = states.joints + rng.normal(0.0, spread.sigma, (number, basis.shape[1])) @ basis.T
    turned = rotations_exp(rng.normal(0.0, spread.turn, (number, 3)))
    return replace(
        states,
        joints=np.clip(joints, hand.lower, hand.upper),
        rotation=states.rotation @ turned,
        translation=states.translation + rng.normal(0.0, spread.place, (number, 3)),
    )


def _alike(first: States, second: States) -> bool:
    """Return whether two states, each a batch of one, are nearly one."""
    apart = float(np.linalg.norm(first.translation - second.translation))
    return apart < ALIKE_PLACE and float(np.abs(first.joints - second.joints).max()) < ALIKE_ANGLE
