"""Quasi-static maps, subspaces and stiffness against numbers that are not ours, and against the springs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from grasp_planner import InvalidValueError, NameNotFoundError
from grasp_planner.model import (
    CompliantGrasp,
    Preload,
    commanded_forces,
    complete_grasp_matrix,
    complete_jacobian,
    compliant_grasp,
    contact_selection,
    force_manipulability,
    friction_angles,
    grasp_matrix,
    grasp_stiffness,
    grasp_subspaces,
    homogeneous_solution,
    kinematic_manipulability,
    moved_stiffness,
    null_basis,
    principal_stiffness,
    projector,
    quasi_static_maps,
    resisted_motions,
    rigid_body_motions,
    stacked_change,
    tangent_frames,
    weighted_right_inverse,
)
from grasp_planner.spatial import Array

FOREIGN = json.loads((Path(__file__).parent / "data" / "foreign" / "three_fingers.json").read_text())


def foreign(name: str) -> Array:
    return np.array(FOREIGN[name])


def close(found: Array, expected: Any, tolerance: float = 1e-9) -> None:
    expected = np.asarray(expected, dtype=float)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() <= tolerance * np.abs(expected).max()


@pytest.fixture
def springs() -> CompliantGrasp:
    return compliant_grasp(
        foreign("G"),
        foreign("J"),
        np.eye(12),
        contact_stiffness=foreign("Kc"),
        joint_stiffness=foreign("Kq"),
        synergy_stiffness=foreign("Kz"),
    )


def random_springs(seed: int, *, motors: int = 4, preload: bool = True) -> CompliantGrasp:
    rng = np.random.default_rng(seed)

    def spd(size: int) -> Array:
        root = rng.normal(size=(size, size))
        return np.asarray(root @ root.T + size * np.eye(size))

    terms = Preload(*(0.1 * rng.normal(size=shape) for shape in ((11, 11), (11, 6), (motors, motors), (6, 6))))
    return compliant_grasp(
        rng.normal(size=(6, 12)),
        rng.normal(size=(12, 11)),
        rng.normal(size=(11, motors)),
        contact_stiffness=spd(12),
        joint_stiffness=spd(11),
        synergy_stiffness=spd(motors),
        preload=terms if preload else None,
    )


@pytest.mark.parametrize(
    ("name", "letter"),
    [
        ("object_motion", "V"),
        ("contact_forces", "P"),
        ("joint_motion", "Q"),
        ("joint_torques", "T"),
        ("synergy_motion", "Y"),
    ],
)
def test_the_maps_are_those_of_syngrasp(springs: CompliantGrasp, name: str, letter: str) -> None:
    close(getattr(quasi_static_maps(springs).commands, name), FOREIGN[letter])


def test_the_object_follows_rigid_motors_as_in_syngrasp(springs: CompliantGrasp) -> None:
    free = compliant_grasp(
        springs.grasp, springs.jacobian, np.eye(12), contact_stiffness=foreign("Kc"), joint_stiffness=None
    )
    close(quasi_static_maps(free).commands.object_motion, FOREIGN["Vq"])


def test_an_activation_is_that_of_syngrasp(springs: CompliantGrasp) -> None:
    given = FOREIGN["activation"]
    found = quasi_static_maps(springs).commands.of(given["delta_zr"])
    close(found.contact_forces, given["delta_lambda"])
    close(found.motor_forces, given["delta_sigma"])
    close(found.object_motion, given["delta_u"])


def test_the_springs_hold_in_every_answer() -> None:
    springs = random_springs(3)
    maps, terms = quasi_static_maps(springs), springs.preload
    for answer, wrench, reference in (
        (maps.commands, np.zeros((6, 4)), np.eye(4)),
        (maps.wrench, np.eye(6), np.zeros((4, 6))),
    ):
        f, q, u, z = answer.contact_forces, answer.joint_motion, answer.object_motion, answer.synergy_motion
        close(springs.contact_compliance @ f, springs.jacobian @ q - springs.grasp.T @ u)
        close(answer.joint_torques, springs.jacobian.T @ f + terms.joints @ q + terms.object @ u)
        close(springs.joint_compliance @ answer.joint_torques, springs.basis @ z - q)
        close(answer.motor_forces, springs.basis.T @ answer.joint_torques + terms.synergies @ z)
        close(springs.synergy_compliance @ answer.motor_forces, reference - z)
        assert np.abs(springs.grasp @ f - terms.wrench @ u + wrench).max() < 1e-9


def test_without_preload_the_maps_have_closed_forms() -> None:
    springs = random_springs(4, preload=False)
    stiffness, g = springs.stiffness, springs.grasp
    inverse = weighted_right_inverse(g, stiffness)
    moved = stiffness @ springs.jacobian @ springs.basis
    maps = quasi_static_maps(springs)
    close(maps.commands.contact_forces, moved - inverse @ (g @ moved))
    close(maps.wrench.contact_forces, -inverse)
    close(maps.commands.object_motion, np.linalg.solve(g @ stiffness @ g.T, g @ moved))


def test_a_hand_of_rigid_joints_contacts_and_motors_is_a_limit() -> None:
    springs = random_springs(5, preload=False)
    g, j, s = springs.grasp, springs.jacobian, springs.basis
    for name in ("contact_stiffness", "joint_stiffness", "synergy_stiffness"):
        given: dict[str, Any] = {"contact_stiffness": 20.0, "joint_stiffness": 3.0, "synergy_stiffness": 2.0}
        rigid = quasi_static_maps(compliant_grasp(g, j, s, **(given | {name: None}))).commands.contact_forces
        stiff = quasi_static_maps(compliant_grasp(g, j, s, **(given | {name: 1e9}))).commands.contact_forces
        close(stiff, rigid, 1e-6)


def test_subspaces_are_those_of_syngrasp(springs: CompliantGrasp) -> None:
    spaces = grasp_subspaces(springs.grasp, springs.jacobian)
    close(projector(spaces.internal_forces), FOREIGN["null_G"])
    close(projector(spaces.redundant_motions), FOREIGN["null_J"])
    close(projector(commanded_forces(springs)), FOREIGN["E"])
    rigid = rigid_body_motions(springs)
    close(projector(rigid["synergy_motion"]), FOREIGN["rigid_references"])
    close(projector(np.vstack([rigid["synergy_motion"], rigid["object_motion"]])), FOREIGN["rigid_graph"])
    assert spaces.classes == ("graspable", "redundant")


def test_classes_of_small_grasps_have_their_names() -> None:
    # Two hard fingers on a line: the object turns freely about it; one joint moves one of them along it.
    grasp = np.zeros((6, 6))
    grasp[:3, :3] = grasp[:3, 3:] = np.eye(3)
    grasp[4, 2], grasp[5, 1], grasp[4, 5], grasp[5, 4] = -1.0, 1.0, 1.0, -1.0
    jacobian = np.zeros((6, 1))
    jacobian[1, 0] = 1.0
    spaces = grasp_subspaces(grasp, jacobian)
    assert spaces.classes == ("indeterminate", "graspable", "defective", "hyperstatic")
    close(projector(spaces.free_motions), np.diag([0.0, 0, 0, 1, 0, 0]))
    close(grasp @ spaces.hyperstatic_forces + 1.0, np.ones((6, 1)))
    assert np.abs(jacobian.T @ spaces.hyperstatic_forces).max() < 1e-12


@pytest.mark.parametrize("unit", [1.0, 1e3], ids=["m", "mm"])
def test_forces_that_all_act_through_the_centre_make_no_moment(unit: float) -> None:
    points = unit * 0.03 * np.random.default_rng(0).normal(size=(6, 3))
    normals = -points / np.linalg.norm(points, axis=1, keepdims=True)
    grasp = complete_grasp_matrix(points) @ contact_selection(normals, ["frictionless"] * 6).T
    assert 0.0 < np.abs(grasp[3:]).max() < 1e-13 * unit, "rounding"
    spaces = grasp_subspaces(grasp, np.eye(6))
    assert (spaces.internal_forces.shape[1], spaces.free_motions.shape[1]) == (3, 3)


def test_the_homogeneous_solution_satisfies_every_law_with_the_physical_sign() -> None:
    springs = random_springs(6, motors=10, preload=False)
    solution = homogeneous_solution(springs)
    for part in (solution.rigid, solution.internal, solution.external):
        size = max(1.0, np.abs(part["contact_forces"]).max(initial=0.0))
        residuals = (
            part["wrench"] + springs.grasp @ part["contact_forces"],
            springs.contact_compliance @ part["contact_forces"]
            - springs.jacobian @ part["joint_motion"]
            + springs.grasp.T @ part["object_motion"],
            springs.joint_compliance @ part["joint_torques"]
            - springs.basis @ part["synergy_motion"]
            + part["joint_motion"],
            springs.synergy_compliance @ part["motor_forces"] - part["references"] + part["synergy_motion"],
        )
        for residual in residuals:
            assert np.abs(residual).max(initial=0.0) < 1e-9 * size
    assert solution.rigid["references"].shape[1] == 10 + 6 - 12


def test_stiffness_is_that_of_syngrasp(springs: CompliantGrasp) -> None:
    close(grasp_stiffness(springs), FOREIGN["K_grasp"])
    close(springs.stiffness, FOREIGN["K_series"])


def test_principal_axes_belong_to_the_centre_of_compliance() -> None:
    root = np.random.default_rng(1).normal(size=(6, 6))
    stiffness = root @ root.T
    found = principal_stiffness(stiffness)
    about = np.linalg.inv(moved_stiffness(stiffness, found.centre))
    close(about[3:, :3], about[3:, :3].T)
    for k in range(3):
        force = found.translational_axes[:, k]
        assert force @ about[:3, :3] @ force == pytest.approx(1.0 / found.translational[k])
    # Springs through one point have it as their centre.
    point = np.array([0.1, -0.2, 0.3])
    central = np.diag([100.0, 200.0, 300.0, 1.0, 2.0, 3.0])
    moved = principal_stiffness(moved_stiffness(central, -point))
    close(moved.centre, point)
    close(moved.translational, [100.0, 200.0, 300.0])
    close(moved.rotational, [1.0, 2.0, 3.0])


def test_springs_that_leave_the_object_free_are_refused() -> None:
    given: dict[str, Any] = {"contact_stiffness": 1.0, "joint_stiffness": 1.0}
    with pytest.raises(InvalidValueError, match="springs that fix it"):
        quasi_static_maps(compliant_grasp(np.zeros((6, 3)), np.eye(3), np.eye(3), **given))


@pytest.mark.parametrize("stiffness", [-1.0, [[1.0, 2.0], [2.0, 1.0]], np.eye(3), np.nan, np.triu(np.ones((12, 12)))])
def test_bad_stiffnesses_are_refused(stiffness: Any) -> None:
    with pytest.raises(InvalidValueError, match="joint_stiffness"):
        compliant_grasp(np.ones((6, 9)), np.ones((9, 12)), np.eye(12), contact_stiffness=1.0, joint_stiffness=stiffness)


def test_manipulability_is_that_of_syngrasp(springs: CompliantGrasp) -> None:
    kinematic = kinematic_manipulability(springs)
    close(kinematic.ratios[3:], sorted(FOREIGN["kinematic"])[3:])
    assert np.abs(kinematic.ratios[:3]).max() < 1e-12
    force = force_manipulability(springs)
    assert len(force.ratios) == 6
    for k, ratio in enumerate(force.ratios):
        felt = quasi_static_maps(springs).wrench.motor_forces @ force.object_side[:, k]
        assert 1.0 / (felt @ felt) == pytest.approx(ratio)
    assert kinematic_manipulability(springs, 0.1).ratios[-1] < kinematic.ratios[-1]


def test_the_two_answers_to_a_wrench_have_names_and_one_is_syngrasps(springs: CompliantGrasp) -> None:
    least = force_manipulability(springs, references="least")
    close(least.ratios, sorted(FOREIGN["force_least"]), 1e-6)
    assert force_manipulability(springs).ratios[-1] > 2.0 * least.ratios[-1]
    with pytest.raises(NameNotFoundError, match="references"):
        force_manipulability(springs, references="free")  # type: ignore[arg-type]
    solution = homogeneous_solution(springs)
    for found, name in ((solution.least_external, "external"), (solution.least_internal, "internal")):
        change = stacked_change(found)
        change[-12:] *= -1.0  # SynGrasp's references have the other sign
        known = foreign(f"homogeneous_{name}")
        close(projector(change), known @ known.T, 1e-6)
    assert np.abs(stacked_change(solution.least_external).T @ stacked_change(solution.internal)).max() < 1e-9


def test_contacts_of_mixed_kinds_are_those_of_syngrasp() -> None:
    points, normals = foreign("points") - foreign("centre"), foreign("normals")
    selection = contact_selection(normals, FOREIGN["mixed_kinds"])
    twists = np.concatenate([foreign("J").reshape(3, 3, 12), foreign("Jtilde_angular").reshape(3, 3, 12)], axis=1)
    close(complete_grasp_matrix(points) @ selection.T, FOREIGN["mixed_G"])
    close(selection @ complete_jacobian(twists), FOREIGN["mixed_J"])
    close(contact_selection(normals, ["hard"] * 3), np.eye(9, 18))
    close(contact_selection(normals, ["frictionless"] * 3)[1, 3:6], normals[1])
    with pytest.raises(NameNotFoundError, match="contact kind"):
        contact_selection(normals, ["hard", "wet", "soft"])  # type: ignore[list-item]
    with pytest.raises(InvalidValueError, match="kinds"):
        contact_selection(normals, ["hard"])
    frames = tangent_frames(normals)
    close(frames.transpose(0, 2, 1) @ frames, np.tile(np.eye(3), (3, 1, 1)))
    close(np.linalg.det(frames), np.ones(3))
    close(frames[:, :, 2], normals)
    for row in FOREIGN["angles"]:  # SynGrasp has the acute angle between the two lines
        angle = friction_angles(np.array(row["force"]).reshape(-1, 3), normals)
        close(np.minimum(angle, np.pi - angle), row["angle"])


def pinch(motors: int | None = None, seed: int = 7) -> CompliantGrasp:
    """Two hard fingers: the object turns freely about their line."""
    rng = np.random.default_rng(seed)
    jacobian = rng.normal(size=(6, 5))
    basis = np.eye(5) if motors is None else rng.normal(size=(5, motors))
    grasp = grasp_matrix(rng.normal(size=(2, 3)))
    return compliant_grasp(
        grasp, jacobian, basis, contact_stiffness=50.0, joint_stiffness=[1.0, 2, 3, 4, 5], synergy_stiffness=2.0
    )


@pytest.mark.parametrize("motors", [None, 1, 2])
def test_a_pinch_has_all_maps_but_for_the_motion_nothing_resists(motors: int | None) -> None:
    springs = pinch(motors)
    with pytest.raises(InvalidValueError, match="springs that fix it"):
        quasi_static_maps(springs)
    maps = quasi_static_maps(springs, free="none")
    held = resisted_motions(springs.grasp)
    assert held.shape == (6, 5)
    free = grasp_subspaces(springs.grasp, springs.jacobian).free_motions
    assert np.abs(free.T @ maps.commands.object_motion).max() < 1e-9
    # The same by a spring so soft that it takes no part, to what only it resists.
    guide = compliant_grasp(
        np.hstack([springs.grasp, free]),
        np.vstack([springs.jacobian, np.zeros((1, 5))]),
        springs.basis,
        contact_stiffness=[50.0] * 7,
        joint_stiffness=[1.0, 2, 3, 4, 5],
        synergy_stiffness=2.0,
    )
    close(quasi_static_maps(guide).commands.contact_forces[:6], maps.commands.contact_forces)
    close(quasi_static_maps(guide).wrench.motor_forces, maps.wrench.motor_forces)
    close(grasp_stiffness(springs), springs.grasp @ springs.stiffness @ springs.grasp.T)
    assert np.abs(grasp_stiffness(springs) @ free).max() < 1e-9
    commanded = commanded_forces(springs)
    assert commanded.shape[1] == 1
    assert np.abs(springs.grasp @ commanded).max() < 1e-9
    solution = homogeneous_solution(springs)
    assert solution.external["wrench"].shape[1] == 5
    close(solution.external["wrench"] + springs.grasp @ solution.external["contact_forces"] + 1.0, np.ones((6, 5)))
    assert rigid_body_motions(springs)["object_motion"].shape[1] == springs.basis.shape[1] + 6 - 6
    assert len(force_manipulability(springs, references="least").ratios) == min(5, springs.basis.shape[1])
    with pytest.raises(InvalidValueError, match="not positive definite"):
        principal_stiffness(grasp_stiffness(springs))
    with pytest.raises(NameNotFoundError, match="free"):
        quasi_static_maps(springs, free="some")  # type: ignore[arg-type]


def test_rigid_contacts_of_a_defective_grasp_have_no_stiffness() -> None:
    springs = pinch()
    rigid = compliant_grasp(springs.grasp, springs.jacobian, springs.basis, contact_stiffness=None, joint_stiffness=1.0)
    with pytest.raises(InvalidValueError, match="rank 5"):
        grasp_stiffness(rigid)


@pytest.mark.parametrize("unit", [1.0, 1000.0], ids=["metres", "millimetres"])
@pytest.mark.parametrize(
    ("contacts", "joints", "motors", "classes"),
    [
        (3, 12, 12, ("graspable", "redundant")),
        (4, 16, 3, ("graspable", "redundant")),
        (2, 8, 8, ("indeterminate", "graspable", "redundant")),
        (3, 6, 6, ("graspable", "defective")),
        (4, 4, 4, ("graspable", "defective", "hyperstatic")),
    ],
)
def test_all_changes_are_the_kernel_of_all_laws(
    unit: float, contacts: int, joints: int, motors: int, classes: tuple[str, ...]
) -> None:
    rng = np.random.default_rng(contacts * joints)
    n, each = 3 * contacts, joints // contacts
    grasp, jacobian = grasp_matrix(0.03 * unit * rng.normal(size=(contacts, 3))), np.zeros((n, joints))
    for i in range(contacts):
        jacobian[3 * i : 3 * i + 3, each * i : each * i + each] = 0.08 * unit * rng.normal(size=(3, each))
    basis = np.eye(joints) if motors == joints else rng.normal(size=(joints, motors))
    root = rng.normal(size=(n, n))
    k_c = 1000.0 / unit * (root @ root.T + 3.0 * np.eye(n))
    k_q, k_z = (unit * np.diag(rng.uniform(0.5, 2.0, size)) for size in (joints, motors))
    given = {"contact_stiffness": k_c, "joint_stiffness": k_q, "synergy_stiffness": k_z}
    springs = compliant_grasp(grasp, jacobian, basis, **given)
    assert grasp_subspaces(grasp, jacobian).classes == classes
    # Columns: w, f, τ, σ, u, q, z, z_r.
    sizes = [6, n, joints, motors, 6, joints, motors, motors]
    zero = [[np.zeros((a, b)) for b in sizes] for a in (6, joints, motors, n, joints, motors)]
    for row, column, block in (
        *((0, 0, np.eye(6)), (0, 1, grasp), (1, 1, -jacobian.T), (1, 2, np.eye(joints)), (2, 2, -basis.T)),
        *((2, 3, np.eye(motors)), (3, 1, np.eye(n)), (3, 4, k_c @ grasp.T), (3, 5, -k_c @ jacobian)),
        *((4, 2, np.eye(joints)), (4, 5, k_q), (4, 6, -k_q @ basis), (5, 3, np.eye(motors)), (5, 6, k_z), (5, 7, -k_z)),
    ):
        zero[row][column] = block
    kernel = null_basis(np.block(zero), 1e-12)
    solution = homogeneous_solution(springs)
    parts = (solution.least_external, solution.least_internal, solution.rigid)
    found = np.hstack([stacked_change(part) for part in parts])
    found /= np.linalg.norm(found, axis=0)
    assert found.shape[1] == kernel.shape[1] == 6 + motors
    close(projector(found), kernel @ kernel.T, 1e-9)
    series = np.linalg.inv(k_c) + jacobian @ np.linalg.inv(k_q) @ jacobian.T
    moved = jacobian @ basis
    close(grasp_stiffness(springs), grasp @ np.linalg.inv(series + moved @ np.linalg.inv(k_z) @ moved.T) @ grasp.T)
