"""Starts near grasps that were found, each with less force to take: soon feasible, and force comes down on the way."""

from __future__ import annotations

import numpy as np

from ..grasp.grasp import Grasp
from ..multistart.states import States
from ..problem.problem import GraspProblem
from .ranking import alike

MOST_PARENTS = 256
"""How many grasps are remembered, those with the least F."""
JOINT_STEP, PALM_STEP, TURN_STEP = 0.045, 0.0045, 0.075
"""Standard deviations of a start's joint angles along the synergies [rad], of its palm's place [m] and turn [rad]."""
LESS_FORCE = 0.6, 1.2
"""Range of F that a start may take, as a share of what the grasp it is near takes: as a rule less, and sometimes more,
as the way to other grasps leads past such."""


class Neighbours:
    """Remembers grasps of a problem, of those alike the one with the least F, and makes starts near them."""

    def __init__(self, problem: GraspProblem) -> None:
        basis = problem.synergies.basis
        self._problem, self._along = problem, basis @ np.linalg.pinv(basis)
        self._grasps: list[Grasp] = []

    def __len__(self) -> int:
        return len(self._grasps)

    def add(self, grasp: Grasp) -> None:
        """Remember a feasible grasp; if there are too many, forget the one that takes the most force."""
        pairs = [(each, alike(grasp, each)) for each in self._grasps]
        if any(same and each.force_norm <= grasp.force_norm for each, same in pairs):
            return
        kept = [each for each, same in pairs if not same]
        self._grasps = sorted([*kept, grasp], key=lambda each: each.force_norm)[:MOST_PARENTS]

    def states(self, number: int, rng: np.random.Generator) -> States:
        """Return states near remembered grasps.

        Args:
            number: How many.
            rng: Source of random numbers.
        """
        hand, chosen = self._problem.hand, [self._grasps[row] for row in rng.integers(len(self._grasps), size=number)]
        rotations = np.array([grasp.palm_pose.rotation for grasp in chosen])
        states = States(
            np.array([grasp.joint_angles for grasp in chosen]),
            rotations,
            np.array([grasp.palm_pose.translation for grasp in chosen]),
            np.array([grasp.forces for grasp in chosen]) @ rotations,
            np.array([grasp.force_norm for grasp in chosen]) * rng.uniform(*LESS_FORCE, number),
        )
        bend = rng.normal(0.0, JOINT_STEP, (number, hand.n_joints)) @ self._along
        moved = rng.normal(0.0, np.repeat((PALM_STEP, TURN_STEP), 3), (number, 6))
        still = np.zeros((number, 3 * len(self._problem.frames)))
        return states.stepped(np.hstack([bend, moved, still]), hand.lower, hand.upper)
