"""Costs, best forces, wrench spaces, robustness and measures: against foreign numbers, a second way, differences."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

from grasp_planner import InvalidValueError, NameNotFoundError, analysis, model
from grasp_planner.spatial import Array

from .finite_differences import central_differences, relative_error

FOREIGN = json.loads((Path(__file__).parent / "data" / "foreign" / "three_fingers.json").read_text())
GRASP, JACOBIAN, NORMALS = (np.array(FOREIGN[name]) for name in ("G", "J", "normals"))
FRICTION = FOREIGN["friction"]
LIMITS = analysis.ContactLimits(FRICTION["mu"], FRICTION["fmin"], FRICTION["fmax"], FRICTION["k"])
LENGTH = 0.03


@pytest.fixture(scope="module")
def springs() -> model.CompliantGrasp:
    return model.compliant_grasp(
        GRASP,
        JACOBIAN,
        np.eye(12),
        contact_stiffness=FOREIGN["Kc"],
        joint_stiffness=FOREIGN["Kq"],
        synergy_stiffness=FOREIGN["Kz"],
    )


def space(bound: str = "L1", grasp: Array = GRASP) -> analysis.WrenchSpace:
    return analysis.WrenchSpace.of(grasp, NORMALS, 0.8, bound=bound, length=LENGTH)


def test_the_cost_is_that_of_syngrasp() -> None:
    for row in FOREIGN["friction_cost_rows"]:
        limits = analysis.ContactLimits(row["mu"], row["fmin"], row["fmax"], row["k"])
        normals, forces = np.array(row["normals"]).T, np.array(row["lambda"]).reshape(-1, 3)
        assert analysis.contact_cost(forces, normals, limits).value == pytest.approx(row["SGVcost"], rel=1e-9)
        assert limits.keeps(forces, normals) == bool(row["SGcheckFriction"])


@pytest.mark.parametrize("number", range(6))
def test_the_least_cost_is_that_of_syngrasp(springs: model.CompliantGrasp, number: int) -> None:
    case = FRICTION["cases"][number]
    for sample in case["samples"]:
        assert analysis.contact_cost(sample["force"], NORMALS, LIMITS).value == pytest.approx(sample["cost"], rel=1e-9)
    commanded = case["basis"].startswith("E")
    basis = model.commanded_forces(springs) if commanded else model.null_basis(GRASP)
    particular = -np.linalg.pinv(GRASP) @ np.array(case["wrench"])
    found = analysis.least_friction_cost(particular, basis, NORMALS, LIMITS)
    assert found.value == pytest.approx(case["minimum"], rel=1e-9)
    assert found.forces.ravel() == pytest.approx(case["minimum_force"], rel=1e-6)


@pytest.mark.parametrize("scale", [0.2, 10.0, 60.0])
@pytest.mark.parametrize("counted", [None, np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.0]])])
def test_derivatives_of_the_cost(scale: float, counted: Array | None) -> None:
    limits = replace(LIMITS, threshold=0.5)
    forces = (scale * NORMALS + np.random.default_rng(2).normal(size=(3, 3))).ravel()

    def value(f: Array) -> list[float]:
        return [analysis.contact_cost(f, NORMALS, limits, counted).value]

    def gradient(f: Array) -> Array:
        return analysis.contact_cost(f, NORMALS, limits, counted).gradient

    cost = analysis.contact_cost(forces, NORMALS, limits, counted)
    assert relative_error(cost.gradient, central_differences(value, forces, 1e-4)) < 1e-6
    numeric = central_differences(gradient, forces, 1e-4)
    assert np.abs(cost.hessian - numeric).max() < 1e-6 * np.abs(numeric).max()


@pytest.mark.parametrize("bound", ["L1", "Linf"])
def test_epsilon_has_a_certificate_and_a_cone_program_agrees(bound: str) -> None:
    found = analysis.epsilon(space(bound))
    # The bound is a cone program's, exact to its tolerance.
    assert abs(found.bound - found.value) <= 2e-5 * found.value
    assert analysis.reach(space(bound), found.direction)[0] == pytest.approx(found.bound, rel=1e-5)
    rng = np.random.default_rng(0)
    for direction in rng.normal(size=(50, 6)):
        unit = direction / np.linalg.norm(direction)
        reached = analysis.reach(space(bound), unit)[0]
        assert found.value < reached < space(bound).support(unit)[0] * (1.0 + 1e-6)


def test_facets_grow_to_epsilon_and_the_volume_grows() -> None:
    exact = analysis.epsilon(space()).value
    faceted = [analysis.faceted_epsilon(space(), edges) for edges in (4, 8, 16, 32)]
    assert sorted(faceted) == faceted
    assert faceted[-1] <= exact < 1.002 * faceted[-1]
    assert 0.0 < analysis.wrench_volume(space(), 4) < analysis.wrench_volume(space(), 8)


@pytest.mark.parametrize("bound", ["L1", "Linf"])
def test_gradient_of_epsilon(bound: str) -> None:
    scale = np.repeat([1.0, 1.0 / LENGTH], 3)[:, None]
    grasp = scale * GRASP
    found = analysis.epsilon(analysis.WrenchSpace.of(grasp, NORMALS, 0.8, bound=bound), tolerance=1e-6)
    change = np.random.default_rng(4).normal(size=GRASP.shape)

    def value(step: float) -> float:
        moved = analysis.WrenchSpace.of(grasp + step * change, NORMALS, 0.8, bound=bound)
        return analysis.epsilon(moved, tolerance=1e-6).bound

    assert (found.gradient * change).sum() == pytest.approx((value(1e-3) - value(-1e-3)) / 2e-3, rel=0.02)


def test_without_force_closure_epsilon_is_zero() -> None:
    slippery = analysis.WrenchSpace.of(GRASP, NORMALS, 0.0, length=LENGTH)
    assert analysis.epsilon(slippery).value == 0.0
    assert analysis.min_weight(analysis.edge_wrenches(slippery, 4))[0] < 1e-9


def test_a_task_ellipsoid_that_is_a_ball_gives_epsilon() -> None:
    assert analysis.task_epsilon(space(), 2.0 * np.eye(6)).bound == pytest.approx(
        0.5 * analysis.epsilon(space()).bound, rel=1e-4
    )


def test_min_weight_and_its_gradient() -> None:
    rng = np.random.default_rng(1)
    wrenches = analysis.edge_wrenches(space(), 5) + 0.02 * rng.normal(size=(15, 6))  # no ties
    value, gradient = analysis.min_weight(wrenches)
    assert 0.0 < value * len(wrenches) <= 1.0
    change = rng.normal(size=wrenches.shape)
    numeric = (
        analysis.min_weight(wrenches + 1e-4 * change)[0] - analysis.min_weight(wrenches - 1e-4 * change)[0]
    ) / 2e-4
    assert (gradient * change).sum() == pytest.approx(numeric, rel=1e-4)


def test_measures_are_those_of_syngrasp() -> None:
    known = FOREIGN["quality"]
    found = {
        "minSVG": analysis.smallest_singular_value(GRASP)[0],
        "graspIsotropyIndex": analysis.isotropy(GRASP)[0],
        "distSingularConfiguration": analysis.distance_to_singularity(GRASP, JACOBIAN)[0],
        "manipEllipsoidVolume": analysis.manipulability(GRASP, JACOBIAN)[0],
        "unifTransf": analysis.uniformity(GRASP, JACOBIAN)[0],
    }
    for name, value in found.items():
        assert value == pytest.approx(known[name], rel=1e-9), name
    assert analysis.hand_object_jacobian(GRASP, JACOBIAN) == pytest.approx(np.array(FOREIGN["HO"]), abs=1e-12)


POSTURE = np.array([0.1, 0.9, 2.0, -0.5])
MEASURES = {
    "smallest": (analysis.smallest_singular_value, GRASP),
    "volume": (analysis.ellipsoid_volume, GRASP),
    "isotropy": (analysis.isotropy, np.random.default_rng(3).normal(size=(6, 9))),
    "centroid": (lambda points: analysis.centroid_distance(points, np.full(3, 0.1)), np.array(FOREIGN["points"])),
    "centring": (
        lambda q: analysis.joint_centring(q, -np.ones(4), np.arange(1.0, 5.0)),
        np.array([0.1, 0.9, 2.0, -0.5]),
    ),
    "posture": (lambda q: analysis.posture_deviation(q, np.ones(4)), np.array([0.1, 0.9, 2.0, -0.5])),
    "triangle": (analysis.grasp_polygon_area, np.random.default_rng(5).normal(size=(3, 3))),
    "area": (analysis.grasp_polygon_area, np.random.default_rng(6).normal(size=(6, 3))),
    "shape of a triangle": (analysis.polygon_shape, np.random.default_rng(5).normal(size=(3, 3))),
    "shape": (analysis.polygon_shape, np.random.default_rng(6).normal(size=(6, 3))),
    "hull": (analysis.hull_volume, np.random.default_rng(7).normal(size=(11, 6))),
}
for _name, _measure in (
    ("distance", analysis.distance_to_singularity),
    ("manipulability", analysis.manipulability),
    ("uniformity", analysis.uniformity),
):
    MEASURES[_name + " by G"] = (lambda g, of=_measure: of(g, JACOBIAN)[:2], GRASP)
    MEASURES[_name + " by J"] = (lambda j, of=_measure: of(GRASP, j)[::2], JACOBIAN)


@pytest.mark.parametrize("name", MEASURES)
def test_gradients_of_the_measures(name: str) -> None:
    measure, at = MEASURES[name]
    numeric = central_differences(lambda x: [measure(x.reshape(at.shape))[0]], at.ravel(), 1e-5)
    assert np.abs(np.ravel(measure(at)[1]) - numeric.ravel()).max() < 1e-6 * np.abs(numeric).max()


def test_polygons_known_by_hand() -> None:
    square = np.array([[0.0, 0, 1], [0, 2, 1], [2, 2, 1], [2, 0, 1]])
    assert analysis.grasp_polygon_area(square)[0] == pytest.approx(4.0)
    assert analysis.polygon_shape(square)[0] == pytest.approx(0.0, abs=1e-7)
    assert analysis.polygon_shape(square * [3.0, 1.0, 1.0] + [[0.5, 0, 0], [0] * 3, [0] * 3, [0] * 3])[0] > 0.05


def test_robustness_is_the_best_of_all_states_found_another_way(springs: model.CompliantGrasp) -> None:
    four = 0.03 * np.array([[1.0, 0, 0], [-1, 0, 0.3], [0, 1, 0.2], [0, -1, -0.4]])
    normals = -four / np.linalg.norm(four, axis=1, keepdims=True)
    stiff = model.compliant_grasp(
        model.grasp_matrix(four), np.eye(12), np.eye(12), contact_stiffness=1e4, joint_stiffness=1e4
    )
    limits = analysis.ContactLimits(0.9, 1.0, 30.0, 0.01)
    found = analysis.grasp_robustness(stiff, normals, limits)
    best = 0.0
    for states in itertools.product(range(3), repeat=4):
        share = np.array([[1.0, 1, 1], [1, 1, 0], [0, 0, 0]])[list(states)]
        blocks = [(np.eye(3), n[:, None], np.zeros((3, 0)))[state] for state, n in zip(states, normals, strict=True)]
        kept = np.zeros((12, sum(block.shape[1] for block in blocks)))
        column = 0
        for i, block in enumerate(blocks):
            kept[3 * i : 3 * i + 3, column : column + block.shape[1]] = block
            column += block.shape[1]
        grasp = stiff.grasp @ kept
        if np.linalg.matrix_rank(grasp) < 6:
            continue
        basis = kept @ model.null_basis(grasp)  # every force is commanded here

        def cost(y: Array, basis: Array = basis, share: Array = share) -> tuple[float, Array]:
            known = analysis.contact_cost(basis @ y, normals, limits, share)
            return known.value, basis.T @ known.gradient

        least = minimize(cost, basis.T @ (5.0 * normals).ravel(), jac=True, method="BFGS").fun
        best = max(best, sum(state < 2 for state in states) / least)
    assert found.value == pytest.approx(best, rel=1e-5)
    sticking = analysis.contact_robustness(stiff, normals, limits)
    assert sticking.value <= found.value
    assert sticking.states == ("stuck",) * 4
    only = max(analysis.grasp_robustness(stiff, normals, limits, heuristic="H3", stuck=k).value for k in range(5))
    assert only == pytest.approx(found.value)
    for heuristic in ("H1", "H2", "H4"):
        assert analysis.grasp_robustness(stiff, normals, limits, heuristic=heuristic).value <= found.value


@pytest.mark.parametrize("motors", ["a few", "all"])
@pytest.mark.parametrize("states", [("stuck",) * 4, ("stuck", "sliding", "stuck", "detached"), None])
def test_gradients_of_robustness(motors: str, states: tuple[str, ...] | None) -> None:
    rng = np.random.default_rng(5)
    points = 0.03 * np.array([[1.0, 0.1, 0], [-1, 0, 0.3], [0, 1, 0.2], [0.1, -1, -0.4]])
    normals = -points + 0.01 * rng.normal(size=(4, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    basis = np.eye(12) if motors == "all" else rng.normal(size=(12, 2))
    jacobian = np.eye(12) + 0.2 * rng.normal(size=(12, 12))
    stiffnesses = {"contact_stiffness": 1e4, "joint_stiffness": 1e4, "synergy_stiffness": 3e4}
    limits, wrench = analysis.ContactLimits(0.9, 1.0, 30.0, 0.01), np.array([0, 0, -2.0, 0, 0.01, 0])
    grasp = model.grasp_matrix(points)

    def found(change: Array) -> tuple[model.CompliantGrasp, Array, analysis.Robustness]:
        by_grasp, by_jacobian, by_normals = np.split(change, [72, 72 + 144])
        there = grasp + 0.03 * by_grasp.reshape(6, 12), jacobian + by_jacobian.reshape(12, 12)
        moved = model.compliant_grasp(*there, basis, **stiffnesses)
        turned = normals + by_normals.reshape(4, 3)
        if states is None:
            return moved, turned, analysis.grasp_robustness(moved, turned, limits, wrench)
        return moved, turned, analysis.state_robustness(moved, turned, limits, states, wrench)

    springs, _, best = found(np.zeros(228))
    slope = analysis.robustness_gradient(springs, normals, limits, best, wrench)
    told = np.concatenate([0.03 * slope.by_grasp.ravel(), slope.by_jacobian.ravel(), slope.by_normals.ravel()])
    for first, last in ((0, 72), (72, 216), (216, 228)):
        change = np.zeros(228)
        change[first:last] = rng.normal(size=last - first)
        numeric = central_differences(lambda s, d=change: [found(s[0] * d)[2].value], np.zeros(1), 3e-4)
        assert told @ change == pytest.approx(numeric[0, 0], rel=1e-5, abs=5e-6), (first, best.states)


def test_what_holds_nothing_has_no_gradient_of_robustness(springs: model.CompliantGrasp) -> None:
    nothing = analysis.Robustness(0.0, ("detached",) * 3, np.zeros((3, 3)))
    with pytest.raises(InvalidValueError, match="robustness"):
        analysis.robustness_gradient(springs, NORMALS, LIMITS, nothing)


def test_heuristics_try_the_states_they_are_to() -> None:
    def states(n_c: int, *given: object, **named: object) -> list[tuple[str, ...]]:
        return list(analysis.candidate_states(n_c, *given, **named))

    assert len(states(4)) == 81
    angles = np.radians([0.5, 20.0, 38.2, 50.0])  # the cone is at 38.66°
    found = states(4, "H1", angles=angles, friction=0.8)
    assert len(found) == 3
    assert {each[0] + each[2] + each[3] for each in found} == {"sliding" * 3}
    assert len(states(5, "H2", stuck=3)) == 10
    assert ("stuck", "stuck", "stuck", "detached", "detached") in states(5, "H2", stuck=3)
    assert len(states(5, "H3", stuck=3)) == 40
    assert len(states(3, "H4")) == 27
    assert len(states(4, "H4")) == 6
    assert len(states(6, "H4")) == 15 * (6 + 4)
    with pytest.raises(NameNotFoundError, match="heuristic"):
        states(3, "H5")
    with pytest.raises(InvalidValueError, match="stuck"):
        states(3, "H2", stuck=4)
    with pytest.raises(InvalidValueError, match="angles"):
        states(3, "H1")


def test_a_sliding_contact_may_press_elsewhere_than_along_its_normal(springs: model.CompliantGrasp) -> None:
    states = ("stuck", "stuck", "sliding")
    found = analysis.state_robustness(springs, NORMALS, LIMITS, states)
    same = analysis.state_robustness(springs, NORMALS, LIMITS, states, directions=NORMALS)
    other = analysis.state_robustness(springs, NORMALS, LIMITS, states, directions=np.tile(np.eye(3)[2], (3, 1)))
    assert found == same
    for each in (found, other):
        assert each is not None
        assert np.linalg.norm(np.cross(each.forces[2], NORMALS[2])) < 1e-9
    assert other != found


def problem(**given: object) -> analysis.ForceProblem:
    wrench = np.array([0.5, 0.0, -2.0, 0.0, 0.01, 0.0])
    return analysis.ForceProblem(GRASP, NORMALS, 0.8, wrench, **given)


def test_best_forces_balance_and_are_best_at_their_aim() -> None:
    found = {aim: analysis.best_forces(problem(min_normal=0.5), aim) for aim in ("norm", "largest", "normal_sum")}
    for aim, best in found.items():
        assert GRASP @ best.forces.ravel() == pytest.approx(-problem().wrench, abs=1e-6)
        assert model.friction_margins(best.forces, NORMALS, 0.8).min() > -1e-6
        sizes = np.linalg.norm(best.forces, axis=1)
        values = {"norm": np.linalg.norm(sizes), "largest": sizes.max(), "normal_sum": (best.forces * NORMALS).sum()}
        assert best.value == pytest.approx(values[aim])
        for other, rival in found.items():
            assert values[other] >= rival.value * (1.0 - 1e-5)


def test_torque_limits_and_disturbances_are_kept() -> None:
    free = analysis.best_forces(problem(min_normal=0.5))
    eased = 0
    for joint in range(12):
        limits = np.full(12, np.inf)
        limits[joint] = 0.95 * abs(JACOBIAN[:, joint] @ free.forces.ravel())
        tight = problem(min_normal=0.5, jacobian=JACOBIAN, torque_limits=limits)
        limited = analysis.best_forces(tight)
        if limited is not None:
            eased += 1
            assert abs(JACOBIAN[:, joint] @ limited.forces.ravel()) <= limits[joint] + 1e-7
            assert limited.value > free.value
    assert eased >= 3
    assert analysis.best_forces(replace(tight, torque_limits=np.full(12, 1e-3))) is None
    response = model.weighted_right_inverse(GRASP, np.array(FOREIGN["K_series"]))
    cases = np.vstack([np.eye(6)[:3], -np.eye(6)[:3]])
    ready = analysis.best_forces(problem(response=response, disturbances=cases))
    for case in cases:
        answer = ready.forces - (response @ case).reshape(-1, 3)
        assert model.friction_margins(answer, NORMALS, 0.8).min() > -1e-6
    assert ready.value > analysis.best_forces(problem()).value


def test_bad_arguments_are_refused() -> None:
    with pytest.raises(NameNotFoundError, match="aim"):
        analysis.best_forces(problem(), "least")
    with pytest.raises(NameNotFoundError, match="bound"):
        space("L2")
    for field in ("disturbances", "torque_limits", "basis"):
        with pytest.raises(InvalidValueError, match=field):
            analysis.best_forces(problem(**{field: np.ones((9, 6))}))
    with pytest.raises(InvalidValueError, match="max_force"):
        analysis.ContactLimits(max_force=-1.0)
    with pytest.raises(InvalidValueError, match="ellipsoid"):
        analysis.task_epsilon(space(), np.zeros((6, 6)))


CUBE = 0.02 * np.array(
    [[1.0, 0.3, 0.2], [-1, 0.2, -0.3], [0.3, 1, -0.2], [-0.2, -1, 0.3], [0.2, -0.3, 1], [-0.3, 0.2, -1]]
)
FACES = -np.sign(CUBE) * (np.abs(CUBE) > 0.015)
CORNERS = np.vstack([CUBE, [[0.02, -0.015, -0.015], [-0.015, 0.02, 0.015]]])
KINDS = {
    "soft": (model.SoftFinger(0.004), CUBE[:2] * [1.0, 0.0, 0.0], FACES[:2]),
    "frictionless": (model.Frictionless(), CORNERS, np.vstack([FACES, [[-1.0, 0, 0], [0, -1, 0]]])),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("bound", ["L1", "Linf"])
def test_epsilon_of_other_contacts_agrees_with_a_cone_program_and_facets(kind: str, bound: str) -> None:
    contacts, points, normals = KINDS[kind]
    grasp = contacts.grasp_matrix(points, normals)
    found = analysis.WrenchSpace.of(grasp, normals, 0.6, bound=bound, length=0.02, model=contacts)
    exact = analysis.epsilon(found, tolerance=1e-4)
    assert exact.value > 0.0
    assert analysis.reach(found, exact.direction)[0] == pytest.approx(exact.bound, rel=1e-3)
    for direction in np.random.default_rng(1).normal(size=(20, 6)):
        unit = direction / np.linalg.norm(direction)
        reached, forces = analysis.reach(found, unit)
        assert exact.value < reached <= found.support(unit)[0] * (1.0 + 1e-6)
        assert found.grasp @ forces == pytest.approx(reached * unit, abs=1e-6)
    if bound == "L1":
        faceted = [analysis.faceted_epsilon(found, edges) for edges in (4, 8, 16)]
        assert faceted[-1] == pytest.approx(exact.value, rel=0.05)
        assert faceted[0] <= faceted[-1] <= exact.bound * (1.0 + 1e-9)
        assert analysis.wrench_volume(found) > 0.0
        assert analysis.min_weight(analysis.edge_wrenches(found, 6))[0] > 0.0


def test_soft_fingers_hold_with_forces_and_torques_in_their_cone() -> None:
    contacts, points, normals = KINDS["soft"]
    grasp, wrench = contacts.grasp_matrix(points, normals), np.array([0.0, 0.0, -1.0, 0.004, 0.0, 0.0])
    given = analysis.ForceProblem(grasp, normals, 0.6, wrench, model=contacts, max_normal=10.0)
    for aim in ("norm", "largest", "normal_sum"):
        best = analysis.best_forces(given, aim)
        assert best.forces.shape == (2, 4)
        assert grasp @ best.forces.ravel() == pytest.approx(-wrench, abs=1e-7)
        assert model.friction_margins(best.forces, contacts.covectors(normals), 0.6).min() > -1e-6
    assert analysis.best_forces(replace(given, model=model.HardFinger(), grasp=model.grasp_matrix(points))) is None
    covectors = contacts.covectors(normals)
    least = analysis.least_friction_cost(-np.linalg.pinv(grasp) @ wrench, model.null_basis(grasp), covectors, LIMITS)
    assert LIMITS.keeps(least.forces, covectors)

    def value(f: Array) -> list[float]:
        return [analysis.contact_cost(f, covectors, LIMITS).value]

    at = least.forces.ravel()
    gradient = analysis.contact_cost(at, covectors, LIMITS).gradient
    assert relative_error(gradient, central_differences(value, at, 1e-5)) < 1e-6


def test_frictionless_contacts_press() -> None:
    contacts, points, normals = KINDS["frictionless"]
    grasp = contacts.grasp_matrix(points, normals)
    wrench = np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
    best = analysis.best_forces(analysis.ForceProblem(grasp, normals, 0.0, wrench, model=contacts), "normal_sum")
    assert best.forces.min() > -1e-7
    assert grasp @ best.forces.ravel() == pytest.approx(-wrench, abs=1e-6)
    assert best.value == pytest.approx(best.forces.sum())


@pytest.mark.parametrize("kind", KINDS)
def test_every_measure_is_there_for_other_contacts(kind: str) -> None:
    contacts, points, normals = KINDS[kind]
    size = contacts.dimension * len(points)
    springs = model.compliant_grasp(
        contacts.grasp_matrix(points, normals), np.eye(size), np.eye(size), contact_stiffness=1e3, joint_stiffness=1e3
    )
    forces = contacts.covectors(normals)
    given = analysis.ContactSet(
        points, normals, np.full(len(points), 0.6), np.zeros(3), forces, np.ones(6), springs, contacts
    )
    found = {each.name: each for each in analysis.measure_contacts(given)}
    assert found["force-closure margin"].value > 0.0
    assert found["ε, sum of normal forces 1 N"].value > 0.0
    assert found["norm of the forces"].value == pytest.approx(np.sqrt(len(points)))
    assert found["internal forces commanded"].value == size - 6
    assert found["PGR"].value >= found["PCR"].value > 0.0
    least = analysis.best_forces(
        analysis.ForceProblem(given.grasp_matrix, normals, 0.6, np.ones(6), model=contacts), "normal_sum"
    )
    load = np.linalg.norm(np.repeat([1.0, 1.0 / given.length], 3))
    assert found["reach against the load"].value == pytest.approx(load / least.value, rel=1e-5), (
        "1 N, and what holds it"
    )
    assert ("least friction to spare" in found) == contacts.has_friction
    assert found["softest shift"].value > 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_gradient_of_the_force_closure_margin_by_points(kind: str) -> None:
    contacts, points, normals = KINDS[kind]
    points = points + 0.003 * np.random.default_rng(8).normal(size=points.shape)  # off any symmetry, where it bends
    value, gradient = analysis.force_closure(points, normals, 0.6, contacts)
    assert value == pytest.approx(model.force_closure_margin(points, normals, 0.6, contacts))
    assert value > 0.0
    change = 1e-3 * np.random.default_rng(3).normal(size=points.shape)
    moved = contacts.grasp_matrix(points + change, normals) - contacts.grasp_matrix(points, normals)
    ends = [model.force_closure_margin(points + sign * 0.05 * change, normals, 0.6, contacts) for sign in (1, -1)]
    assert (gradient * moved).sum() == pytest.approx((ends[0] - ends[1]) / 0.1, rel=1e-3, abs=1e-7)
