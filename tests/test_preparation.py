"""Starts prepared along the synergies: derivatives, what they reach, and the searches that begin there."""

from itertools import islice

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.planning.preparation import _SynergyMotion, prepare_start, search_starts
from grasp_planner.planning.program import GraspProgram


def problem_of(hand, n_synergies=1, clearance=False):
    options = gp.ClearanceOptions() if clearance else gp.ClearanceOptions.off()
    return gp.GraspProblem.paper(hand, gp.Cylinder(), n_synergies=n_synergies, clearance=options)


@pytest.mark.parametrize("hand_name", ["dlr_hit_ii_right", "allegro_right", "tendon_hand"])
@pytest.mark.parametrize("part", ["contacts", "inequalities"])
def test_derivatives_along_the_synergies_match_differences(hand_name, part):
    problem = problem_of(gp.load_hand(hand_name), 2)
    start = gp.random_start(problem, np.random.default_rng(4))
    motion = _SynergyMotion(GraspProgram(problem, start.palm_pose))
    function, y = getattr(motion, part), motion.begin(start)
    step = 1e-6
    columns = [(function(y + step * e)[0] - function(y - step * e)[0]) / (2 * step) for e in np.eye(y.size)]
    slope = function(y)[1]
    assert slope == pytest.approx(np.column_stack(columns), rel=1e-5, abs=1e-5 * np.abs(slope).max())


def test_a_prepared_start_lies_on_the_synergies_and_nearer(right):
    problem = problem_of(right)
    start = gp.standard_start(problem)
    prepared = prepare_start(problem, start)
    along = problem.synergies.joint_angles(prepared.sigma)
    assert prepared.start.joint_angles == pytest.approx(np.clip(along, right.lower, right.upper), abs=1e-9)

    def gap(point):
        return np.abs(gp.Grasp(problem, point.joint_angles, point.palm_pose, point.delta_sigma).contacts.gaps).max()

    assert gap(prepared.start) < 0.2 * gap(start)


def test_the_same_seed_gives_the_same_starts(right):
    problem = problem_of(right)
    first, second = (
        [start.delta_sigma for start in islice(search_starts(problem, np.random.default_rng(2)), 16)] for _ in range(2)
    )
    assert np.array_equal(first, second)


def test_a_given_start_comes_first_as_it_is(right):
    problem = problem_of(right)
    given = gp.standard_start(problem)
    assert next(search_starts(problem, np.random.default_rng(0), given)) is given


def test_preparing_can_be_stopped(right):
    class Stop(Exception):
        """Raised by the check."""

    checked = []

    def check():
        checked.append(None)
        if len(checked) > 3:
            raise Stop

    with pytest.raises(Stop):
        list(search_starts(problem_of(right), np.random.default_rng(0), check=check))
    assert len(checked) == 4


@pytest.mark.slow
@pytest.mark.parametrize("n_synergies", [1, 2])
def test_human_synergies_hold_the_papers_cylinder_with_one_and_two(right, n_synergies):
    """From random starts alone nothing is found; the paper needs 26 N and 22 N."""
    options = gp.PlannerOptions(enough=1)
    grasp = gp.plan_grasp(problem_of(right, n_synergies), options=options)
    assert grasp.problem.synergies.name == "santello"
    assert grasp.feasible
    assert grasp.force_norm < 10.0
