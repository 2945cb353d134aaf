"""Changes of the problem from the page; all for the worker's thread."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..exceptions import GraspPlannerError
from ..grasp.grasp import Grasp
from ..hand.loading import LoadedHand
from ..objects import GraspObject, parse_object
from ..planning.starts import standard_start
from ..problem.problem import GraspProblem
from ..spatial import Array
from .panels.problem import ProblemPanel
from .panels.synergies import SynergyPanel
from .panels.widgets import FieldError, set_value
from .session import Session

OF_THE_HAND = ("n_synergies", "synergy_set", "contact_set", "contacts", "synergy_space")
"""Fields of a problem that a new hand gives anew."""


class ProblemEdits:
    """Takes the problem from its widgets into the session."""

    def __init__(
        self, session: Session, panel: ProblemPanel, synergies: SynergyPanel, stop_animation: Callable[[], None]
    ) -> None:
        self._session, self._panel, self._synergies = session, panel, synergies
        self._stop_animation = stop_animation

    def take_problem(self) -> bool:
        """Change the problem as the widgets say.

        Returns:
            Whether hand or object are others now; the hand stands in front of it then, not planned yet.
        """
        before = self._session.problem
        try:
            problem = self._panel.problem(before)
        except FieldError:
            return False  # the field says what is wrong with it, and keeps what was typed
        notes = self._panel.notes
        if problem.hand is not before.hand or problem.grasp_object.kind != before.grasp_object.kind:
            self._begin(problem, notes)
            return True
        self._stop_animation()
        same_contacts = (problem.contact_set, problem.contacts) == (before.contact_set, before.contacts)
        self._session.set_problem(problem, by_widgets=same_contacts and not notes)
        if notes:
            self._session.note = "; ".join(notes)
        return False

    def take_object(self, grasp_object: GraspObject, notes: Sequence[str]) -> None:
        """Change the object to one from a file, with what is to be said of it."""
        self._begin(replace(self._session.problem, grasp_object=grasp_object), notes)

    def take_hand(self, loaded: LoadedHand) -> None:
        """Change the hand to one from a file; it brings its own synergies, contacts and an object in size."""
        before = self._session.problem
        changes: dict[str, Any] = dict.fromkeys(OF_THE_HAND) | {
            "hand": loaded.hand,
            "grasp_object": parse_object(loaded.first_object) if loaded.first_object else before.grasp_object,
            "parameters": before.parameters.without_hand(before.hand),
        }
        self._begin(replace(before, **changes), loaded.hand.findings)

    def _begin(self, problem: GraspProblem, notes: Sequence[str]) -> None:
        """Show the hand in front of the object, not planned yet."""
        self._stop_animation()
        start = standard_start(problem)
        grasp = Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma)
        self._session.show(grasp, "; ".join(["not planned yet", *notes]))

    def take_count(self) -> None:
        """Change the number of synergies; the widget goes back where that can't be."""
        count = self._synergies.count
        try:
            self._session.set_problem(replace(self._session.problem, n_synergies=int(count.value)))
        except GraspPlannerError:
            set_value(count, self._session.problem.n_synergies)
            raise

    def turn_task(self, point: Array) -> None:
        """Turn the first task towards a point in the world [m]."""
        direction = np.array(self._session.live.object_pose.inverse().act(point))
        length = float(np.linalg.norm(direction))
        if length > 1e-6:
            rounded = tuple(float(round(value, 3)) for value in direction / length)
            set_value(self._panel.direction, rounded)
            self.take_problem()
