"""Joints keep away from their stops."""

from __future__ import annotations

import numpy as np

from ..evaluation.state import GraspState
from ..hand.hand import Hand
from ..judge.posed_grasp import PosedGrasp
from ..problem.problem import GraspProblem
from ..spatial import Array
from .small_cost import SmallCost

POWER = 6
"""How sharply it rises towards a stop: half way there it is a sixty-fourth."""


class JointStops(SmallCost):
    """Mean of ((q − middle)/(range/2))⁶: nearly nothing in the middle half of the range, 1 where all are on a stop."""

    name, setting = "joint_stops", "stop_weight"

    def measure(self, problem: GraspProblem, state: GraspState) -> tuple[float, Array]:
        """Return the measure and its gradient."""
        joints = slice(0, problem.hand.n_joints)
        middle, half = _range(problem.hand)
        off, slope = (state.x[joints] - middle) / half, np.zeros(state.x.size)
        slope[joints] = POWER * off ** (POWER - 1) / half / len(off)
        return float((off**POWER).mean()), slope

    def clear_measure(self, grasp: PosedGrasp) -> float:
        """Return the measure."""
        middle, half = _range(grasp.problem.hand)
        return float(np.mean(((grasp.joint_angles - middle) / half) ** POWER))


def _range(hand: Hand) -> tuple[Array, Array]:
    """Return the middle and half the range of every joint; a joint that can't move counts nothing."""
    half = 0.5 * (hand.upper - hand.lower)
    return 0.5 * (hand.upper + hand.lower), np.where(half > 0.0, half, np.inf)
