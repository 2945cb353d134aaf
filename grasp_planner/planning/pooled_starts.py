"""Starts for a search with forces from springs: the standard one and many random ones, made feasible together.

Where the search takes states as they are found, most starts after the first are neighbours of what was found, each
asked to take less force than that: they are soon feasible, and force comes down from one to the next.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..model.force_closure import force_closure_margin
from ..multistart.contacts import BatchedContacts
from ..multistart.pool import Pool
from ..multistart.problem_rows import BatchedProblem
from ..multistart.states import States
from ..problem.problem import GraspProblem
from ..spatial import Array, Pose
from .ranking import near_alike
from .starts import GraspStart, random_start, standard_start

PRESSING = 2.0
"""Normal force that every contact of a random start presses with [N]."""
WIDTH = 24
"""States at a time: wide enough to share the interpreter's cost, narrow enough for a first grasp soon."""
ROUND = 240
"""Most starts of a round."""
FRESH, PARENTS = 0.15, 256
"""Share of random starts among neighbours, and how many found states with the least F are remembered to start from."""
JOINT_STEP, PALM_STEP, TURN_STEP = 0.045, 0.0045, 0.075
"""Standard deviations of a neighbour's joint angles along the synergies [rad], of its palm's place [m] and turn [rad]."""
LESS_FORCE = 0.6, 1.2
"""Range of F that a neighbour may take, as a share of what it comes from takes."""


def pooled_starts(
    problem: GraspProblem,
    rng: np.random.Generator,
    check: Callable[[], None] = lambda: None,
    *,
    neighbours: bool = False,
) -> Iterator[GraspStart]:
    """Yield starts that meet every requirement, or nearly so: clearances of boxes and meshes are coarse here.

    Args:
        problem: A problem whose forces come from springs.
        rng: Source of random numbers.
        check: Called for every state evaluated; may raise to stop.
        neighbours: Whether starts are also made near states that were found.

    Yields:
        Starts, without end; after every round that finds nothing force-closed those that came nearest, or if none came
        near, a random one as it is.
    """
    batched = BatchedProblem(problem)
    waiting, parents = [standard_start(problem)], Parents(batched)

    def make(number: int) -> States:
        near = int((rng.random(number) >= FRESH).sum()) if len(parents) else 0
        if near == number:
            return parents.neighbours(near, rng)
        starts = [waiting.pop() if waiting else random_start(problem, rng) for _ in range(number - near)]
        fresh = pressing_states(batched, starts)
        return fresh.joined(parents.neighbours(near, rng)) if near else fresh

    while True:
        pool, closed = Pool(batched, WIDTH), 0
        for found in pool.search(make, ROUND, check):
            contacts = batched.contacts(found)
            if force_closed(problem, contacts):
                closed += 1
                if neighbours:
                    parents.add(contacts)
                yield start_of(found, problem.n_synergies)
        if closed:
            continue
        for _, near in pool.nearest:
            yield start_of(near, problem.n_synergies)
        if not pool.nearest:
            yield random_start(problem, rng)


class Parents:
    """Feasible states that others are started from, no two of them alike, of those alike the one with the least F."""

    def __init__(self, batched: BatchedProblem) -> None:
        self._batched = batched
        self._along = batched.problem.synergies.basis @ np.linalg.pinv(batched.problem.synergies.basis)
        self._found: list[_Parent] = []

    def __len__(self) -> int:
        return len(self._found)

    def add(self, found: BatchedContacts) -> None:
        """Remember a batch of one; if there are too many, forget the one that takes the most force."""
        states = found.states
        points = states.translation[0] + found.points[0] @ states.rotation[0].T
        fresh = _Parent(states, float(found.force_norm[0]), points)
        near = [each for each in self._found if fresh.is_like(each)]
        if any(each.force <= fresh.force for each in near):
            return
        kept = [each for each in self._found if each not in near]
        self._found = sorted([*kept, fresh], key=lambda each: each.force)[:PARENTS]

    def neighbours(self, number: int, rng: np.random.Generator) -> States:
        """Return states near remembered ones, each with less force to take than the one it is near.

        Args:
            number: How many.
            rng: Source of random numbers.
        """
        hand = self._batched.problem.hand
        chosen = [self._found[row] for row in rng.integers(len(self._found), size=number)]
        step = np.zeros((number, self._batched.n_variables))
        step[:, : hand.n_joints] = rng.normal(0.0, JOINT_STEP, (number, hand.n_joints)) @ self._along
        step[:, hand.n_joints : hand.n_joints + 6] = rng.normal(size=(number, 6)) * np.repeat((PALM_STEP, TURN_STEP), 3)
        first, *others = (each.states for each in chosen)
        states = first.joined(*others).stepped(step, hand.lower, hand.upper)
        return replace(states, most_force=np.array([each.force for each in chosen]) * rng.uniform(*LESS_FORCE, number))


@dataclass(frozen=True, eq=False)
class _Parent:
    """A batch of one, its F [N] and its contact points in O [m], of shape (n_c, 3)."""

    states: States
    force: float
    points: Array

    def is_like(self, other: _Parent) -> bool:
        """Return whether a user would see one grasp in both."""
        return near_alike(self.states.joints[0] - other.states.joints[0], self.points - other.points)


def force_closed(problem: GraspProblem, found: BatchedContacts) -> bool:
    """Return whether the contacts of a batch of one are force-closed; those under a book on a hand are not."""
    margin = force_closure_margin(found.points[0], found.normals[0], problem.friction, problem.contact_model)
    return margin > 0.0


def random_states(batched: BatchedProblem, number: int, rng: np.random.Generator) -> States:
    """Return random starts with contacts that press along their normals."""
    return pressing_states(batched, [random_start(batched.problem, rng) for _ in range(number)])


def pressing_states(batched: BatchedProblem, starts: Sequence[GraspStart]) -> States:
    """Return starts with contacts that press along their normals."""
    states = States(
        np.array([start.joint_angles for start in starts]),
        np.array([start.palm_pose.rotation for start in starts]),
        np.array([start.palm_pose.translation for start in starts]),
        np.zeros((len(starts), len(batched.problem.frames), 3)),
        np.full(len(starts), np.inf),
    )
    return replace(states, forces=PRESSING * batched.contacts(states).normals)


def start_of(found: States, n_synergies: int) -> GraspStart:
    """Return the start of a batch of one."""
    rotation = found.rotation[0]
    pose = Pose(rotation, found.translation[0])
    return GraspStart(found.joints[0], pose, np.zeros(n_synergies), found.forces[0] @ rotation.T, prepared=True)
