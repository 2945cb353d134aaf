"""Which tendons drive the hand of a problem, and how the hand answers where their motors hold."""

from __future__ import annotations

import numpy as np

from ..hand.tendons import TENDONS, Tendons
from ..model.tendons import held_compliance
from ..spatial import Array
from .problem import GraspProblem


def driving_tendons(problem: GraspProblem) -> Tendons | None:
    """Return the tendons whose tensions σ stands for, the first n_s; None where the synergies are no tendons."""
    tendons = problem.hand.tendons
    named = problem.synergy_space is None and problem.synergy_set_name == TENDONS
    if tendons is None or not named or TENDONS in problem.hand.description.synergies.sets:
        return None
    return tendons.first(problem.n_synergies)


def passive_compliance(problem: GraspProblem) -> Array:
    """Return the compliance with which the joints answer a disturbance [rad/(N m)], of shape (n_q,) or (n_q, n_q).

    That is C_q, the references held; where tendons hold their lengths, it is stiffer.
    """
    tendons = driving_tendons(problem)
    if tendons is None or not tendons.held:
        return problem.joint_compliance
    return held_compliance(problem.joint_compliance, tendons.arms)


def tension_map(problem: GraspProblem, tendons: Tendons) -> Array:
    """Return the map from C_q Rᵀ t, the bending of the free hand [rad], to t [N], of shape (n_t, n_q)."""
    scales = tendons.scales(problem.joint_compliance)
    return np.asarray(np.linalg.pinv(problem.synergies.basis) / scales[:, None])
