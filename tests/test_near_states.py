"""What came near in a round of starts: what is kept of it, how it is moved, and where it leads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.multistart import pool as pool_room
from grasp_planner.multistart.pool import Pool
from grasp_planner.multistart.problem_rows import BatchedProblem
from grasp_planner.planning import neighbours, pooled_starts
from grasp_planner.planning.neighbours import NearStates, Spread
from grasp_planner.planning.pooled_starts import random_states


@pytest.fixture(scope="module")
def brick() -> BatchedProblem:
    """A box that few postures of the Allegro hold with three synergies."""
    return BatchedProblem(gp.GraspProblem(gp.load_hand("allegro_right"), gp.Box(x=0.064, y=0.032, z=0.04, mass=0.1)))


def some(batched: BatchedProblem, rng: np.random.Generator, count: int) -> list:
    """Return random states, each a batch of one."""
    states = random_states(batched, count, rng)
    return [states.take(np.array([row])) for row in range(count)]


def test_the_nearest_are_kept_and_none_twice(brick, rng, monkeypatch):
    monkeypatch.setattr(neighbours, "MOST_STATES", 3)
    near, states = NearStates(brick.problem), some(brick, rng, 5)
    assert len(near) == 0
    near.add([(float(cost), state) for cost, state in zip((5, 4, 3, 2, 1), states, strict=True)])
    near.add([(0.5, replace(states[4], translation=states[4].translation + 1e-3)), (9.0, states[0])])
    assert len(near) == 3
    monkeypatch.setattr(neighbours, "NEAR_STATES", Spread(0.0, 0.0, 0.0))
    places = {tuple(place) for place in near.states(60, rng).translation}
    wanted = [states[4].translation + 1e-3, states[3].translation, states[2].translation]
    assert places == {tuple(place[0]) for place in wanted}


def test_they_move_along_the_synergies_and_stay_within_limits(brick, rng):
    hand, basis = brick.problem.hand, brick.problem.synergies.basis
    near, (state,) = NearStates(brick.problem), some(brick, rng, 1)
    near.add([(1.0, state)])
    moved = near.states(200, rng)
    assert (moved.joints >= hand.lower).all() and (moved.joints <= hand.upper).all()
    inside = ((moved.joints > hand.lower) & (moved.joints < hand.upper)).all(axis=1)
    steps = (moved.joints - state.joints)[inside]
    assert len(steps) and np.abs(steps).max() > 0.01
    if ((state.joints > hand.lower) & (state.joints < hand.upper)).all():
        np.testing.assert_allclose(steps @ basis @ basis.T, steps, atol=1e-12)
    turned = moved.rotation.transpose(0, 2, 1) @ moved.rotation
    np.testing.assert_allclose(turned, np.broadcast_to(np.eye(3), turned.shape), atol=1e-12)
    assert 1e-3 < np.std(moved.translation - state.translation, axis=0).min() < 0.02
    np.testing.assert_array_equal(moved.forces, np.broadcast_to(state.forces, moved.forces.shape))


def test_they_lead_nearer_than_random_starts(brick, rng):
    """The middle one of what begins near the nearest ends at less than three quarters of a random start's cost."""

    def middle(make) -> tuple[float, Pool]:
        pool = Pool(brick, 48)
        found = [0.0 for _ in pool.search(make, 48, lambda: None)]
        return float(np.median(found + [cost for cost, _ in pool.nearest])), pool

    by_chance, pool = middle(lambda number: random_states(brick, number, rng))
    near = NearStates(brick.problem)
    near.add(pool.nearest[:8])
    assert middle(lambda number: near.states(number, rng))[0] < 0.75 * by_chance


def test_rounds_that_find_little_are_followed_by_what_came_near(brick, rng, monkeypatch):
    """The first round is random, of the second three in four begin near it; where plenty is found all are random."""
    monkeypatch.setattr(pooled_starts, "ROUND", 24)
    monkeypatch.setattr(pooled_starts, "force_closed", lambda batched, found: True)
    asked: list[int] = []
    moved = NearStates.states

    def counted(self: NearStates, number: int, rng: np.random.Generator):
        asked.append(number)
        return moved(self, number, rng)

    monkeypatch.setattr(NearStates, "states", counted)
    monkeypatch.setattr(pool_room, "SOLVED", 0.0)  # nothing is found
    monkeypatch.setattr(pool_room, "OLDEST", 6)
    monkeypatch.setattr(pooled_starts, "NEARLY", 0.0)
    starts = pooled_starts.pooled_starts(brick.problem, rng)
    assert not next(starts).prepared and asked == []
    assert not next(starts).prepared
    assert 10 <= sum(asked) <= 24
    asked.clear()
    monkeypatch.setattr(pool_room, "SOLVED", np.inf)  # all is found
    starts = pooled_starts.pooled_starts(brick.problem, rng)
    assert all(next(starts).prepared for _ in range(60))
    assert asked == []
