"""What all browsers see: the grasp shown, the results, what is pinned and selected. Changed by one thread only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..grasp.grasp import Grasp
from ..grasp.squeeze import squeezed_forces
from ..planning.ranking import alike
from ..problem.problem import GraspProblem
from ..spatial import Array, Pose
from .closing_story import StoryMoment
from .history import History
from .live import LiveState, Shown, evaluate


@dataclass(frozen=True)
class Preview:
    """A posture on its way, while the hand closes or the planner searches.

    Attributes:
        grasp: The posture, without forces.
        message: What is going on.
        story: The moment of a closing hand, whose springs are drawn.
    """

    grasp: Grasp
    message: str
    story: StoryMoment | None = None


class Session:
    """The state behind the page.

    Attributes:
        live: What sliders and gizmos say.
        grasp: The grasp shown.
        automatic_squeeze: Whether δσ is chosen for the least force while the hand is moved.
        squeeze: Factor on δσ while that is not so.
        results: Grasps of the last search of which no two are alike, best first.
        shown: Index of the result shown; None if the grasp is none of them.
        pinned: Grasp to compare with.
        seed: Where the last search started.
        selected: What was clicked: ("contact", index) or ("link", name).
        push: A force on the object that is tried [N], in O; None for none.
        preview: What is drawn instead of the grasp for the moment.
        note: Where the grasp shown comes from.
        dirty: Whether the page is behind.
        version: Counts the changes that did not come from the sliders and gizmos; these have to follow then.
        moves: Counts what the user has moved or changed.
        problem_version: As version, for the widgets of the problem.
    """

    def __init__(self, grasp: Grasp, note: str = "") -> None:
        self.version = self.problem_version = self.moves = 0
        self.dirty = self._moved = False
        self.preview: Preview | None = None
        self.automatic_squeeze = True
        self.push: Array | None = None
        self.results: list[Grasp] = []
        self.shown: int | None = None
        self.pinned: Grasp | None = None
        self.seed: Grasp | None = None
        self.selected: tuple[str, int | str] | None = None
        self._history: History[Shown] = History()
        self._present: Shown | None = None
        self.show(grasp, note)

    @property
    def problem(self) -> GraspProblem:
        """The problem of the grasp shown."""
        return self.live.problem

    def show(self, grasp: Grasp, note: str = "", *, object_pose: Pose | None = None) -> None:
        """Show a grasp exactly as it is.

        Args:
            grasp: The grasp.
            note: Where it comes from.
            object_pose: Pose of the object in the world; identity if left out.
        """
        self.live = LiveState.of(grasp, object_pose)
        self.base_squeeze = _squeeze_of(self.live)
        self.squeeze = 1.0
        self.grasp = grasp
        self.note = note
        self.shown = None
        self.version += 1
        self.problem_version += 1
        self._changed(moved=False, kind="show")

    def undo(self) -> None:
        """Show what was there before the last change."""
        self._restore(self._history.back(self._snapshot()))

    def redo(self) -> None:
        """Show what was there before the last undo."""
        self._restore(self._history.forth(self._snapshot()))

    def set_sigma(self, sigma: Array) -> None:
        """Move the hand along its synergies, σ [rad] of shape (n_s,)."""
        if sigma.shape == self.live.sigma.shape and not np.array_equal(sigma, self.live.sigma):
            self.live = replace(self.live, sigma=sigma)
            self._changed(kind="sigma")

    def reset_posture(self) -> None:
        """Put the hand at its mean posture, σ = 0."""
        zero = np.zeros(self.problem.hand.n_joints)
        self.live = replace(self.live, sigma=np.zeros(self.problem.n_synergies), offset=zero, bend=zero)
        self.version += 1
        self._changed(kind="reset")

    def set_squeeze(self, factor: float, automatic: bool) -> None:
        """Squeeze with a multiple of the grasp's δσ, or automatically."""
        if (factor, automatic) == (self.squeeze, self.automatic_squeeze):
            return
        self.squeeze, self.automatic_squeeze = factor, automatic
        base = self.base_squeeze
        springs = self.problem.parameters.force_law == "springs"
        self.live = self.live.squeezed(squeezed_forces(self.grasp, base, factor) if springs else factor * base)
        self._changed(kind="squeeze")

    def set_hand_pose(self, pose: Pose) -> None:
        """Put the palm at a pose in the world."""
        self.live = replace(self.live, hand_pose=pose)
        self._changed(kind="hand")

    def set_object_pose(self, pose: Pose) -> None:
        """Put the object at a pose in the world."""
        self.live = self.live.with_object_pose(pose)
        self._changed(kind="object")

    def set_problem(self, problem: GraspProblem, *, by_widgets: bool = False) -> None:
        """Change the problem and keep the posture as well as it can be kept.

        Args:
            problem: The new problem.
            by_widgets: Whether the widgets of the problem say so already. Writing to them again could undo what
                the user has changed meanwhile.
        """
        before = self.problem
        self.live = self.live.with_problem(problem)
        if self.base_squeeze.shape != _squeeze_of(self.live).shape:
            self.base_squeeze = _squeeze_of(self.live)
        self.version += 1
        self.problem_version += not by_widgets
        if _same_bodies(before, problem) and not self._moved:
            # Nothing that moves the hand has changed: the same grasp, judged by another problem.
            self.grasp = replace(self.grasp, problem=self.live.problem, search=None)
            self.moves += 1
            self.shown, self.note = None, "the same grasp, for another problem"
            self._changed(moved=False, kind="problem")
            return
        self._changed(kind="problem")

    def set_posture(self, q: Array, note: str) -> None:
        """Show a posture [rad] with the palm and the object where they are."""
        grasp = Grasp(self.problem, q, self.live.palm_pose, self.live.delta_sigma, self.live.contact_forces)
        object_pose, base, squeeze = self.live.object_pose, self.base_squeeze, self.squeeze
        self.show(grasp, note, object_pose=object_pose)
        self.base_squeeze, self.squeeze = base, squeeze
        self._changed(note=note, kind="show")

    def update(self) -> None:
        """Evaluate the grasp if something has moved."""
        if self._moved:
            self.live, self.grasp = evaluate(self.live, automatic_squeeze=self.automatic_squeeze)
            self._moved = False
            self._present = self._snapshot()

    def add_result(self, grasp: Grasp) -> bool:
        """Rank a result, unless a better one is like it; return whether it is the best so far."""
        if any(alike(each, grasp) and _rank(each) <= _rank(grasp) for each in self.results):
            return False
        shown = None if self.shown is None else self.results[self.shown]
        others = [each for each in self.results if not alike(each, grasp)]
        self.results = sorted([*others, grasp], key=_rank)
        self._follow(shown)
        return self.results[0] is grasp

    def forget_results(self) -> None:
        """Begin without results; the grasp that is shown stays, and is none of them."""
        self.results, self.shown = [], None

    def take_best(self, best: Sequence[Grasp]) -> None:
        """Rank the grasps that a search ended with as it does, and behind them the others that were on the way."""
        shown = None if self.shown is None else self.results[self.shown]
        others = [each for each in self.results if not any(alike(each, grasp) for grasp in best)]
        self.results = [*best, *others]
        self._follow(shown)
        self.dirty = True

    def entries(self) -> list[tuple[str, Grasp | None]]:
        """Return the ranks and the grasps of the results."""
        return [(str(rank), grasp) for rank, grasp in enumerate(self.results, start=1)]

    def select(self, what: tuple[str, int | str]) -> None:
        """Select a contact or a link: ("contact", index) or ("link", name)."""
        self.selected = what
        self.dirty = True

    def mark_dirty(self) -> None:
        """Have everything drawn again."""
        self.dirty = True

    def pin(self) -> None:
        """Keep the grasp shown to compare with."""
        self.pinned = self.grasp
        self.dirty = True

    def unpin(self) -> None:
        """Forget the pinned grasp."""
        self.pinned = None
        self.dirty = True

    def _follow(self, shown: Grasp | None) -> None:
        """Find the result shown again in a new order."""
        if shown is not None:
            places = [index for index, each in enumerate(self.results) if alike(each, shown)]
            self.shown = places[0] if places else None

    def show_result(self, index: int, object_pose: Pose | None = None) -> None:
        """Show a result by its rank, from 0."""
        if not self.results:
            return
        index = int(np.clip(index, 0, len(self.results) - 1))
        note = f"result {index + 1} of {len(self.results)}, best first"
        self.show(self.results[index], note, object_pose=object_pose)
        self.shown = index

    def _changed(self, *, kind: str, moved: bool = True, note: str = "moved by hand") -> None:
        """Note that the page is behind, whether the grasp has to be evaluated anew, and what undo goes back to."""
        self._moved = moved
        self.dirty = True
        self.preview = None
        if moved:
            self.moves += 1
            self.shown = None
            self.note = note
        if self._present is not None:
            self._history.note(self._present, kind)
        self._present = self._snapshot()

    def _snapshot(self) -> Shown:
        """Return what undo brings back."""
        return Shown(
            self.live, self.grasp, self.base_squeeze, self.squeeze, self.automatic_squeeze, self.note, self._moved
        )

    def _restore(self, state: Shown | None) -> None:
        """Show what was there; nothing happens if that is None."""
        if state is None:
            return
        self.live, self.grasp, self.base_squeeze = state.live, state.grasp, state.base_squeeze
        self.squeeze, self.automatic_squeeze = state.squeeze, state.automatic_squeeze
        self.note, self._moved = state.note, state.moved
        places = [index for index, each in enumerate(self.results) if each is state.grasp]
        self.shown = places[0] if places else None
        self.version += 1
        self.problem_version += 1
        self.moves += 1
        self.preview, self.dirty, self._present = None, True, state


def _rank(grasp: Grasp) -> tuple[bool, float]:
    """Return what results are sorted by: feasible ones by their objective, then the others by their violation."""
    if grasp.feasible:
        return False, grasp.objective
    return True, grasp.max_violation


def _same_bodies(one: GraspProblem, other: GraspProblem) -> bool:
    """Return whether two problems have the same hand, object, contacts, synergies and springs."""
    return (
        one.hand is other.hand
        and one.grasp_object == other.grasp_object
        and one.frames == other.frames
        and one.synergies == other.synergies
        and one.parameters.force_law == other.parameters.force_law
        and np.array_equal(one.joint_compliance, other.joint_compliance)
        and np.array_equal(one.external_wrench, other.external_wrench)
        and one.contact_model == other.contact_model
    )


def _squeeze_of(live: LiveState) -> Array:
    """Return δσ, or the contact forces where they come from springs."""
    return live.delta_sigma if live.contact_forces is None else live.contact_forces
