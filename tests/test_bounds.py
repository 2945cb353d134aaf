"""Budgets and bounds: what is endless, huge or not physical is refused where it enters."""

import dataclasses
import os
import threading

import numpy as np
import pytest

import grasp_planner as gp
from grasp_planner.analysis.off_plan import Errors
from grasp_planner.batch import ResultsError, SpecError, parse_spec, read_spec
from grasp_planner.batch.expand import CaseTable
from grasp_planner.cli.batch import parse_rows
from grasp_planner.cli.options import parse_counts
from grasp_planner.exceptions import FileFormatError, InvalidValueError
from grasp_planner.files.reading import opened_file, read_bounded
from grasp_planner.objects import parse_object
from grasp_planner.objects.mesh_file import read_solid
from grasp_planner.simulate.protocol import PLAN
from grasp_planner.terms.costs import TaskIndex
from grasp_planner.terms.objective import Objective

BOMB = "a0: &a0 [x,x,x,x,x,x,x,x,x]\n" + "".join(f"a{k}: &a{k} [{','.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 9))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (BOMB, "more than 1000000 entries"),
        ("a: &a [*a]", "alias within its own anchor"),
        ("[" * 5000, "nested too deeply|not valid YAML"),
        ("blocks: !!int ''", "not valid YAML"),
        ("blocks: !!bool maybe", "not valid YAML"),
        ("blocks: !!timestamp soon", "not valid YAML"),
        ("a: \x01", "not valid YAML"),
        ("? [a, b]\n: 1\n", "a text as a key"),
    ],
)
def test_yaml_that_is_too_much_or_none_is_one_error(tmp_path, text, reason):
    path = tmp_path / "spec.yaml"
    path.write_text(text)
    with pytest.raises((ResultsError, SpecError), match=reason):
        read_spec(path)


@pytest.mark.parametrize(
    "axis",
    [
        {"from": 0, "to": 999_999_999_999},
        {"from": 0.0, "to": 1.0, "step": 1e-300},
        {"from": -1e308, "to": 1e308, "step": 1e300},
        {"from": 0, "to": 10**400},
        {"integers": [0, 10**20], "count": 2},
        {"uniform": [0.0, 1.0], "count": 10**9},
        {"uniform": [1.0, 0.0], "count": 2},
        {"uniform": [-1e308, 1e308], "count": 2},
    ],
)
def test_axes_have_a_budget(axis):
    with pytest.raises(SpecError):
        CaseTable(parse_spec({"blocks": [{"product": {"seed": axis}}]}))


def test_products_have_a_budget():
    axis = {"from": 0.1, "to": 0.5, "count": 1000}
    product = {"friction": axis, "object.radius": {"from": 0.02, "to": 0.04, "count": 1000}, "seed": list(range(100))}
    with pytest.raises(SpecError, match="at most 10000000 cases"):
        CaseTable(parse_spec({"blocks": [{"product": product}]}))


@pytest.mark.parametrize("text", ["0-99999999999", "0-9999999", "²", "1-", "-", "", "9" * 5000])
def test_lists_of_rows_have_a_budget(text):
    with pytest.raises(InvalidValueError):
        parse_rows(text)
    with pytest.raises(InvalidValueError):
        parse_counts("--synergies", text)


def test_what_has_no_size_is_read_up_to_its_bound(tmp_path):
    for device in ("/dev/zero", "/dev/urandom"):
        with pytest.raises(FileFormatError, match="larger than the 1000 bytes"):
            read_bounded(tmp_path / device, 1000)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert read_bounded(pipe, 10) == b"", "nobody writes"
    reading, writing = os.pipe()
    writer = threading.Thread(target=lambda: (os.write(writing, b"abc"), os.close(writing)))
    writer.start()
    assert read_bounded(tmp_path / f"/dev/fd/{reading}", 10) == b"abc"
    writer.join()
    os.close(reading)
    for bad, reason in (
        (tmp_path, "is no file but a folder"),
        (tmp_path / "none", "No such"),
        (tmp_path / "\0", "no name"),
    ):
        with pytest.raises(FileFormatError, match=reason):
            read_bounded(bad, 10)
    for bad in (tmp_path, pipe, tmp_path / "/dev/zero"):
        with pytest.raises(FileFormatError, match="is no file but"), opened_file(bad, 10):
            pass
    (tmp_path / "large").write_bytes(b"x" * 11)
    with pytest.raises(FileFormatError, match="larger than the 10 bytes"), opened_file(tmp_path / "large", 10):
        pass


@pytest.mark.parametrize(
    "text",
    [
        "cylinder:radius=1e308",
        "sphere:radius=1e-300",
        "sphere:mass=1e300",
        "box:x=2000",
        "cylinder:mass=1e-300",
        "cone:caps=1e200",
    ],
)
def test_objects_have_physical_sizes(text):
    with pytest.raises(gp.GraspPlannerError):
        parse_object(text)


@pytest.mark.parametrize(
    "make",
    [
        lambda: gp.force_task((0, 1, 0), 1e308),
        lambda: gp.GraspParameters(gravity=(0.0, 0.0, 1e308)),
        lambda: gp.GraspParameters(contact_stiffness=1e308),
        lambda: gp.GraspParameters(friction=1e308),
        lambda: gp.LoadCases(force=1e308),
    ],
)
def test_parameters_have_physical_bounds(make):
    with pytest.raises(InvalidValueError):
        make()


def test_tasks_have_a_budget():
    with pytest.raises(InvalidValueError, match="tasks"):
        gp.GraspProblem(gp.load_hand("dlr_hit_ii_right"), gp.Cylinder(), tasks=[gp.force_task((0, 1, 0))] * 65)


def tetrahedron(scale, last=3):
    points = scale * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, last]]
    lines = ["ply", "format ascii 1.0", "element vertex 4", *(f"property float {axis}" for axis in "xyz")]
    lines += ["element face 4", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(map(repr, map(float, point))) for point in points]
    lines += [f"3 {a} {b} {c}" for a, b, c in faces]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(("scale", "last", "reason"), [(1.0, 9, "names a vertex"), (1e20, 3, "coordinates larger")])
def test_meshes_that_are_none_are_refused(tmp_path, scale, last, reason):
    path = tmp_path / "a.ply"
    path.write_text(tetrahedron(scale, last))
    with pytest.raises(FileFormatError, match=reason):
        read_solid(path)


@pytest.mark.parametrize("scale", ["1e300", "1e5", "1e-9"])
def test_a_scale_makes_no_planet_and_no_atom(tmp_path, monkeypatch, scale):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.ply").write_text(tetrahedron(1.0))
    with pytest.raises(gp.GraspPlannerError, match="scale"):
        parse_object(f"mesh:a.ply,scale={scale}")


SETTINGS = (
    *(gp.GraspParameters(), gp.LoadCases(), gp.ClearanceOptions(), gp.PlannerOptions(), PLAN, Errors()),
    *(gp.Cylinder(), gp.Sphere(), gp.Box(), gp.Capsule(), gp.EllipsoidObject()),
    *(gp.force_task((0, 1, 0)), gp.parse_task("twist:+x")),
)
NOT_PHYSICAL = (1e308, -1e308, float("nan"), float("inf"), 10**400, "a", None, [1.0, [2.0]])


@pytest.mark.parametrize("settings", SETTINGS, ids=lambda value: type(value).__name__)
def test_no_field_takes_what_is_not_physical(settings):
    for field in dataclasses.fields(settings):
        old = getattr(settings, field.name)
        size = 0 if isinstance(old, str) or not hasattr(old, "__len__") else len(old)
        for bad in (*NOT_PHYSICAL, *([(value,) * size for value in NOT_PHYSICAL[:5]] if size else [])):
            if (bad is None or isinstance(bad, str)) and not isinstance(old, float):
                continue  # names and choices have tests of their own
            try:
                new = dataclasses.replace(settings, **{field.name: bad})
            except gp.GraspPlannerError:
                continue
            left_out = bad is None and "None" in str(field.type)
            assert left_out or repr(getattr(new, field.name)) == repr(old), (field.name, bad)


def test_an_objective_next_to_zero_is_scaled_as_far_as_weights_go():
    for weight in (1.0, 1e8):
        scaled = Objective((TaskIndex().weighted(weight),)).scaled(1e17)
        assert 1e8 <= scaled.terms[0].weight <= 1e9
    assert Objective((TaskIndex().weighted(2.0),)).scaled(3.0).terms[0].weight == 6.0
