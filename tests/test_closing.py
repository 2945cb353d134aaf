"""How a grasp closes: touches, contact and friction laws, states of rest."""

from dataclasses import replace

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.closing.closing import close_grasp, close_grasps
from grasp_planner.closing.contact_law import PENALTY, contact_rows
from grasp_planner.closing.equilibrium import RestSolver
from grasp_planner.closing.newton import Asked, RestEvaluator
from grasp_planner.closing.onward import FARTHEST, SHARE, way_on
from grasp_planner.closing.path import free_posture, posture_overlaps, reference_path, reference_paths
from grasp_planner.closing.report import OPEN_OVERLAP, ClosingReport
from grasp_planner.closing.rest import Anchors, Conditions
from grasp_planner.closing.together import run_together
from grasp_planner.closing.touches import find_touches
from grasp_planner.judge.load_check import command_matrix
from grasp_planner.model.friction import friction_margins
from grasp_planner.planning.ranking import FoundGrasps
from grasp_planner.records.layout import ClosingRecord
from grasp_planner.records.parts import closing_record

from .finite_differences import central_differences
from .stored import stored

PUSHED = 4.5
"""A load case that the stored grasp, closed, withstands only if it squeezes beyond its plan [N]."""


@pytest.fixture(scope="module")
def grasp():
    return stored("point_cylinder")


@pytest.fixture(scope="module")
def closing(grasp):
    return grasp.closing


def moved(pose):
    return replace(pose, translation=pose.translation + 2e-3)


def changed(grasp, **parameters):
    problem = replace(grasp.problem, parameters=replace(grasp.problem.parameters, **parameters))
    return replace(grasp, problem=problem)


@pytest.mark.parametrize(
    ("force", "gap", "slip"),
    [
        ((2.0, 0.3, -0.2), 1e-4, (1e-5, 2e-5)),  # stuck
        ((2.0, 1.5, -0.9), -2e-4, (3e-4, 2e-4)),  # sliding
        ((0.1, 0.3, -0.2), 5e-4, (1e-5, 2e-5)),  # apart
    ],
)
def test_the_laws_of_a_contact_have_their_derivatives(force, gap, slip):
    def residual(x):
        # Moving along the normal, into the object, closes the gap; along the tangents it slips.
        return contact_rows(x[None, :3], np.array([gap - x[3]]), slip + x[None, 4:], np.array([0.8]), np.array([True]))[
            2
        ][0]

    x = np.array([*force, 0.0, 0.0, 0.0])
    by_force, by_motion, _ = contact_rows(
        x[None, :3], np.array([gap]), np.array([slip]), np.array([0.8]), np.array([True])
    )
    numeric = central_differences(residual, x, [1e-4] * 3 + [1e-6] * 3)
    np.testing.assert_allclose(np.hstack([by_force[0], by_motion[0]]), numeric, rtol=1e-6, atol=1e-5 * PENALTY)


def test_a_contact_that_slides_pulls_the_object_along():
    force = np.array([[1.0, 0.8, 0.0]])
    _, _, rest = contact_rows(force, np.zeros(1), np.array([[1e-3, 0.0]]), np.array([0.8]), np.array([True]))
    np.testing.assert_allclose(rest, 0.0, atol=1e-12)
    _, _, against = contact_rows(force, np.zeros(1), np.array([[-1e-3, 0.0]]), np.array([0.8]), np.array([True]))
    assert abs(against[0, 1]) > 0.1


@pytest.mark.parametrize("name", ["point_cylinder", "loads"])
def test_the_plan_is_the_state_of_rest_of_its_own_contacts(name):
    grasp = stored(name)
    problem, n_c = grasp.problem, len(grasp.problem.frames)
    centres = grasp.configuration.contact_centres(problem.frames)
    solver = RestSolver(problem, grasp.palm_pose, 100)
    anchors = Anchors(centres, np.tile(grasp.joint_angles, (n_c, 1)), np.full(n_c, True))
    away = replace(solver.begin(grasp.joint_angles + 1e-3), forces=0.95 * grasp.forces)
    sought = solver.solve(away, Conditions(grasp.reference_joint_angles, anchors, problem.external_wrench))
    (found,) = run_together(RestEvaluator(problem), [sought])
    np.testing.assert_allclose(found.forces, grasp.forces, atol=1e-3)
    np.testing.assert_allclose(found.q, grasp.joint_angles, atol=1e-5)
    np.testing.assert_allclose(found.translation, grasp.palm_pose.translation, atol=1e-5)


def test_fingers_touch_on_the_surface_and_in_the_order_of_their_times(grasp, closing):
    touches = find_touches(grasp, closing.path)
    surface = grasp.problem.grasp_object.solid
    np.testing.assert_allclose(surface.sample(touches.points).distance, 0.0, atol=1e-7)
    np.testing.assert_allclose(surface.sample(touches.centres).distance, grasp.problem.radii, atol=1e-6)
    times = dict(zip(closing.names, closing.times, strict=True))
    assert list(closing.order) == sorted(times, key=times.get)
    np.testing.assert_allclose(closing.mismatch, np.linalg.norm(closing.points - grasp.contacts.points, axis=1))


def test_forces_at_rest_carry_the_weight_within_their_cones(grasp, closing):
    assert closing.holds and closing.text.startswith("closes from open")
    weight = grasp.problem.external_wrench[:3]
    # The object has turned by less than a degree.
    np.testing.assert_allclose(closing.forces.sum(axis=0), -weight, atol=0.02 * np.linalg.norm(weight) + 5e-3)
    assert closing.cone_use.max() <= 1.0 + 1e-2
    assert (closing.pushes >= closing.displacement - 1e-3).all()


def test_a_grasp_that_slips_does_not_close(grasp):
    slippery = close_grasp(changed(grasp, friction=0.03))
    assert not slippery.holds
    assert slippery.text.startswith("does not close")


def test_a_finger_that_never_arrives_is_named(grasp):
    path = reference_path(grasp, links=False)
    stopped = close_grasp(grasp, replace(path, touching=path.open, squeezing=path.open))
    assert not stopped.holds
    assert "would not touch" in stopped.text
    assert not np.isfinite(stopped.times).any()


def test_grasps_that_close_go_first_if_so_asked(grasp):
    dear = changed(grasp, force_weight=1.0)  # the worse objective
    slippery = changed(grasp, friction=0.03)
    found = FoundGrasps()
    for each in (slippery, replace(dear, palm_pose=moved(dear.palm_pose))):
        found.keep(each)
    assert found.first() is slippery
    assert not slippery.closing.holds
    assert found.closing() == [found.ranked()[1]]
    assert found.best(1, closing=True) == (found.ranked()[1],)


def test_a_grasp_found_twice_is_kept_once(grasp):
    found = FoundGrasps()
    for each in (changed(grasp, force_weight=1.0), replace(grasp), replace(grasp, palm_pose=moved(grasp.palm_pose))):
        found.keep(each)
    assert (found.count, found.different) == (3, 2)
    assert found.first().problem.parameters.force_weight < 1.0


def test_a_hand_with_many_synergies_closes_in_the_first_of_several_ways_that_holds(grasp):
    ways = list(reference_paths(grasp, links=False))  # the plan's links overlap the object
    assert len({way.touching.tobytes() for way in ways}) == len(ways) > 1
    first = next(way for way in ways if close_grasp(grasp, way).holds)
    np.testing.assert_array_equal(grasp.closing.path.touching, first.touching)
    open_hand = free_posture(grasp, first.open)
    np.testing.assert_array_equal(grasp.closing.pregrasp, open_hand)
    assert first.overlap == posture_overlaps(grasp.problem, open_hand, grasp.palm_pose, links=False)[0] <= OPEN_OVERLAP


def test_squeezing_beyond_the_plan_goes_on_along_the_same_way(grasp):
    way = reference_path(grasp, links=False)
    farther = way.beyond(1.4)
    np.testing.assert_allclose(farther.squeezing - way.touching, 1.4 * (way.squeezing - way.touching))
    np.testing.assert_array_equal(farther.touching, way.touching)
    plain, harder = close_grasp(grasp, way), close_grasp(grasp, farther)
    assert np.linalg.norm(harder.forces) > 1.1 * np.linalg.norm(plain.forces)
    assert harder.torque_use > 1.1 * plain.torque_use > 0.0
    assert "squeezing 1.4 times" in harder.text and "squeezing" not in plain.text


def test_the_way_on_loads_nothing_but_the_fingers_and_comes_nearest_to_the_planned_forces():
    grasp = stored("default_box")
    by_motors = command_matrix(grasp.problem, grasp.grasp_matrix, grasp.hand_jacobian)
    onward, planned = way_on(grasp), grasp.intensities.ravel()
    way = onward.way
    more = by_motors @ way
    np.testing.assert_allclose(grasp.grasp_matrix @ more, 0.0, atol=1e-6)
    off = np.linalg.norm(more - planned)
    assert off < 0.5 * np.linalg.norm(planned)
    for other in np.eye(grasp.problem.n_synergies):
        for sign in (1.0, -1.0):
            assert np.linalg.norm(by_motors @ (way + sign * 0.02 * other) - planned) > off
    np.testing.assert_array_equal(reference_path(grasp).onward.way, way)


def test_the_way_on_ends_where_a_planned_contact_would_slide():
    grasp = stored("default_box")
    more = command_matrix(grasp.problem, grasp.grasp_matrix, grasp.hand_jacobian) @ way_on(grasp).way
    for friction in (0.9, 0.7):
        rough = changed(grasp, friction=friction)
        reach = way_on(rough).reach

        def least(share, rough=rough, friction=friction):
            forces = rough.forces + share * more.reshape(-1, 3)
            return friction_margins(forces, rough.contacts.normals, friction).min()

        assert reach == 0.0 or least(reach) >= 0.0
        assert reach == pytest.approx(FARTHEST) or least(reach + SHARE) < 0.0
    assert way_on(changed(grasp, friction=0.7)).reach <= way_on(changed(grasp, friction=0.9)).reach > 0.0


def test_a_hand_squeezes_beyond_the_plan_only_where_it_would_not_hold_otherwise(grasp):
    assert grasp.closing.path.factor == 1.0
    heavy = replace(grasp, problem=replace(grasp.problem, loads=gp.LoadCases(force=PUSHED)))
    first = reference_path(heavy, links=False)
    assert close_grasp(heavy, first).worth_squeezing
    assert heavy.closing.holds
    assert heavy.closing.path.factor > 1.0
    assert heavy.closing.push == pytest.approx(1.5 * PUSHED)


def test_a_hand_does_not_close_beyond_its_torques(grasp):
    weak = replace(grasp.closing, torque_use=1.2)
    assert grasp.closing.holds and not weak.holds
    assert "120 % of its torque" in weak.text


def test_a_hand_that_cannot_open_does_not_close(grasp):
    way = reference_path(grasp, links=False)
    blocked = close_grasp(grasp, replace(way, overlap=2e-3))
    assert close_grasp(grasp, way).holds and not blocked.holds
    assert "the open hand overlaps by 2.0 mm" in blocked.text


@pytest.mark.parametrize(("holds", "found"), [(True, 2), (False, 4)])
def test_the_search_goes_on_until_a_grasp_closes(hand, monkeypatch, holds, found):
    monkeypatch.setattr(ClosingReport, "holds", holds)
    law = gp.GraspParameters(force_law="springs")
    easy = gp.GraspProblem.paper(hand, gp.Cylinder(), n_synergies=15, parameters=law)
    options = gp.PlannerOptions(enough=2)
    assert gp.plan_grasp(easy, options=options).search.starts_feasible == found
    assert gp.plan_grasp(easy, options=replace(options, closing=False)).search.starts_feasible == 2


def test_the_record_has_no_infinite_number(grasp):
    for closing in (grasp.closing, close_grasp(changed(grasp, friction=0.03))):
        record = closing_record(closing)
        assert ClosingRecord.model_validate_json(record.model_dump_json()) == record
        assert record.holds == closing.holds
        assert (record.forces is None) == (not closing.rests)


def test_closings_found_together_are_those_found_alone(grasp, closing):
    off = [
        replace(grasp, palm_pose=replace(grasp.palm_pose, translation=grasp.palm_pose.translation + 2e-3 * way))
        for way in np.eye(3)
    ]
    slippery = changed(grasp, friction=0.03)  # of another problem
    together = close_grasps([*off, slippery], closing.path)
    assert len({report.holds for report in together}) == 2
    for one, report in zip([*off, slippery], together, strict=True):
        alone = close_grasp(one, closing.path)
        assert (alone.holds, alone.rests) == (report.holds, report.rests)
        np.testing.assert_allclose(report.forces, alone.forces, atol=1e-6)
        np.testing.assert_allclose(report.pushes, alone.pushes, atol=1e-9)
        np.testing.assert_allclose(report.slip, alone.slip, atol=1e-9)


def test_of_those_that_close_the_one_whose_fingers_slide_least_is_chosen(grasp):
    def slid(by, each):
        each.__dict__["closing"] = replace(grasp.closing, slip=by * np.ones(5))
        return each

    def pose(index):
        return replace(grasp.palm_pose, translation=grasp.palm_pose.translation + 2e-3 * index)

    # The last serves its task badly, the one before slides most.
    weightless = {"force_law": "springs", "force_weight": None, "task_weight": None}
    lean = changed(grasp, **weightless).problem
    good = [slid(by, replace(grasp, problem=lean, palm_pose=pose(i))) for i, by in enumerate([3e-3, 1e-3, 5e-3])]
    bad = slid(1e-4, replace(grasp, problem=lean, palm_pose=pose(4)))
    for each, index in ((good[0], 1.0), (good[1], 3.9), (good[2], 1.1), (bad, 4.1)):
        each.__dict__.update(alignments=((10.0, False),), objective=index)
    found = FoundGrasps()
    for each in (*good, bad):
        found.keep(each)
    assert found.surest_closing() is good[1]
    assert found.best(3, closing=True)[0] is good[1]
    good[1].__dict__["alignments"] = ((15.1, False),)
    assert found.surest_closing() is good[0]
    # With weights the objective decides.
    weighted = FoundGrasps()
    for index, by in enumerate([3e-3, 1e-3]):
        each = slid(by, replace(grasp, palm_pose=pose(index)))
        each.__dict__["objective"] = float(index)
        weighted.keep(each)
    assert weighted.surest_closing().closing.slip.max() == 3e-3


def test_works_are_sent_what_they_wait_for():
    class Doubling:
        calls = 0

        def steps(self, asked):
            self.calls += 1
            return [2 * each.state for each in asked]

    def leaf(value):
        return (yield Asked(value, None, None, None))

    def tree(value):
        first = yield Asked(value, None, None, None)
        rest = yield [leaf(10 * value), leaf(100 * value)]
        return [first, *rest]

    doubling = Doubling()
    assert run_together(doubling, [tree(1), tree(2), leaf(7)]) == [[2, 20, 200], [4, 40, 400], 14]
    assert doubling.calls == 2
    assert run_together(doubling, []) == []


def test_an_object_that_nothing_holds_follows_a_palm_that_is_off():
    grasp = stored("loads")  # a cylinder along z
    assert grasp.closing.holds and grasp.closing.holds_free

    def off(shift):
        return replace(grasp, palm_pose=replace(grasp.palm_pose, translation=grasp.palm_pose.translation + shift))

    palms = [off(np.array(shift)) for shift in ([0.0, 0.0, 0.0], [2e-3, 0.0, 0.0], [0.0, 0.0, 2e-3])]
    still, across, along = close_grasps(palms, grasp.closing.path, safety=1.0, free=True)
    assert still.holds and across.holds and along.holds
    assert 1e-3 < across.displacement < 3e-3
    np.testing.assert_allclose(along.forces, still.forces, atol=0.05 * np.abs(still.forces).max())
    for report in (still, across):
        weight = grasp.problem.external_wrench[:3]
        np.testing.assert_allclose(report.forces.sum(axis=0), -weight, atol=0.05 * np.linalg.norm(weight) + 5e-3)
    # What gives way is pressed less than what is held.
    (held,) = close_grasps([palms[1]], grasp.closing.path, safety=1.0)
    assert np.linalg.norm(across.forces) < np.linalg.norm(held.forces)
    (slippery,) = close_grasps([changed(grasp, friction=0.03)], grasp.closing.path, safety=1.0, free=True)
    assert not slippery.holds


def test_one_that_closes_around_a_free_object_goes_before_one_that_slides_less(grasp):
    lean = changed(grasp, force_law="springs", force_weight=None, task_weight=None).problem
    found = FoundGrasps()
    for index, free in enumerate([False, True]):
        pose = replace(grasp.palm_pose, translation=grasp.palm_pose.translation + 2e-3 * index)
        each = replace(grasp, problem=lean, palm_pose=pose)
        report = replace(grasp.closing, slip=(1.0 + index) * 1e-3 * np.ones(5), holds_free=free)
        each.__dict__.update(closing=report, alignments=((10.0, False),), objective=1.0 + index)
        found.keep(each)
    assert found.surest_closing().closing.holds_free
