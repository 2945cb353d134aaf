"""Starts for a search with forces from springs: the standard one and many random ones, made feasible together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..model.force_closure import force_closure_margin
from ..multistart.pool import Pool
from ..multistart.problem_rows import BatchedProblem
from ..multistart.states import States
from ..problem.problem import GraspProblem
from ..spatial import Pose
from .neighbours import Neighbours
from .starts import GraspStart, random_start, standard_start

PRESSING = 2.0
"""Normal force that every contact of a random start presses with [N]."""
WIDTH = 24
"""States at a time: wide enough to share the interpreter's cost, narrow enough for a first grasp soon."""
ROUND = 240
"""Most starts of a round."""
FRESH = 0.15
"""Share of random starts where there are grasps to start near."""


def pooled_starts(
    problem: GraspProblem,
    rng: np.random.Generator,
    check: Callable[[], None] = lambda: None,
    near: Neighbours | None = None,
) -> Iterator[GraspStart]:
    """Yield starts that meet every requirement, or nearly so: clearances of boxes and meshes are coarse here.

    Args:
        problem: A problem whose forces come from springs.
        rng: Source of random numbers.
        check: Called for every state evaluated; may raise to stop.
        near: Grasps near which most starts are made as soon as there are any.

    Yields:
        Starts, without end; after every round that finds nothing force-closed those that came nearest, or if none came
        near, a random one as it is.
    """
    batched = BatchedProblem(problem)
    waiting = [standard_start(problem)]

    def fresh(number: int) -> States:
        starts = [waiting.pop() if waiting else random_start(problem, rng) for _ in range(number)]
        return pressing_states(batched, starts)

    def make(number: int) -> States:
        if near is None or not len(near):
            return fresh(number)
        random = int((rng.random(number) < FRESH).sum())
        parts = [fresh(random)] if random else []
        first, *others = [*parts, near.states(number - random, rng)] if random < number else parts
        return first.joined(*others)

    while True:
        pool, closed = Pool(batched, WIDTH), 0
        for found in pool.search(make, ROUND, check):
            if force_closed(batched, found):
                closed += 1
                yield start_of(found, problem.n_synergies)
        if closed:
            continue
        for _, each in pool.nearest:
            yield start_of(each, problem.n_synergies)
        if not pool.nearest:
            yield random_start(problem, rng)


def force_closed(batched: BatchedProblem, found: States) -> bool:
    """Return whether the contacts of a batch of one are force-closed; those under a book on a hand are not."""
    contacts, problem = batched.contacts(found), batched.problem
    points = contacts.points[0]
    return force_closure_margin(points, contacts.normals[0], problem.friction, problem.contact_model) > 0.0


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
