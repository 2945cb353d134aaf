"""Contacts moved to where a hand can hold the object, if the middles of its pads can't: found by a short search.

With one motor the normals of three fingertips balance in few postures only, and often beside the pads, which are flat.
Balls that are about the whole fingertips find those postures in many cheap states; what touches there becomes the
contacts, patches that are the skin to 0.2 mm, and those from which most states become feasible are taken.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from ..exceptions import InvalidValueError
from ..hand.description import ContactDescription
from ..hand.hand import Hand
from ..hand.loading import URDF_ENDINGS, LoadedHand
from ..hand.skin import Skin, with_contact_sets
from ..model.contact_model import HardFinger
from ..multistart.pool import Pool
from ..multistart.problem_rows import BatchedProblem
from ..multistart.states import States
from ..objects import parse_object
from ..problem.problem import GraspProblem
from .attempt import Attempt
from .phase_one import settle
from .pooled_starts import ROUND, WIDTH, random_states, start_of

STATES = 24
"""States found with whole fingertips."""
CANDIDATES = 8
"""Most places of contacts that are tried, those with the widest patches; fewer if half of the states fit one."""
TRIED = 4
"""States of each that are made feasible with exact clearances."""
SETTLED = 1e-3
"""Largest scaled violation of a state that counts as feasible."""

Check = Callable[[], None]


def moved_contacts(problem: GraspProblem, rng: np.random.Generator, check: Check = lambda: None) -> GraspProblem:
    """Return the problem with contacts beside the pads of the fingers if the pads hold nothing in a first round.

    Args:
        problem: The problem; only patches derived from a URDF are moved, and only with one synergy.
        rng: Source of random numbers.
        check: Called at every iteration; may raise to stop.

    Returns:
        The problem with a hand whose contacts are moved; the same if its contacts serve, or none that serve are found.
    """
    if not _movable(problem) or _found(problem, rng, check, 1):
        return problem
    skins = [Skin(problem.hand, frame) for frame in problem.frames]
    whole = _with_contacts(problem, skins, [skin.whole() for skin in skins])
    states = _found(whole, rng, check, STATES)
    places = []
    for normals in _normals_in_links(whole, states):
        check()
        about = [skin.about(normal) for skin, normal in zip(skins, normals, strict=True)]
        places.append([each for each in about if each is not None])
    places = sorted((each for each in places if len(each) == len(skins)), key=_width, reverse=True)
    best, score = problem, (0, 0)
    for contacts in places[:CANDIDATES]:
        moved = _with_contacts(problem, skins, contacts)
        found = _score(moved, states, check)
        if found[0] and found > score:
            best, score = moved, found
        if score >= (TRIED, len(states) // 2):
            break
    return best


def with_planned_contacts(loaded: LoadedHand) -> Hand:
    """Return the hand with the contacts that planning a grasp of its first object would move.

    Args:
        loaded: A hand from a URDF.

    Returns:
        The hand with moved contacts; the same if its contacts serve, if planning moves none of such a hand, or if they
        are too few for a grasp.
    """
    try:
        problem = GraspProblem(loaded.hand, parse_object(loaded.first_object))
    except InvalidValueError:
        return loaded.hand
    return moved_contacts(problem, np.random.default_rng(0)).hand


def said_of(before: Hand, after: Hand) -> tuple[str, ...]:
    """Return what happened to the contacts of a hand, in a line for each set that was changed."""
    said = []
    for name, contacts in after.description.contact_sets.items():
        mine = before.description.contact_sets[name]
        moved = ", ".join(key for key, each in contacts.items() if each != mine[key])
        if moved:
            said.append(f"derived: contacts of {moved} moved beside the pads: found by a short search")
    return tuple(said)


def _movable(problem: GraspProblem) -> bool:
    """Return whether one motor presses with patches derived from a URDF, and many states can be searched at once."""
    source = problem.hand.source
    derived = source is not None and source.path.suffix.lower() in URDF_ENDINGS
    springs = problem.parameters.force_law == "springs" and isinstance(problem.contact_model, HardFinger)
    patches = all(frame.patch is not None for frame in problem.frames) and problem.clearance.tip_patch
    return derived and springs and patches and problem.n_synergies == 1


def _found(problem: GraspProblem, rng: np.random.Generator, check: Check, count: int) -> list[States]:
    """Return up to so many feasible states of a round of random starts."""
    batched = BatchedProblem(problem)
    found = Pool(batched, WIDTH).search(lambda number: random_states(batched, number, rng), ROUND, check)
    return list(islice(found, count))


def _normals_in_links(problem: GraspProblem, states: Sequence[States]) -> list[list[np.ndarray]]:
    """Return the normals of contacts in the frames of their joints, of shape (3,), for each state."""
    batched, found = BatchedProblem(problem), []
    for state in states:
        contacts = batched.contacts(state)
        turns = contacts.placed.rotations[0]
        found.append(
            [turns[frame.joint_id].T @ contacts.normals[0, index] for index, frame in enumerate(problem.frames)]
        )
    return found


def _with_contacts(
    problem: GraspProblem, skins: Sequence[Skin], contacts: Sequence[ContactDescription]
) -> GraspProblem:
    """Return a problem with other contacts in place of those of its set."""
    hand = problem.hand
    sets = hand.description.contact_sets
    given = {skin.frame.name: contact for skin, contact in zip(skins, contacts, strict=True)}
    changed = {key: value | given if key == problem.contact_set_name else value for key, value in sets.items()}
    return replace(problem, hand=with_contact_sets(hand, changed))


def _width(contacts: Sequence[ContactDescription]) -> float:
    """Return how wide the narrowest patch of contacts is [rad²]."""
    return min(each.patch.bend * each.patch.side for each in contacts if each.patch is not None)


def _score(problem: GraspProblem, states: Sequence[States], check: Check) -> tuple[int, int]:
    """Return how many of the states become feasible with exact clearances, of the first few, and with coarse ones."""
    pool, waiting = Pool(BatchedProblem(problem), WIDTH), list(states)

    def make(number: int) -> States:
        first, *others = (waiting.pop() for _ in range(number))
        for other in others:
            first = first.joined(other)
        return first

    found = list(pool.search(make, len(states), check))
    return sum(_settles(problem, state, check) for state in found[:TRIED]), len(found)


def _settles(problem: GraspProblem, state: States, check: Check) -> bool:
    """Return whether a state becomes feasible with exact clearances."""
    attempt = Attempt.at(0, problem, start_of(state, problem.n_synergies))
    attempt.z = settle(attempt.program, attempt.z, check)
    return attempt.merit < SETTLED
