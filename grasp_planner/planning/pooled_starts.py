"""Starts for a search with forces from springs: the standard one and many random ones, made feasible together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..model.force_closure import force_closure_margin, shows_force_closure
from ..multistart.pool import Pool
from ..multistart.problem_rows import BatchedProblem
from ..multistart.states import States
from ..problem.problem import GraspProblem
from ..spatial import Pose
from .neighbours import NearGrasps, NearStates, StartsNear
from .starts import GraspStart, random_start, standard_start

PRESSING = 2.0
"""Normal force that every contact of a random start presses with [N]."""
WIDTH = 24
"""States at a time: wide enough to share the interpreter's cost, narrow enough for a first grasp soon."""
ROUND = 240
"""Most starts of a round."""
NEAR_FOUND, NEAR_MISSED = 0.85, 0.75
"""Share of starts that are made near grasps that were found, or else near what came nearest, where there are any."""
SCARCE = 4
"""Force-closed states in a round below which starts are made near what came nearest in it too."""
NEARLY, HANDED = 0.1, 3
"""Cost below which a state that was dropped may yet become feasible by a better solver, and how many are handed on."""


def pooled_starts(
    problem: GraspProblem,
    rng: np.random.Generator,
    check: Callable[[], None] = lambda: None,
    grasps: NearGrasps | None = None,
) -> Iterator[GraspStart]:
    """Yield starts that meet every requirement, or nearly so: clearances of boxes and meshes are coarse here.

    Args:
        problem: A problem whose forces come from springs.
        rng: Source of random numbers.
        check: Called for every state evaluated; may raise to stop.
        grasps: Grasps near which most starts are made as soon as there are any.

    Yields:
        Starts, without end; after every round that finds nothing force-closed what is that came nearest, or if nothing
        came near, a random one as it is. Where little is found, most starts of the next rounds are near what came
        nearest.
    """
    batched = BatchedProblem(problem)
    waiting, missed = [standard_start(problem)], NearStates(problem)

    def make(number: int) -> States:
        near: StartsNear = grasps if grasps else missed
        share = NEAR_FOUND if near is grasps else NEAR_MISSED
        again = int(rng.binomial(number, share)) if near else 0
        starts = [waiting.pop() if waiting else random_start(problem, rng) for _ in range(number - again)]
        fresh = [pressing_states(batched, starts)] if starts else []
        first, *others = [*fresh, near.states(again, rng)] if again else fresh
        return first.joined(*others)

    while True:
        pool, closed = Pool(batched, WIDTH), 0
        for found in pool.search(make, ROUND, check):
            if force_closed(batched, found):
                closed += 1
                yield start_of(found, problem.n_synergies)
        if closed >= SCARCE:
            continue
        nearest = [each for each in pool.nearest if force_closed(batched, each[1])]
        missed.add(nearest)
        if closed:
            continue
        handed = [state for cost, state in nearest[:HANDED] if cost < NEARLY]
        yield from (start_of(state, problem.n_synergies) for state in handed)
        if not handed:
            yield random_start(problem, rng)


def force_closed(batched: BatchedProblem, found: States) -> bool:
    """Return whether the contacts of a batch of one are force-closed; those under a book on a hand are not."""
    contacts, problem = batched.contacts(found), batched.problem
    at, model = (contacts.points[0], contacts.normals[0], problem.friction), problem.contact_model
    shown = model.dimension == 3 and shows_force_closure(*at, found.forces[0], model)
    return shown or force_closure_margin(*at, model) > 0.0


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
