"""A hand on its way: from one state of rest to the next while its references, or what loads the object, go on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..judge.posed_grasp import PosedGrasp
from ..spatial import Array
from .equilibrium import RestSolver
from .path import ReferencePath, free_posture
from .rest import Anchors, Conditions, RestState
from .together import Work
from .touches import Touches

CLOSING_STEPS = 8
"""Steps of the references from the first touch to the squeeze."""
FREE_STEPS, FREE_DRAG = 10, 300.0
"""Steps where nothing holds the object, and the force against its motion in a step [N/m]: the fingers, ten times as
stiff, push it on before them."""
MAX_DEPTH = 2
"""How often a step is halved before it counts as impossible."""
DRAGS = (2e3, 1e3, 5e2, 2e2, 1e2, 50.0)
"""Drags of the object with which it creeps to a state of rest, one after the other [N/m] …"""
CREPT = 0.005
"""… until this force stops it [N]."""
MAX_DISPLACEMENT, MAX_ROTATION = 0.05, np.radians(15.0)
"""How far the object may move [m] and turn [rad], as in simulation."""

Step = Callable[[RestState, float, float, bool], Work[RestState | None]]
"""From a state at a time to the state at a later one, the last resort included or not."""


class Walk:
    """States of rest of a closing hand, one after the other.

    Attributes:
        solver: Finds them.
        slip: How far each contact has slid over the object so far [m], of shape (n_c,).

    Args:
        grasp: The grasp that is closed.
        path: Its references.
        touches: Where and when its fingers touch.
        budget: Evaluations after which whatever is missing counts as lost.
    """

    def __init__(self, grasp: PosedGrasp, path: ReferencePath, touches: Touches, budget: int) -> None:
        self.grasp, self.path, self.touches = grasp, path, touches
        self.solver = RestSolver(grasp.problem, grasp.palm_pose, budget)
        self.synergies = grasp.problem.synergies
        self.slip = np.zeros(len(grasp.problem.frames))

    def closed(self, *, free: bool = False) -> Work[RestState | None]:
        """Close the hand around the object, which is held or free to give way; None if there is no way."""
        touches, path = self.touches, self.path
        touched = touches.times[np.isfinite(touches.times)]
        if not touched.size:
            return None
        state = self.solver.begin(free_posture(self.grasp, path.open))
        began = float(touched.min())
        times = np.linspace(began, 2.0, (FREE_STEPS if free else CLOSING_STEPS) + 1)[1:]
        if not free:  # a free object is not where it is touched next
            times = np.union1d(touched[touched > began], times)
        for time in times:
            found = yield from self._advance(state, began, float(time), self._giving_way if free else self._held)
            if found is None:
                return None
            state, began = found, float(time)
        return state

    def released(self, state: RestState) -> Work[RestState | None]:
        """Let the object go little by little; None if it is lost."""
        wrench = self.grasp.problem.external_wrench
        held = self.solver.unbalanced(state, wrench)
        return (
            yield from self._advance(
                state, 0.0, 1.0, lambda state, _, time, last: self._free(state, wrench - (1.0 - time) * held, last)
            )
        )

    def pushed(self, state: RestState, push: Array) -> Work[RestState | None]:
        """Push the object at rest with a wrench [N, N m], of shape (6,), little by little; None if it is lost."""
        wrench = self.grasp.problem.external_wrench
        return (
            yield from self._advance(
                state, 0.0, 1.0, lambda state, _, time, last: self._free(state, wrench + time * push, last)
            )
        )

    def motion(self, state: RestState) -> tuple[float, float]:
        """Return how far the object has moved [m] and turned [rad] in a state."""
        home = self.grasp.palm_pose
        turn = home.rotation @ state.rotation.T
        cosine = np.clip(0.5 * (np.trace(turn) - 1.0), -1.0, 1.0)
        return float(np.linalg.norm(home.translation - turn @ state.translation)), float(np.arccos(cosine))

    def _held(self, state: RestState, began: float, time: float, _: bool) -> Work[RestState | None]:
        """Move the references on, the object held."""
        anchors = replace(self._anchors(state, began, time), allowed=self.touches.times <= time)
        return (yield from self.solver.solve(state, Conditions(self._reference(time), anchors)))

    def _giving_way(self, state: RestState, began: float, time: float, _: bool) -> Work[RestState | None]:
        """Move the references on, the object, without weight, giving way to the fingers; None if it is lost."""
        anchors = self._anchors(state, began, time)
        return (yield from self._rested(state, Conditions(self._reference(time), anchors, np.zeros(6), FREE_DRAG)))

    def _reference(self, time: float) -> Array:
        """Return the posture of the references at a time [rad], of shape (n_q,)."""
        return self.synergies.joint_angles(self.path.at(time))

    def _anchors(self, state: RestState, began: float = np.inf, time: float = -np.inf) -> Anchors:
        """Return where the contacts of a state are; of those that touch in a span of time, where they touch."""
        touches, n_c = self.touches, len(state.gaps)
        fresh = ((touches.times >= began) & (touches.times <= time))[:, None]
        centres, postures = np.where(fresh, touches.centres, state.centres), np.where(fresh, touches.postures, state.q)
        return Anchors(centres, postures, np.full(n_c, True))

    def _advance(
        self, state: RestState, began: float, time: float, step: Step, depth: int = 0
    ) -> Work[RestState | None]:
        """Go from one time to another, in halves where it can't be done at once; None if it can't be done."""
        found = yield from step(state, began, time, depth == MAX_DEPTH)
        if found is not None:
            self.slip = self.slip + found.slips
        if found is not None or depth == MAX_DEPTH:
            return found
        middle = 0.5 * (began + time)
        halfway = yield from self._advance(state, began, middle, step, depth + 1)
        if halfway is None:
            return None
        return (yield from self._advance(halfway, middle, time, step, depth + 1))

    def _free(self, state: RestState, wrench: Array, creeping: bool) -> Work[RestState | None]:
        """Return the next state of rest of the free object, None if it is lost."""
        reference = self._reference(2.0)
        found = yield from self._rested(state, Conditions(reference, self._anchors(state), wrench))
        if found is not None or not creeping:
            return found
        # Where fingers slide far there is no way there by equilibria alone: the object creeps until it rests.
        for drag in DRAGS:
            crept = yield from self._rested(state, Conditions(reference, self._anchors(state), wrench, drag))
            if crept is None:
                continue
            self.slip = self.slip + crept.slips
            moved = np.linalg.norm(crept.translation - state.translation)
            state = crept
            if drag * moved < CREPT:
                return state
            found = yield from self._rested(state, Conditions(reference, self._anchors(state), wrench))
            if found is not None:
                return found
        return None

    def _rested(self, state: RestState, conditions: Conditions) -> Work[RestState | None]:
        """Return the next state of rest of the free object, None if there is none within the limits."""
        found = yield from self.solver.solve(state, conditions)
        if found is None:
            return None
        moved, turned = self.motion(found)
        return found if moved <= MAX_DISPLACEMENT and turned <= MAX_ROTATION else None
