"""Hand, springs, friction and object at rest: one step of a quasi-static simulation, by a semi-smooth Newton method."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..model.contacts import find_contacts, fingertip_positions
from ..problem.problem import GraspProblem
from ..spatial import Array, Pose, cross_rows, rotation_exp
from .newton import Asked, NewtonStep
from .rest import Conditions, RestState
from .together import Work

MAX_ITERATIONS = 15
SHARES = (1.0, 0.5, 0.25, 0.1)
"""Shares of a Newton step that are tried until the residual falls; if it never does, the best is taken."""
TOLERANCE, ACCEPTED = 1e-5, 5e-3
"""Largest residual [N] at which iterations end, and with which the best is accepted where they do not get there."""
SLOW = 0.5
"""Iterations end, too, where a residual that would be accepted falls by less than to this share of the one before."""


class RestSolver:
    """Finds states of rest of one closing hand, one after the other.

    Attributes:
        left: Evaluations that it may still make.
        used: Evaluations it has made.

    Args:
        problem: Hand, object, springs and friction.
        palm_pose: Pose of the palm in O while the object is where it was planned.
        budget: Evaluations it may make.
    """

    def __init__(self, problem: GraspProblem, palm_pose: Pose, budget: int) -> None:
        self.problem, self.home, self.left, self.used = problem, palm_pose, budget, 0

    def begin(self, q: Array) -> RestState:
        """Return a state without contact at a posture."""
        problem = self.problem
        centres = fingertip_positions(problem.hand, problem.frames, q, self.home)
        found = find_contacts(centres, problem.radii, problem.grasp_object.solid)
        none = np.zeros(centres.shape)
        return RestState(
            q, self.home.rotation, self.home.translation, none, centres, found.gaps, found.normals, np.zeros(len(none))
        )

    def unbalanced(self, state: RestState, wrench: Array) -> Array:
        """Return G f + w at a state, w given in the axes of O [N, N m], of shape (6,)."""
        moments = cross_rows(state.centres + self.problem.radii[:, None] * state.normals, state.forces)
        return np.concatenate([state.forces.sum(axis=0), moments.sum(axis=0)]) + wrench

    def solve(self, before: RestState, conditions: Conditions) -> Work[RestState | None]:
        """Return the next state of rest, or None if there is none near.

        Args:
            before: The state before.
            conditions: What it has to meet.
        """
        state = before
        step = yield from self._newton(state, before, conditions)
        best = (step.residual, state, step)
        for _ in range(MAX_ITERATIONS):
            if not np.isfinite(step.d_q[0]) or not step.residual >= TOLERANCE or self.left <= 0:
                break
            tried: list[tuple[RestState, NewtonStep]] = []
            for share in SHARES:
                trial = _moved(state, share, step)
                tried.append((trial, (yield from self._newton(trial, before, conditions))))
                if tried[-1][1].residual < (1.0 - 0.5 * share) * step.residual:
                    break
            last = step.residual
            state, step = min(tried, key=lambda each: each[1].residual)
            best = min(best, (step.residual, state, step), key=lambda each: each[0])
            if SLOW * last < step.residual < ACCEPTED:
                break
        residual, state, step = best
        if not residual < ACCEPTED:
            return None
        pressed = np.einsum("ij,ij->i", state.forces, step.normals) > 0.0
        slips = pressed * np.linalg.norm(step.slips, axis=1)
        return replace(state, centres=step.centres, gaps=step.gaps, normals=step.normals, slips=slips)

    def _newton(self, state: RestState, before: RestState, conditions: Conditions) -> Work[NewtonStep]:
        """Return the Newton step at a state."""
        self.left -= 1
        self.used += 1
        step: NewtonStep = yield Asked(state, before, conditions, self.home.rotation)
        return step


def _moved(state: RestState, share: float, step: NewtonStep) -> RestState:
    """Return a state after a share of a step; the forces do not turn with it."""
    turn = rotation_exp(share * step.twist[3:])
    return replace(
        state,
        q=state.q + share * step.d_q,
        rotation=turn @ state.rotation,
        translation=turn @ state.translation + share * step.twist[:3],
        forces=state.forces + share * step.d_forces,
    )
