"""Files of contacts from elsewhere: models and friction of each contact, bounds, tasks; a grasp of mixed contacts."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from grasp_planner.analysis import ContactSet, contact_set, measure_contacts, reach
from grasp_planner.cli.main import main
from grasp_planner.exceptions import FileFormatError
from grasp_planner.model import Frictionless, HardFinger, MixedContacts, SoftFinger, compliant_grasp
from grasp_planner.records.contact_file import read_contact_file

from .finite_differences import central_differences

POINTS = [[0.03, 0, 0], [-0.015, 0.026, 0], [-0.015, -0.026, 0.005]]
NORMALS = [[-1, 0, 0], [0.5, -0.8660254037844386, 0], [0.5, 0.8660254037844386, 0]]
PLAIN = {"points": POINTS, "normals": NORMALS, "friction": 0.7}
MIXED = {
    "contact_model": ["hard", "soft:torsion=0.004", "frictionless"],
    "friction": [0.7, 0.5, 0.1],
    "forces": [[-3, 0, 0.5], [1.5, -2.6, 0.5, 0.2], [2.0]],
}


def read(tmp_path, content):
    path = tmp_path / "contacts.json"
    path.write_text(json.dumps(content))
    return read_contact_file(path)


def hand(rows, columns=9):
    """A hand of which all contacts move."""
    jacobian = np.random.default_rng(2).normal(size=(rows, columns))
    return {"J": jacobian.tolist(), "contact_stiffness": 1000.0, "joint_stiffness": 500.0}


def test_every_contact_may_have_its_own_model_and_friction(tmp_path):
    found = read(tmp_path, PLAIN | MIXED | hand(3 + 4 + 1))
    assert isinstance(found.model, MixedContacts)
    assert found.model.text == "hard, soft:torsion=0.004, frictionless"
    np.testing.assert_allclose(found.friction, [0.7, 0.5, 1.0])
    assert found.least_friction == 0.5, "of those that have any"
    np.testing.assert_allclose(found.forces, [[-3, 0, 0.5, 0], [1.5, -2.6, 0.5, 0.2], [2, 0, 0, 0]])
    assert found.springs.grasp.shape == (6, 8), "only what there is counts dimensions"
    pushed = found.forces[0, :3] + found.forces[1, :3] + 2.0 * np.array(NORMALS[2])
    np.testing.assert_allclose((found.grasp_matrix @ found.forces.ravel())[:3], pushed)
    twist = np.cross(POINTS[0], found.forces[0, :3]) + np.cross(POINTS[1], found.forces[1, :3])
    twist += 2.0 * np.cross(POINTS[2], NORMALS[2]) + 0.004 * 0.2 * np.array(NORMALS[1])
    np.testing.assert_allclose((found.grasp_matrix @ found.forces.ravel())[3:], twist)


def test_models_that_are_all_one_are_that_model(tmp_path):
    found = read(tmp_path, PLAIN | {"contact_model": ["soft"] * 3, "friction": [0.7] * 3})
    assert found.model == SoftFinger()


@pytest.mark.parametrize("model", [HardFinger(), SoftFinger(torsion=0.01)])
def test_mixed_contacts_of_one_model_measure_as_that_model(model):
    points, normals, rng = np.array(POINTS), np.array(NORMALS), np.random.default_rng(4)
    grasp, d = model.grasp_matrix(points, normals), model.dimension
    springs = compliant_grasp(
        grasp, rng.normal(size=(3 * d, 12)), np.eye(12)[:, :7], contact_stiffness=900.0, joint_stiffness=40.0
    )
    forces = 0.1 * rng.normal(size=(3, d)) + model.covectors(normals)
    wrench = np.array([0, 0, -2.0, 0, 0.01, 0])
    plain = ContactSet(points, normals, np.array([0.7, 0.6, 0.5]), np.zeros(3), forces, wrench, springs, model)
    padded = np.pad(forces, ((0, 0), (0, 4 - d)))
    mixed = replace(plain, model=MixedContacts((model,) * 3), forces=padded)
    for one, other in zip(measure_contacts(plain), measure_contacts(mixed), strict=True):
        assert one.name == other.name
        if one.name != "min-weight n·l*":  # counts edges, of which a padded cone has more
            exact = 2e-3 if one.name.startswith("ε") else 1e-5  # a lower bound, 0.1 % from the upper one
            assert other.value == pytest.approx(one.value, rel=exact, abs=1e-9, nan_ok=True), one.name
            assert other.text == one.text


def test_a_frictionless_contact_among_others_only_presses(tmp_path):
    found = read(tmp_path, PLAIN | MIXED)
    space = found.wrench_space()
    alone = space.support(np.array([0.0, 0, 1, 0, 0, 0]))[1].reshape(3, 4)
    np.testing.assert_allclose(alone[2], 0.0, atol=1e-12)
    pressed = space.support(np.append(NORMALS[2], np.zeros(3)))[1].reshape(3, 4)[2]
    np.testing.assert_allclose(pressed, [1, 0, 0, 0], atol=1e-12)


def test_the_slopes_of_mixed_bases_agree_with_differences():
    model = MixedContacts((HardFinger(), SoftFinger(), Frictionless()))
    normals = np.array(NORMALS)

    def basis(flat):
        return model.basis(flat.reshape(3, 3)).ravel()

    found = central_differences(basis, normals.ravel(), 1e-4).reshape(3, 6, 4, 3, 3)
    slope = model.basis_slope(normals)
    for i in range(3):
        np.testing.assert_allclose(found[i, :, :, i], slope[i], atol=1e-8)


def test_given_wrenches_are_reached_so_many_times(tmp_path):
    tasks = [[0, 0, 2.0, 0, 0, 0], [0, 0, 0, 0, 0, 0.01]]
    found = read(tmp_path, PLAIN | {"tasks": tasks})
    value = {each.name: each.value for each in measure_contacts(found)}
    scaled = np.array(tasks) / np.repeat([1.0, found.length], 3)
    told = [reach(found.wrench_space(), row / np.linalg.norm(row))[0] / np.linalg.norm(row) for row in scaled]
    assert value["task ε, given wrenches"] == pytest.approx(min(told))
    # A push at a contact is a wrench of at most the length √n_c of the ellipsoid of all: it reaches no farther than ε.
    assert value["ε, sum of normal forces 1 N"] > 0.0
    assert value["task ε, pushes at the contacts"] > 0.0


def test_planned_tasks_are_among_the_measures(planned):
    contacts = contact_set(planned)
    np.testing.assert_allclose(contacts.tasks, [task.direction for task in planned.problem.tasks])
    assert "task ε, given wrenches" in {each.name for each in measure_contacts(contacts)}


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({"friction": [0.7, 0.7]}, "friction: got '2 of them'"),
        ({"friction": [0.7, 0.7, 0.0]}, "1e-06 to 1000"),
        ({"friction": []}, "friction"),
        ({"friction": [[0.7]] * 3}, "friction"),
        ({"contact_model": ["hard"]}, "contact_model: got '1 of them'"),
        ({"contact_model": ["hard", "hard", "wet"]}, "wet"),
        (MIXED | {"forces": [[1, 2, 3]] * 3}, "forces.1: got '3 numbers', allowed: 4 for soft"),
        (MIXED | hand(9), "J"),
        ({"J": (1e7 * np.eye(9)).tolist(), "contact_stiffness": 1e3}, "numbers up to 1e+06"),
        (hand(9) | {"S": [[1e99]] * 9}, "numbers up to 1e+06"),
        (hand(9) | {"contact_stiffness": 1e13}, "contact_stiffness: got 10000000000000.0, allowed: 1e-06 to 1e+12"),
        (hand(9) | {"joint_stiffness": 1e-9}, "joint_stiffness: got 1e-09"),
        (hand(9) | {"synergy_stiffness": []}, "synergy_stiffness"),
        (hand(9) | {"joint_stiffness": [1e-5, *[1e7] * 8]}, "times as stiff one way as another"),
        (hand(9) | {"contact_stiffness": np.diag([1e-5, *[1e7] * 8]).tolist()}, "times as stiff one way as another"),
        (hand(9) | {"contact_stiffness": np.ones((9, 9)).tolist()}, "times as stiff one way as another"),
        ({"tasks": [[0, 0, 0, 0, 0, 0]]}, "none of them zero"),
        ({"tasks": []}, "tasks"),
        ({"tasks": [[1e9, 0, 0, 0, 0, 0]]}, "numbers up to 1e+06"),
    ],
)
def test_what_a_file_may_not_say_is_told_in_one_line(tmp_path, change, part):
    path = tmp_path / "contacts.json"
    path.write_text(json.dumps(PLAIN | change))
    with pytest.raises(FileFormatError) as told:
        read_contact_file(path)
    assert part in str(told.value)
    result = CliRunner().invoke(main, ["analyse", str(path)])
    assert result.exit_code == 2
    assert len(result.output.strip().splitlines()) <= 2


def test_a_stiffness_of_the_worst_condition_still_measures_the_same_in_other_units(tmp_path):
    # What the bound is for: of a spring 1e10 times as stiff one way the printed digits are those of a rigid one.
    stiff = read(tmp_path, PLAIN | hand(9) | {"contact_stiffness": [1e2, *[1e12] * 8]})
    rigid = read(tmp_path, PLAIN | hand(9) | {"contact_stiffness": [1e2, *[1e11] * 8]})
    one, other = ({each.name: each.value for each in measure_contacts(each, quick=True)} for each in (stiff, rigid))
    for name in ("softest shift", "stiffest shift", "softest turn", "centre of compliance"):
        assert one[name] == pytest.approx(other[name], rel=1e-3), name


def test_analyse_prints_mixed_contacts(tmp_path):
    path = tmp_path / "contacts.json"
    path.write_text(json.dumps(PLAIN | MIXED | hand(8) | {"wrench": [0, 0, -1, 0, 0, 0]}))
    result = CliRunner().invoke(main, ["analyse", str(path), "--all", "--json", "-"])
    assert result.exit_code == 0, result.output
    found = {entry["name"]: entry["value"] for entry in json.loads(result.stdout)["measures"]}
    assert {"PCR", "PGR", "softest shift", "least friction to spare", "task ε, pushes at the contacts"} <= set(found)
