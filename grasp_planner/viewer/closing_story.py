"""The story of a closing hand: from open, contacts touching one after the other, springs taking up the squeeze.

The references move as the plan's closing does (:mod:`grasp_planner.closing`). A finger follows them freely until it
touches; then it goes evenly to where the plan has it while its reference, drawn as a ghost, moves on into the object.
The gap between both is a spring: it stretches evenly too, so its force grows evenly to that of the plan.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..closing.path import free_posture
from ..closing.touches import find_touches
from ..grasp.grasp import Grasp
from ..hand.kinematics import HandKinematics
from ..spatial import Array
from .opening import Mask, moved_joints

HELD = 2.0
"""The time at which the hand holds; it is open at 0 and the references touch at 1."""


@dataclass(frozen=True)
class StoryMoment:
    """A hand on its way; frame O.

    Attributes:
        joint_angles: q [rad], of shape (n_q,).
        reference: Where the motors alone would put the hand [rad], of shape (n_q,).
        touching: Which contacts touch, of shape (n_c,).
        springs: From fingertips to those of the reference, for the contacts that touch [m], of shape (k, 2, 3).
        forces: What these springs press with [N], of shape (k,).
        text: What happens, in words.
    """

    joint_angles: Array
    reference: Array
    touching: Mask
    springs: Array
    forces: Array
    text: str


class ClosingStory:
    """How one grasp closes."""

    def __init__(self, grasp: Grasp) -> None:
        problem = grasp.problem
        self.grasp, self._path = grasp, grasp.closing.path
        self._touches = find_touches(grasp, self._path)
        self._kinematics = HandKinematics(problem.hand, problem.frames)
        self._moves = moved_joints(grasp)

    def at(self, time: float) -> StoryMoment:
        """Return the hand at a time, from 0 (open) to 2 (held)."""
        times, grasp = self._touches.times, self.grasp
        reference = free_posture(grasp, self._path.at(time))
        q, touching = reference.copy(), times <= time
        shares = np.where(touching, (time - times) / np.maximum(HELD - times, 1e-9), 0.0)
        for i in np.flatnonzero(touching):
            start, own = self._touches.postures[i], self._moves[i]
            q[own] = (start + shares[i] * (grasp.joint_angles - start))[own]
        springs = np.stack([self._fingertips(q), self._fingertips(reference)], axis=1)
        forces = shares * np.linalg.norm(grasp.forces, axis=1)
        return StoryMoment(q, reference, touching, springs[touching], forces[touching], self._text(time, touching))

    def _fingertips(self, q: Array) -> Array:
        """Return the fingertips in O [m], of shape (n_c, 3)."""
        palm = self.grasp.palm_pose
        return self._kinematics.compute(q, angular=False).position @ palm.rotation.T + palm.translation

    def _text(self, time: float, touching: Mask) -> str:
        """Return what happens at a time."""
        names = [frame.name for frame in self.grasp.problem.frames]
        order = [names[i] for i in np.argsort(self._touches.times, kind="stable") if touching[i]]
        if not order:
            return "open: the motors move all fingers together"
        left = len(names) - len(order)
        touched = f"{', then '.join(order)} touch{'es' if len(order) == 1 else ''}"
        return f"{touched}; {left} still free" if left else f"{touched}; the springs take up the squeeze"
