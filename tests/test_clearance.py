"""Clearances: analytic cases, derivatives against differences, and coal against the signed distances."""

from __future__ import annotations

import coal
import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.collision.coal_distances import ExactDistance
from grasp_planner.collision.distances import SegmentSearch, grouped_minimum, saturate, segment_pairs
from grasp_planner.collision.link_shapes import contact_shapes, link_shapes, shape_pairs, tip_axes
from grasp_planner.evaluation.state import StateEvaluator
from grasp_planner.judge.clearance_check import penetration
from grasp_planner.studies.benchmark_problems import OBJECTS as OBJECT_KINDS
from grasp_planner.terms.posture import AbductionOrder
from grasp_planner.terms.registry import problem_constraints

OBJECTS = (
    "sphere:radius=0.035",
    "cylinder:radius=0.03,height=0.15",
    "cylinder:radius=0.03,height=0.1,caps=1",
    "box:x=0.05,y=0.05,z=0.12",
)
MORE_OBJECTS = (
    *OBJECTS,
    "capsule:radius=0.03,height=0.06",
    "ellipsoid:x=0.03,y=0.04,z=0.035",
    OBJECT_KINDS["mesh-flange"](np.random.default_rng(0)).text,
)
HANDS = {name: gp.load_hand(name) for name in ("dlr_hit_ii_right", "dlr_hit_ii_left", "allegro_right", "tendon_hand")}
TERMS = {"link_object", "self_collision", "ground", "tip_patch", "abduction_order"}


def problem(text: str, hand: str = "dlr_hit_ii_right", contact_set: str = "sphere", **options) -> gp.GraspProblem:
    """Return a problem with all clearances, the ground included."""
    clearance = gp.ClearanceOptions(**{"ground": -0.05, "remark1": True, **options})
    n_synergies = min(3, HANDS[hand].synergies().n_synergies)
    return gp.GraspProblem.paper(
        HANDS[hand], gp.parse_object(text), n_synergies=n_synergies, contact_set=contact_set, clearance=clearance
    )


def states(given: gp.GraspProblem, count: int, seed: int = 3):
    """Yield evaluators and points x around the object: fingers apart, close, and in each other."""
    rng, n_q = np.random.default_rng(seed), given.hand.n_joints
    closing = given.hand.lower > -0.5 * given.hand.upper
    for k in range(count):
        start = gp.random_start(given, rng)
        evaluator = StateEvaluator(given, start.palm_pose)
        x = evaluator.pack(start.joint_angles, start.palm_pose, start.delta_sigma)
        x[: n_q + 6] += rng.normal(0.0, 0.05, n_q + 6) * np.r_[np.ones(n_q), 0.1 * np.ones(3), np.ones(3)]
        x[:n_q][closing] += 0.2 * (k % 2)
        yield evaluator, x


def differences(term, given, evaluator, x, step=1e-6):
    """Return central differences of a residual by posture and palm pose."""
    columns = []
    for i in range(given.hand.n_joints + 6):
        e = np.zeros(x.size)
        e[i] = step
        ahead, behind = (term.residual(given, evaluator.evaluate(x + sign * e)) for sign in (1, -1))
        columns.append((ahead - behind) / (2 * step))
    return np.array(columns).T


def check_derivatives(given: gp.GraspProblem, count: int, names: set[str] = TERMS) -> None:
    """Compare every clearance term with central differences; one row in fifty may sit on a switch.

    Of hulls deep inside the object coal knows the normal to 1e-3 only, at times less well, and outside of curved
    objects to 1e-4.
    """
    round_links = all(shape.geometry is None for shape in link_shapes(given.hand))
    terms = [term for term in problem_constraints(given) if term.name in names]
    unordered = {"abduction_order"} if not len(given.abduction_differences) else set()
    assert {term.name for term in terms} == names - unordered
    rows, smooth, size = 0, 0, given.hand.n_joints + 6
    for evaluator, x in states(given, count):
        state = evaluator.evaluate(x)
        for term in terms:
            jacobian = term.jacobian(given, state)
            assert not jacobian[:, size:].any()
            error = np.abs(jacobian[:, :size] - differences(term, given, evaluator, x)).max(axis=1)
            by_depth = np.where(term.residual(given, state) < -1e-3, 5e-3, 2e-4)
            rows, smooth = rows + len(error), smooth + int((error < (2e-5 if round_links else by_depth)).sum())
    assert smooth >= (0.98 if round_links else 0.95) * rows


@pytest.mark.parametrize("contact_set", ["sphere", "point"])
@pytest.mark.parametrize("text", OBJECTS)
def test_derivatives(text, contact_set):
    """Analytic derivatives of every clearance term equal central differences, inside objects too."""
    check_derivatives(problem(text, contact_set=contact_set), count=2)


@pytest.mark.parametrize("text", [OBJECTS[0], OBJECTS[3]])
def test_derivatives_of_inner_contacts(text):
    """The same where inner links touch with their sides."""
    check_derivatives(problem(text, contact_set="power"), count=2, names=TERMS | {"tangency"})


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["geometry", "joint_centres"])
@pytest.mark.parametrize(
    ("hand", "contact_set"),
    [
        (name, chosen)
        for name, hand in HANDS.items()
        for chosen in ("sphere", "point")
        if chosen in hand.contact_set_names
    ],
)
@pytest.mark.parametrize("text", MORE_OBJECTS)
def test_derivatives_of_all(text, hand, contact_set, mode):
    """The same for all hands and kinds of objects, both forms of Remark 2 and more postures."""
    other = {"joint_centre"} if mode == "joint_centres" else {"link_object"}
    names = TERMS - {"link_object"} | other
    check_derivatives(problem(text, hand, contact_set, link_object=mode), count=2, names=names)


def test_segments_have_the_distance_coal_finds():
    """Closest points of segments, points and parallel ones give the distance of capsules."""
    rng = np.random.default_rng(0)
    start_a, end_a, start_b, end_b = rng.normal(size=(4, 60, 3))
    end_a[:5], end_b[5:10] = start_a[:5], start_b[5:10]
    end_b[10:15] = start_b[10:15] + 0.7 * (end_a - start_a)[10:15]
    on_a, on_b = segment_pairs(start_a, end_a, start_b, end_b)
    for k in range(60):
        grid = np.linspace(0.0, 1.0, 101)[:, None]
        a, b = (s[k] + grid * (e[k] - s[k]) for s, e in ((start_a, end_a), (start_b, end_b)))
        sampled = np.linalg.norm(a[:, None] - b[None], axis=2).min()
        found = np.linalg.norm(on_a[k] - on_b[k])
        assert found <= sampled + 1e-12
        assert found > sampled - 0.05


def test_capsule_against_sphere():
    """Beside, beyond the end and through the ball, the least distance is that of the centre from the axis."""
    ball = gp.Sphere(radius=0.03)
    start = np.array([[0.05, 0.0, -0.1], [0.1, 0.0, 0.0], [0.01, 0.0, -0.1]])
    end = np.array([[0.05, 0.0, 0.1], [0.2, 0.0, 0.0], [0.01, 0.0, 0.1]])
    distance, points, gradient = SegmentSearch(ball, 3).least(start, end, np.full(3, 1.0))
    np.testing.assert_allclose(distance, [0.02, 0.07, -0.02], atol=1e-12)
    np.testing.assert_allclose(points, [[0.05, 0, 0], [0.1, 0, 0], [0.01, 0, 0]], atol=1e-9)
    np.testing.assert_allclose(gradient, np.tile([1.0, 0.0, 0.0], (3, 1)), atol=1e-9)


@pytest.mark.parametrize("text", OBJECTS)
def test_signed_distance_of_capsules_equals_coal(text):
    """Outside the object the search along the axis and coal's GJK agree to a micrometre."""
    solid = gp.parse_object(text).solid
    rng = np.random.default_rng(4)
    start = rng.normal(0.0, 0.06, (200, 3))
    end = start + rng.normal(0.0, 0.03, (200, 3))
    distance, _, _ = SegmentSearch(solid, 200).least(start, end, np.full(200, 1.0))
    compared = 0
    for k in np.flatnonzero(distance > 1e-3):
        axis = end[k] - start[k]
        length = np.linalg.norm(axis)
        frame = np.linalg.svd(axis[None] / length)[2].T
        turn = np.column_stack([frame[:, 1], frame[:, 2], np.cross(frame[:, 1], frame[:, 2])])
        pose = coal.Transform3s(turn, (start[k] + end[k]) / 2)
        value = ExactDistance()(coal.Capsule(0.01, length), pose, solid.coal_geometry(), coal.Transform3s())
        assert value == pytest.approx(distance[k] - 0.01, abs=1e-6)
        compared += 1
    assert compared > 50


@pytest.mark.parametrize("text", OBJECTS)
def test_state_agrees_with_the_independent_check(text):
    """What the search sees is what coal measures: links with the object, fingers with each other, the ground."""
    given = problem(text, margin=0.0)
    touching = contact_shapes(given.hand, link_shapes(given.hand), given.frames)
    for evaluator, x in states(given, 4):
        clearance = evaluator.evaluate(x).clearance
        found = gp.analysis.hand_clearances(given, x[:15], evaluator.palm_pose(x))
        contact_links = {name.rsplit("_", 1)[0] for name in touching} | {f"{f.name}_pad" for f in given.frames}
        exact = [p.distance for p in found if p.kind == "link_object" and p.link_a not in contact_links]
        if 0.0 < min(exact) < 0.01:
            assert clearance.link_object.min() == pytest.approx(min(exact), abs=1e-6)
        pairs = [p.distance for p in found if p.kind == "self_collision"]
        if min(pairs) < 0.01:
            assert min(pairs) - 1e-3 < clearance.self_collision.min() <= min(pairs) + 1e-6
        heights = [p.distance for p in found if p.kind == "ground"]
        assert min(heights) - 1e-3 < clearance.ground.min() <= min(heights) + 1e-6


def test_saturation_is_smooth_and_conservative():
    """Distances are kept up to half the limit, never raised, and level off with a continuous slope."""
    d = np.linspace(-0.02, 0.05, 701)
    value, slope = saturate(d, 0.02)
    assert (value <= d + 1e-15).all() and value.max() == pytest.approx(0.02)
    np.testing.assert_array_equal(value[d <= 0.01], d[d <= 0.01])
    np.testing.assert_allclose(np.gradient(value, d)[1:-1], slope[1:-1], atol=5e-3)


def test_grouped_minimum():
    """The smooth minimum lies just below the true one, and its weights add up to one."""
    values, groups = np.array([1.0, 2.0, 5.0, 5.0]), np.array([0, 0, 1, 1])
    least, weights = grouped_minimum(values, groups, 2, 0.1)
    np.testing.assert_allclose(least, [1.0, 5.0 - 0.1 * np.log(2.0)], atol=1e-4)
    np.testing.assert_allclose(np.bincount(groups, weights), 1.0)


def test_shapes_of_the_hand():
    """Pads lie inside their links' capsules; a touching finger has its last link left to the contact patch."""
    hand = HANDS["dlr_hit_ii_right"]
    shapes = link_shapes(hand)
    assert len(shapes) == 3 + 3 * 5
    for name in ("sphere", "point"):
        touching = contact_shapes(hand, shapes, hand.contact_frames(name))
        assert touching == {f"{f}_distal_0" for f in ("thumb", "index", "middle", "ring", "little")}
        for _, _, axis, _ in tip_axes(hand, hand.contact_frames(name)):
            np.testing.assert_allclose(axis, [1.0, 0.0, 0.0], atol=1e-9)
    allegro = HANDS["allegro_right"]  # boxes around balls: the ball touches, the box keeps clear
    balls = contact_shapes(allegro, link_shapes(allegro), allegro.contact_frames("sphere"))
    assert balls == {f"link_{k}.0_tip_0" for k in (3, 7, 11, 15)}
    pairs = {frozenset((shapes[i].link, shapes[j].link)) for i, j in shape_pairs(hand, shapes)}
    assert frozenset(("palm", "index_proximal")) not in pairs
    assert frozenset(("palm", "index_distal")) in pairs


def test_tip_patch_keeps_the_last_link_outside():
    """A pad on the surface with n·a ≥ 0 keeps the capsule it ends outside; with n·a < 0 it does not."""
    ball = gp.Sphere(radius=0.03)
    for lean, clear in ((0.3, True), (0.0, True), (-0.3, False)):
        pad, normal = np.array([[0.04, 0.0, 0.0]]), np.array([-1.0, 0.0, 0.0])
        axis = lean * normal + np.sqrt(1 - lean**2) * np.array([0.0, 0.0, 1.0])
        distance, _, _ = SegmentSearch(ball, 1).least(pad - 0.0165 * axis, pad, np.ones(1))
        assert (distance[0] - 0.010 > -1e-12) == clear


def test_remark_1(hand_name="dlr_hit_ii_right"):
    """Abduction angles in order pass, neighbours exchanged fail by their difference."""
    given = problem(OBJECTS[0], hand_name)
    q = given.hand.posture({"index_abd": -0.1, "middle_abd": 0.0, "ring_abd": 0.1, "little_abd": 0.2})
    assert given.abduction_differences @ q == pytest.approx(np.full(3, 0.1))
    q[given.hand.joint_index("middle_abd")] = 0.15
    assert (given.abduction_differences @ q).min() == pytest.approx(-0.05)
    assert AbductionOrder in {type(term) for term in problem_constraints(given)}


def test_terms_follow_the_options():
    """Every term can be switched off; without any the state has no clearances."""
    off = gp.GraspProblem.paper(HANDS["dlr_hit_ii_right"], gp.Sphere(), clearance=gp.ClearanceOptions.off())
    assert not TERMS & {term.name for term in problem_constraints(off)}
    evaluator, x = next(states(off, 1))
    assert evaluator.evaluate(x).clearance is None
    full = gp.GraspProblem.paper(HANDS["dlr_hit_ii_right"], gp.Sphere(), clearance=gp.ClearanceOptions())
    assert {term.name for term in problem_constraints(full)} & TERMS == TERMS - {"ground", "abduction_order"}


@pytest.mark.parametrize(
    "bad",
    [{"margin": -1.0}, {"margin": 0.2}, {"margin": float("nan")}, {"ground": float("inf")}, {"remark1": 1}],
)
def test_bad_options(bad):
    """Options out of range are refused."""
    with pytest.raises(gp.InvalidValueError):
        gp.ClearanceOptions(**bad)


def test_unknown_mode_is_refused():
    """A mode that does not exist is named with those that do."""
    with pytest.raises(gp.NameNotFoundError, match="joint_centres"):
        gp.ClearanceOptions(link_object="joint_centers")


def test_overlaps_are_found_by_coal():
    """A ball in the palm is a penetration of the palm by its exact depth."""
    given = problem("sphere:radius=0.02")
    pose = gp.standard_start(given).palm_pose
    deep = pose.se3()
    deep.translation = -np.array(pose.rotation) @ np.array([0.036 + 0.015, 0.0, 0.05])
    found = gp.analysis.hand_clearances(given, np.zeros(15), deep)
    assert penetration(found, "link_object") == pytest.approx(0.005, abs=1e-9)
