"""What a mesh is told to be, beside its triangles: axes, units, limits of force, zones that may be touched."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from trimesh.exchange.dae import export_collada

import grasp_planner as gp
from grasp_planner.objects.zone import Zone

from .helpers import central_differences

COARSE = "resolution=0.004"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    found = tmp_path_factory.mktemp("text") / "a bar, long.stl"
    trimesh.creation.box((0.02, 0.03, 0.1)).apply_translation([0.0, 0.0, 0.05]).export(found)
    trimesh.creation.cylinder(0.028, 0.12, sections=48).apply_translation([0.0, 0.0, 0.06]).export(
        found.parent / "bar.stl"
    )
    return found


def test_everything_is_read_back(path):
    """Names of files with commas, lists of numbers, hyphens of keys."""
    soft = "max_pressure=20000,modulus=150000,curvature_radius=0.04"
    zones = "region=box,-1,-1,-1,1,1,1,forbid=sphere,0,0,0,0.01,com=0.001,-0.06,0"
    told = f"up=y,max-normal=5,{soft.replace('_p', '-p')},{zones}"
    thing = gp.parse_object(f"mesh:{path},{COARSE},{told},mass=0.3")
    assert thing.text.endswith(f"max_normal=5,{soft},{zones}")
    assert gp.parse_object(thing.text) == thing
    assert thing != gp.parse_object(f"mesh:{path},{COARSE},mass=0.3")


@pytest.mark.parametrize(
    "wrong",
    [
        "region=handle",
        "up=w",
        "max_normal=0",
        "max_normal=nan",
        "max_pressure=1e4",
        "modulus=1e5",
        "curvature_radius=0.01",
        "max_pressure=0,modulus=1e5",
        "modulus=nan,max_pressure=1e4",
        "curvature_radius=0,max_pressure=1e4,modulus=1e5",
        "region=cone,0,0,0",
        "region=box,0,0,0,1,1",
        "region=box,0,0,0,1,-1,1",
        "forbid=sphere,0,0,0,0",
        "forbid=sphere,0,0,0,a",
        "region=sphere,0,0,nan,1",
        "region=",
        "mass=1,junk",
    ],
)
def test_what_is_no_value_is_one_line(path, wrong):
    """It names the key."""
    with pytest.raises(gp.GraspPlannerError, match=wrong.partition("=")[0]) as raised:
        gp.parse_object(f"mesh:{path},{COARSE},{wrong}")
    assert len(str(raised.value)) < 200


@pytest.mark.parametrize(("up", "size"), [("x", (0.03, 0.1, 0.02)), ("y", (0.02, 0.1, 0.03)), ("z", (0.02, 0.03, 0.1))])
def test_another_axis_may_be_up(path, up, size):
    """It becomes z; nothing is mirrored."""
    thing = gp.MeshObject.load(path, up=up, resolution=0.004)
    np.testing.assert_allclose(2 * thing.half_extents, size, atol=1e-9)
    assert thing.loaded.volume == pytest.approx(0.02 * 0.03 * 0.1)
    was_low = {"x": [0.0, -0.05, 0.0], "y": [0.0, 0.05, 0.0], "z": [0.0, 0.0, -0.05]}[up]
    np.testing.assert_allclose(thing.file_origin, was_low, atol=1e-9)


@pytest.mark.parametrize("unit", ['name="inch" meter="0.0254"', "meter='0.0254'"])
def test_a_declared_unit_is_used(tmp_path, unit):
    """Of COLLADA; a scale that is given takes its place."""
    box = trimesh.creation.box((1.0, 2.0, 4.0)).export(file_type="dae")
    (tmp_path / "inch.dae").write_bytes(box.replace(b"<up_axis>", f"<unit {unit}/><up_axis>".encode()))
    thing = gp.MeshObject.load(tmp_path / "inch.dae", resolution=0.004)
    np.testing.assert_allclose(2 * thing.half_extents, [0.0254, 0.0508, 0.1016])
    assert gp.parse_object(thing.text) == thing
    assert 2 * gp.MeshObject.load(tmp_path / "inch.dae", scale=0.01, resolution=0.004).half_extents[2] == 0.04


def test_what_is_soft_limits_the_force_of_a_contact(path):
    """The smaller limit counts."""
    hand = gp.load_hand("dlr_hit_ii_right")
    cup = gp.MeshObject.load(path, resolution=0.004, max_normal=2.0)
    assert gp.GraspProblem(hand, cup).max_normal_force == 2.0
    assert gp.GraspProblem(hand, cup, loads=gp.LoadCases(max_normal_force=1.0)).max_normal_force == 1.0
    hard = gp.GraspProblem(hand, gp.MeshObject.load(path, resolution=0.004))
    assert hard.max_normal_force == hand.max_normal_force


@pytest.mark.parametrize("text", ["box,-0.02,-0.01,0,0.03,0.01,0.05", "sphere,0.01,0,0.02,0.03"])
@pytest.mark.parametrize("allowed", [True, False])
def test_margins_of_zones(text, allowed):
    """Positive on the right side, zero on the border, slopes by differences."""
    zone, rng = Zone.parse(text, allowed), np.random.default_rng(0)
    points = rng.uniform([-0.04, -0.03, -0.02], [0.05, 0.03, 0.07], (200, 3))
    margins, slopes = zone.margins(points)
    numbers = zone.numbers
    if zone.shape == "box":
        inside = ((points > numbers[:3]) & (points < numbers[3:])).all(axis=1)
        nearest = np.clip(points, numbers[:3], numbers[3:])
        distance = np.linalg.norm(points - nearest, axis=1)
    else:
        distance = np.linalg.norm(points - numbers[:3], axis=1) - numbers[3]
        inside = distance < 0.0
    assert 5 < inside.sum() < 195
    assert ((margins >= 0.0).all(axis=1) == (inside == allowed)).all()
    if not allowed:
        np.testing.assert_allclose(margins[~inside, 0], distance[~inside], atol=1e-12)
    expected = [central_differences(lambda p: zone.margins(p[None])[0][0], point, 1e-7) for point in points]
    np.testing.assert_allclose(slopes, expected, atol=1e-6)


def test_zones_follow_file_and_size(path):
    """They are given in the frame of the file, and grow with the object."""
    thing = gp.MeshObject.load(path, region="box,-1,-1,0.06,1,1,1", resolution=0.004, size=2.0)
    points = np.array([[0.0, 0.0, 0.021], [0.0, 0.0, 0.019]])  # the middle is at 0.05 of the file
    margins, slopes = thing.region(points)
    np.testing.assert_allclose(margins.min(axis=1), [0.001, -0.001], atol=1e-8)
    assert slopes.shape == (2, 6, 3)
    points, across = thing.opposed_patches()
    assert len(points) > 20 and len(across) == len(points)
    assert (points[:, 2] >= 0.02).all()


@pytest.mark.parametrize("zones", [{"region": "box,-1,-1,0.05,1,1,1"}, {"forbid": "sphere,0,0,0.02,0.045"}])
def test_a_plan_keeps_to_its_zones(path, zones):
    """Contacts of the exact surface are where they may be; shifted out by the zone's size, the same grasp is none."""
    thing = gp.MeshObject.load(path.with_name("bar.stl"), resolution=0.002, mass=0.1, **zones)
    problem = gp.GraspProblem(gp.load_hand("dlr_hit_ii_right"), thing)
    grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(starts=20, enough=1))
    assert grasp.feasible, grasp.verdict
    points = grasp.surface_contacts.points - thing.file_origin
    if "region" in zones:
        assert points[:, 2].min() > 0.05 - 1e-4
        other = gp.MeshObject.load(path.with_name("bar.stl"), resolution=0.002, mass=0.1, forbid="box,-1,-1,0.05,1,1,1")
    else:
        assert np.linalg.norm(points - [0.0, 0.0, 0.02], axis=1).min() > 0.045 - 1e-4
        other = gp.MeshObject.load(
            path.with_name("bar.stl"), resolution=0.002, mass=0.1, region="sphere,0,0,0.02,0.045"
        )
    judged = replace(grasp, problem=replace(problem, grasp_object=other))
    assert judged.violations["region"].value > 1e-3 and not judged.feasible


@pytest.fixture(scope="module")
def hammer(tmp_path_factory):
    """A head of 40 x 30 x 30 mm that a handle of 20 x 20 x 100 mm ends in the middle of."""
    found = tmp_path_factory.mktemp("parts") / "hammer.obj"
    head = trimesh.creation.box((0.04, 0.03, 0.03)).apply_translation([0.0, 0.0, 0.1])
    handle = trimesh.creation.box((0.02, 0.02, 0.1)).apply_translation([0.0, 0.0, 0.05])
    trimesh.util.concatenate([head, handle]).export(found)
    return found


@pytest.mark.filterwarnings("ignore::grasp_planner.objects.MeshWarning")
def test_parts_may_have_densities(hammer):
    """Mass, centre and inertia are sums; where parts overlap, the first counts; the text has it all."""
    thing = gp.parse_object(f"mesh:{hammer},{COARSE},densities=8000,500")
    head, handle = 8000 * 0.04 * 0.03 * 0.03, 500 * 0.02 * 0.02 * 0.085
    assert thing.mass == pytest.approx(head + handle)
    centre = (head * 0.1 + handle * 0.0425) / (head + handle)
    np.testing.assert_allclose(thing.file_origin, [0.0, 0.0, -centre], atol=1e-9)
    spin = head * (0.1 - centre) ** 2 + handle * (0.0425 - centre) ** 2
    spin += head * (0.03**2 + 0.03**2) / 12 + handle * (0.02**2 + 0.085**2) / 12
    assert thing.inertia[0, 0] == pytest.approx(spin)
    assert gp.parse_object(thing.text) == thing
    assert gp.parse_object(f"mesh:{hammer},{COARSE},densities=8000,500,size=2").mass == pytest.approx(8 * thing.mass)
    np.testing.assert_allclose(
        gp.parse_object(f"mesh:{hammer},{COARSE},densities=8,0.5,mass=1").inertia * thing.mass, thing.inertia
    )
    for wrong in (
        "densities=8000",
        "densities=8000,-1",
        "densities=8000,500,com=0,0,0.05",
        "densities=8000,500,density=1",
    ):
        with pytest.raises(gp.InvalidValueError):
            gp.parse_object(f"mesh:{hammer},{COARSE},{wrong}")


@pytest.mark.filterwarnings("ignore::grasp_planner.objects.MeshWarning")
@pytest.mark.parametrize("suffix", ["obj", "glb", "dae"])
def test_a_zone_may_be_a_named_part(tmp_path, suffix):
    """The box around it and a millimetre: of groups and materials of OBJ, of nodes of scenes; turned with the axes."""
    head = trimesh.creation.box((0.04, 0.03, 0.03)).apply_translation([0.0, 0.0, 0.115])
    handle = trimesh.creation.box((0.02, 0.02, 0.1)).apply_translation([0.0, 0.0, 0.05])
    file = tmp_path / f"hammer.{suffix}"
    if suffix == "obj":
        one, two = (part.export(file_type="obj", include_normals=False) for part in (head, handle))
        faces = [line for line in two.splitlines() if line.startswith("f ")]
        moved = ["f " + " ".join(str(int(each) - 9) for each in line.split()[1:]) for line in faces]  # from the end
        rest = [line for line in two.splitlines() if not line.startswith("f ")]
        file.write_text("\n".join(["o tool", "g head", one, *rest, "g handle", "usemtl wood", *moved]))
        names = ("handle", "wood")
    elif suffix == "dae":
        scene = export_collada([head, handle])
        ids = re.findall(rb'<geometry id="(\w+)"', scene)
        file.write_bytes(scene.replace(ids[1], b"handle"))
        names = ("handle",)
    else:
        trimesh.Scene({"head": head, "handle": handle}).export(file)
        names = ("handle",)
    for name in names:
        thing = gp.MeshObject.load(file, forbid=name, up="y", resolution=0.004)
        (zone,) = thing.zones
        np.testing.assert_allclose(zone.numbers, [-0.011, -0.101, -0.011, 0.011, 0.001, 0.011], atol=1e-6)
        assert gp.parse_object(thing.text) == thing and f"forbid={name}" in thing.text
    with pytest.raises(gp.NameNotFoundError, match="handle"):
        gp.MeshObject.load(file, forbid="handl", resolution=0.004)
