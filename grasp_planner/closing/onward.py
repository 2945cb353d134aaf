"""How a closed hand squeezes on: the motion of its references that raises the planned forces, and how far it may go."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..judge.load_check import command_matrix
from ..judge.posed_grasp import PosedGrasp
from ..model.friction import friction_margins
from ..spatial import Array

WEAK = 0.01
"""Ways of the motors that change the contact forces by less than this, relative to the most, are not taken."""
FARTHEST, SHARE = 3.0, 0.05
"""Most times the planned forces are added, and the steps in which it is looked how often they may be."""


@dataclass(frozen=True)
class Onward:
    """The way on from a plan.

    Attributes:
        way: Δσ whose forces, the object free, come nearest to the plan's [rad], of shape (n_s,).
        reach: How many times Δσ may be added for every planned contact still to be within its friction cone.
    """

    way: Array
    reach: float


def way_on(grasp: PosedGrasp) -> Onward:
    """Return how a grasp is squeezed on.

    Moving the references by Δσ changes the contact forces by P Δσ, which load nothing but the fingers: G P = 0. With
    few synergies P Δσ is not the planned forces once more, and leaves the cones the sooner.
    """
    if not (grasp.problem.contact_springs > 0.0).all():
        return Onward(np.zeros(grasp.problem.n_synergies), 0.0)  # contacts without stiffness: no force to raise
    by_motors = command_matrix(grasp.problem, grasp.grasp_matrix, grasp.hand_jacobian)
    way = np.linalg.lstsq(by_motors, grasp.intensities.ravel(), rcond=WEAK)[0]
    more, reach = (by_motors @ way).reshape(grasp.intensities.shape), 0.0
    for share in np.arange(SHARE, FARTHEST + SHARE / 2, SHARE):
        forces = grasp.intensities + share * more
        if (friction_margins(forces, grasp.covectors, grasp.problem.friction) < 0.0).any():
            break
        reach = float(share)
    return Onward(way, reach)
