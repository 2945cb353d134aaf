"""Animations: the hand closing into the grasp, or along one synergy until it touches."""

from __future__ import annotations

import numpy as np

from ..exceptions import InvalidValueError
from ..grasp.grasp import Grasp
from ..spatial import Array
from .closing_story import HELD, ClosingStory
from .opening import approach, close_along
from .session import Preview, Session
from .worker import Worker

STORY_FRAMES = 75
"""Moments of a closing that is played."""


class Animator:
    """Shows postures one after the other; all methods are for the worker's thread."""

    def __init__(self, session: Session, worker: Worker) -> None:
        self._session, self._worker = session, worker
        self._story: ClosingStory | None = None

    def stop(self) -> None:
        """Leave an animation, with the grasp as it was."""
        self._worker.animate(None)
        self._session.preview = None
        self._session.dirty = True

    def play(self) -> None:
        """Open the hand and close it into the grasp again, as the plan's closing does where it closes."""
        self.stop()
        grasp = self._session.grasp
        if not (grasp.feasible and grasp.closing.rests):
            self._show(approach(grasp), "Closing along the synergies", None)
            return
        rest = iter(np.linspace(0.0, HELD, STORY_FRAMES))

        def step() -> bool:
            time = next(rest, None)
            self.tell(HELD if time is None else float(time))
            return time is not None

        self._worker.animate(step)

    def tell(self, time: float) -> None:
        """Show the closing hand at a time, from 0 (open) to 2 (held).

        Raises:
            InvalidValueError: If the grasp does not meet its model.
        """
        session = self._session
        session.dirty = True
        if time >= HELD:
            session.preview = None
            return
        grasp = session.grasp
        if self._story is None or self._story.grasp is not grasp:
            if not grasp.feasible:
                raise InvalidValueError("grasp", "one that breaks its model", "a grasp that meets it; plan one first")
            self._story = ClosingStory(grasp)
        moment = self._story.at(time)
        posture = Grasp(grasp.problem, moment.joint_angles, grasp.palm_pose, np.zeros(grasp.problem.n_synergies))
        session.preview = Preview(posture, moment.text, moment)

    def close(self, synergy: int) -> None:
        """Close along one synergy, by its index, until every fingertip touches."""
        self.stop()
        synergy = min(synergy, self._session.problem.n_synergies - 1)
        path = close_along(self._session.grasp, synergy)
        reached = "all fingertips touch" if not path.missed else f"not reached: {', '.join(path.missed)}"
        note = f"closed along synergy {synergy + 1}; {reached}"
        self._show(path.postures, f"Closing along synergy {synergy + 1}", note)

    def _show(self, postures: Array, message: str, note: str | None) -> None:
        """Show postures, then the grasp as it was, or the last posture if there is a note on it."""
        session, problem = self._session, self._session.problem
        palm, rest = session.live.palm_pose, iter(postures)
        nothing = np.zeros(problem.n_synergies)

        def step() -> bool:
            q = next(rest, None)
            if q is None:
                session.preview, session.dirty = None, True
                if note is not None:
                    session.set_posture(postures[-1], note)
                return False
            session.preview, session.dirty = Preview(Grasp(problem, q, palm, nothing), message), True
            return True

        self._worker.animate(step)
