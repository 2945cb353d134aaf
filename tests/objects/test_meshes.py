"""Meshes: the smooth signed distance against the exact one, its cache, and everything that is no solid."""

from __future__ import annotations

import os
import re
import struct
import threading
import time
import warnings

import coal
import numpy as np
import pytest
import trimesh

import grasp_planner as gp
from grasp_planner.objects import MeshWarning, grid_cache, mesh_file, mesh_solid
from grasp_planner.objects.moments import solid_moments
from grasp_planner.objects.sides import probed_sides
from grasp_planner.objects.simplify import simplified
from grasp_planner.objects.triangles import Triangles

from .helpers import central_differences, surface_points

NAMES = ("torus", "mug", "bracket")


@pytest.fixture(scope="module", params=NAMES)
def solid(request, mesh_texts):
    return gp.parse_object(mesh_texts[request.param])


def box(folder, name="box.stl", size=(0.05, 0.06, 0.07), change=None):
    """Write a box, changed first."""
    mesh = trimesh.creation.box(size)
    if change is not None:
        mesh = change(mesh) or mesh
    path = folder / name
    mesh.export(path)
    return path


def test_error_against_the_exact_distance(solid):
    """On the surface and where fingertip centres are, φ is within 0.3 mm, and the stated error is honest."""
    points = surface_points(solid, 3000, seed=5)
    lifted = points + np.random.default_rng(5).uniform(0.0, 0.012, (3000, 1)) * solid.sample(points).gradient
    for cloud in (points, lifted):
        error = np.abs(solid.sample(cloud).distance - Triangles.of(solid.mesh).signed_distance(cloud))
        assert error.max() < 3e-4
        assert np.median(error) < 2e-5
    assert 0.0 < solid.distance_error < 3e-4
    assert solid.grid_resolution <= 1e-3


def test_field_takes_points_of_any_arrangement(solid):
    """A block of points on and beyond the grid gives what its points give."""
    points = np.random.default_rng(3).uniform(-0.5, 0.5, (4, 5, 3))
    found, flat = solid.field(points), solid.sample(points.reshape(-1, 3))
    np.testing.assert_array_equal(found.distance, flat.distance.reshape(4, 5))
    np.testing.assert_array_equal(found.gradient, flat.gradient.reshape(4, 5, 3))
    np.testing.assert_array_equal(found.hessian, flat.hessian.reshape(4, 5, 3, 3))


def test_derivatives_agree_with_finite_differences(solid):
    """∇φ and ∇²φ belong to φ near the surface, far from it, and beyond the grid."""
    rng = np.random.default_rng(2)
    near = surface_points(solid, 12, seed=7)
    points = np.vstack([near, near + rng.normal(0.0, 0.01, near.shape), rng.uniform(-0.6, 0.6, (12, 3))])
    for point in points:
        sample = solid.sample(point[None])
        gradient = central_differences(lambda p: solid.sample(p[None]).distance[0], point, 1e-7)
        hessian = central_differences(lambda p: solid.sample(p[None]).gradient[0], point, 1e-7)
        np.testing.assert_allclose(sample.gradient[0], gradient, atol=1e-6)
        np.testing.assert_allclose(sample.hessian[0], hessian, atol=1e-3 * (1.0 + abs(hessian).max()))


def test_coal_geometry_is_the_mesh(solid):
    """Coal's distance from small balls outside agrees with the exact one."""
    points = np.random.default_rng(3).normal(0.0, 0.05, (30, 3))
    points = points[Triangles.of(solid.mesh).signed_distance(points) > 0.002]
    for point, exact in zip(points, Triangles.of(solid.mesh).signed_distance(points), strict=True):
        placement = coal.Transform3s(np.eye(3), point)
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        found = coal.distance(coal.Sphere(0.001), placement, solid.coal_geometry(), coal.Transform3s(), request, result)
        assert found + 0.001 == pytest.approx(exact, abs=1e-5)


def test_second_derivatives_are_continuous(solid):
    """The Hessian has no jumps on a line of small steps across the cells: φ is C²."""
    start, end = solid.half_extents * [-0.9, 0.3, 0.2], solid.half_extents * [1.1, 0.5, 0.4]
    line = start + np.linspace(0.0, 1.0, 20001)[:, None] * (end - start)
    hessian = solid.sample(line).hessian
    steps = np.abs(np.diff(hessian, axis=0)).max(axis=(1, 2))
    assert steps.max() < 0.02 * np.abs(hessian).max()


def test_sign_and_far_field(solid):
    """Deep inside φ < 0; beyond the grid it grows with the distance."""
    far = 3.0 * np.eye(3)
    np.testing.assert_allclose(solid.sample(far).distance, Triangles.of(solid.mesh).signed_distance(far), rtol=0.1)
    inside = surface_points(solid, 50) - 0.002 * solid.sample(surface_points(solid, 50)).gradient
    assert (solid.sample(inside).distance < 0.0).mean() > 0.95


def test_mass_properties(mesh_texts):
    """O is at the centre of mass; mass or density decide the inertia."""
    mug = gp.parse_object(mesh_texts["mug"])
    np.testing.assert_allclose(mug.mesh.center_mass, 0.0, atol=1e-9)
    assert mug.mass == pytest.approx(2000 * mug.mesh.volume)
    torus = gp.parse_object(mesh_texts["torus"])
    assert torus.mass == 0.15
    expected = 0.15 * (0.035**2 + 0.75 * 0.014**2)
    assert torus.inertia[2, 2] == pytest.approx(expected, rel=0.02)
    assert np.linalg.eigvalsh(torus.inertia).min() > 0.0


def test_a_centre_of_mass_may_be_given(tmp_path):
    """O is there, in the text too; it has to be within the box."""
    path = box(tmp_path, size=(0.04, 0.04, 0.1))
    heavy = gp.parse_object(f"mesh:{path},resolution=0.004,com=0.01,0,0.03,mass=0.5")
    np.testing.assert_allclose(heavy.file_origin, [-0.01, 0.0, -0.03])
    np.testing.assert_allclose(heavy.loaded.bounds, [[-0.03, -0.02, -0.08], [0.01, 0.02, 0.02]], atol=1e-9)
    assert heavy.mass == 0.5
    assert gp.parse_object(heavy.text) == heavy
    for wrong in ("0.1,0,0", "1,2", "a,0,0", "nan,0,0", "0.01"):
        with pytest.raises(gp.InvalidValueError):
            gp.parse_object(f"mesh:{path},resolution=0.004,com={wrong}")


def test_text_form_is_read_back(solid):
    again = gp.parse_object(solid.text)
    assert again.text == solid.text
    assert again.mass == pytest.approx(solid.mass)


def test_evaluation_is_fast(solid):
    """Five fingertips take well below a millisecond even on a busy machine (0.07 ms on a quiet one)."""
    points = surface_points(solid, 5)
    began = time.process_time()
    for _ in range(200):
        solid.sample(points)
    assert (time.process_time() - began) / 200 < 5e-4


def test_a_grid_that_is_too_coarse_is_refused(tmp_path, monkeypatch):
    """Unless its resolution was asked for."""
    path = box(tmp_path, size=(0.02, 0.02, 0.02))
    assert gp.MeshObject.load(path, resolution=0.01).distance_error > 5e-4
    monkeypatch.setattr(mesh_solid, "FINEST", 0.01)
    monkeypatch.setattr(mesh_solid, "COARSEST", 0.01)
    monkeypatch.setattr(mesh_solid, "TOLERANCE", 1.0)
    with pytest.raises(gp.FileFormatError, match=r"mm only, 0.5 mm are allowed; resolution=0.005 is finer"):
        gp.MeshObject.load(path)


def test_cache_is_used_and_not_trusted(tmp_path, monkeypatch):
    """The second time nothing is built; a damaged file is built anew; the content decides, not the name."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = box(tmp_path, size=(0.02, 0.02, 0.02))
    first = gp.MeshObject.load(path)
    (stored,) = grid_cache.cache_folder().iterdir()
    monkeypatch.setattr(grid_cache, "build_distance_grid", None)
    copy = tmp_path / "other.stl"
    copy.write_bytes(path.read_bytes())
    points = surface_points(first, 5)
    np.testing.assert_array_equal(gp.MeshObject.load(copy).sample(points).distance, first.sample(points).distance)
    monkeypatch.undo()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for damage in (b"", b"PK\x03\x04 not a zip", stored.read_bytes()[:2000]):
        stored.write_bytes(damage)
        with pytest.warns(grid_cache.CacheWarning, match="damaged; the distance grid is built anew"):
            assert gp.MeshObject.load(path).distance_error == first.distance_error
    data = bytearray(stored.read_bytes())
    data[len(data) // 2] ^= 4  # one bit of a number
    stored.write_bytes(data)
    with pytest.warns(grid_cache.CacheWarning):
        np.testing.assert_array_equal(gp.MeshObject.load(path).sample(points).distance, first.sample(points).distance)


def test_a_number_changed_within_a_sound_archive_is_noticed(tmp_path, monkeypatch):
    """The checksum is of the numbers, not only of the archive."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = box(tmp_path, size=(0.02, 0.02, 0.02))
    gp.MeshObject.load(path)
    (stored,) = grid_cache.cache_folder().iterdir()
    with np.load(stored) as data:
        arrays = dict(data)
    arrays["coefficients"] = arrays["coefficients"] * np.float32(1.001)
    np.savez(stored, **arrays)
    with pytest.warns(grid_cache.CacheWarning):
        gp.MeshObject.load(path)


def test_the_cache_keeps_within_its_size(tmp_path, monkeypatch):
    """What was not used for longest goes, the new entry stays, and what a kill left half goes after a day."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    sides = (0.020, 0.021, 0.022)
    paths = [box(tmp_path, f"{side}.stl", size=(side, side, side)) for side in sides]
    names = []
    for age, path in zip((300, 200), paths, strict=False):
        before = set(grid_cache.cache_folder().glob("*"))
        gp.MeshObject.load(path)
        (new,) = set(grid_cache.cache_folder().glob("*")) - before
        os.utime(new, (time.time() - age,) * 2)
        names.append(new)
    gp.MeshObject.load(paths[0])  # used again: now the second is the oldest
    half = grid_cache.cache_folder() / ".half.part"
    half.write_bytes(b"x")
    os.utime(half, (0, 0))
    monkeypatch.setattr(grid_cache, "MAX_CACHE_BYTES", int(2.5 * names[0].stat().st_size))
    gp.MeshObject.load(paths[2])
    left = set(grid_cache.cache_folder().iterdir())
    assert names[0] in left and names[1] not in left and half not in left and len(left) == 2
    monkeypatch.setattr(grid_cache, "MAX_CACHE_BYTES", 0)
    gp.MeshObject.load(paths[1])
    assert len(list(grid_cache.cache_folder().iterdir())) == 1


def test_two_writers_at_once_leave_one_sound_entry(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = box(tmp_path, size=(0.02, 0.02, 0.02))
    errors = []

    def load():
        try:
            gp.MeshObject.load(path)
        except Exception as error:
            errors.append(error)

    threads = [threading.Thread(target=load) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    assert len(list(grid_cache.cache_folder().iterdir())) == 1
    monkeypatch.setattr(grid_cache, "build_distance_grid", None)
    gp.MeshObject.load(path)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "glb", "dae"])
def test_formats(tmp_path, suffix):
    """Every format gives the same solid."""
    path = box(tmp_path, f"box.{suffix}", (0.02, 0.03, 0.04))
    solid = mesh_file.read_solid(path)
    assert solid.mesh.volume == pytest.approx(0.02 * 0.03 * 0.04, rel=1e-5)
    assert solid.repairs == ()


def drop_lid(mesh):
    mesh.update_faces(mesh.face_normals[:, 2] < 0.9)


def flatten(mesh):
    mesh.vertices[:, 2] *= 1e-14


def overlap(mesh):
    return trimesh.util.concatenate([mesh, mesh.copy().apply_translation([0.02, 0.01, 0.01])])


def surface_points_of(mesh, count):
    return np.asarray(trimesh.sample.sample_surface(mesh, count, seed=3)[0])


def invert(mesh):
    mesh.invert()


def join_at_an_edge(mesh):
    return trimesh.util.concatenate([mesh, mesh.copy().apply_translation([*mesh.extents[:2], 0.0])])


def flip_some(mesh):
    mesh.faces[::3] = mesh.faces[::3, ::-1]


def crack(mesh):
    corners = mesh.triangles.reshape(-1, 3) + np.random.default_rng(0).normal(0.0, 2e-8, (3 * len(mesh.faces), 3))
    return trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)


def drop_one(mesh):
    mesh = mesh.subdivide().subdivide()
    mesh.update_faces(np.arange(len(mesh.faces)) > 0)
    return mesh


def double(mesh):
    return trimesh.util.concatenate([mesh, mesh.copy()])


def touch(mesh):
    return trimesh.util.concatenate([mesh, mesh.copy().apply_translation([mesh.extents[0], 0.0, 0.0])])


def nest(mesh):
    return trimesh.util.concatenate([mesh, mesh.copy().apply_scale(0.5)])


def turn_one_part(mesh):
    other = mesh.copy().apply_translation([0.1, 0.0, 0.0])
    other.invert()
    return trimesh.util.concatenate([mesh, other])


def move_far(mesh):
    mesh.apply_translation([500.0, 0.0, 0.0])


VOLUME = 0.05 * 0.06 * 0.07
SOLIDS = [
    (invert, VOLUME, "inside out"),
    (flip_some, VOLUME, "turned 4 flipped triangles"),
    (crack, VOLUME, "welded"),
    (drop_one, VOLUME, "closed 1 hole"),
    (double, VOLUME, "twice"),
    (nest, VOLUME, "united"),
    (touch, 2 * VOLUME, "united|twice there|between parts"),
    (overlap, 2 * VOLUME - 0.03 * 0.05 * 0.06, "united"),
    (turn_one_part, 2 * VOLUME, "turned 1 part"),
    (join_at_an_edge, 2 * VOLUME, "2 separate parts"),
    (move_far, VOLUME, None),
]


@pytest.mark.parametrize(("change", "volume", "said"), SOLIDS, ids=[entry[0].__name__ for entry in SOLIDS])
def test_triangles_with_an_inside_are_a_solid(tmp_path, change, volume, said):
    """Whatever their topology: the volume is that of what they go around, and a line says what was done."""
    solid = mesh_file.read_solid(box(tmp_path, "odd.ply", change=change))
    assert solid_moments(solid.mesh, overlapping=solid.overlapping)[0] == pytest.approx(volume, rel=2e-3)
    assert probed_sides(solid.mesh).sound
    assert re.search(said, "; ".join(solid.repairs)) if said else solid.repairs == ()


def test_what_folds_over_itself_counts_once(tmp_path):
    """Two balls in one part that can't be split: volume, centre and inertia of the union by counting."""
    left, right = (trimesh.creation.icosphere(subdivisions=3, radius=0.02) for _ in range(2))
    right.apply_translation([0.02, 0.0, 0.0])
    union = trimesh.boolean.union([left, right])
    volume, centre, gyration = solid_moments(trimesh.util.concatenate([left, right]), overlapping=True)
    assert volume == pytest.approx(union.volume, rel=5e-3)
    np.testing.assert_allclose(centre, union.center_mass, atol=5e-5)
    np.testing.assert_allclose(gyration, union.moment_inertia / union.volume, atol=2e-6)


def test_holes_are_closed_or_walls_given_a_thickness_on_demand(tmp_path):
    """A box without lid: refused with the winding number, closed by repair, a tray by shell."""
    path = box(tmp_path, "open.ply", change=drop_lid)
    with pytest.raises(gp.FileFormatError, match=r"4 open edges.*winding number.*shell=0.002") as raised:
        gp.MeshObject.load(path)
    assert len(str(raised.value)) - len(str(path)) < 200
    with pytest.warns(MeshWarning, match="closed 1 hole"):
        mended = gp.MeshObject.load(path, repair=1, resolution=0.004)
    assert mended.loaded.volume == pytest.approx(VOLUME)
    with pytest.warns(MeshWarning, match="thickness"):
        tray = gp.MeshObject.load(path, shell=0.002, resolution=0.004)
    walls = 0.002 * (2 * (0.05 * 0.06 + 0.06 * 0.07 + 0.05 * 0.07) - 0.05 * 0.06)
    assert tray.loaded.volume == pytest.approx(walls, rel=0.05)
    for loaded in (mended, tray):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MeshWarning)
            assert gp.parse_object(loaded.text).repairs == loaded.repairs


def test_many_triangles_are_simplified_for_the_nodes_only():
    """A ball of 82,000 triangles: far fewer within the tolerance, for the grid alone."""
    ball = trimesh.creation.icosphere(subdivisions=6, radius=0.03)
    fewer = simplified(ball, 2e-5)
    assert len(fewer.faces) < len(ball.faces) / 2
    assert np.abs(Triangles.of(fewer).signed_distance(surface_points_of(ball, 500))).max() < 4e-5
    assert simplified(fewer, 1e-9) is fewer


def test_what_is_no_solid_is_refused(tmp_path, monkeypatch):
    """Empty, flat, cut off, foreign, too large: one line each."""
    cases = {
        "empty.stl": (b"", "is empty"),
        "header.stl": (b"\0" * 80 + struct.pack("<I", 4_000_000_000), "is not a valid STL mesh|no triangles"),
        "text.obj": (b"hello\n", "no triangles|not a valid OBJ"),
        "points.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangles|not a valid OBJ"),
        "nan.obj": (b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "line 1 says 'nan'"),
        "inf.obj": (b"v 0 0 0\nv 1 -inf 0\nv 0 1 0\nf 1 2 3\n", "line 2 says '-inf'"),
        "typo.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1,5 0\nf 1 2 3\n", "line 3 says '1,5'"),
        "bomb.dae": (b'<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "document type or entities"),
        "wide.dae": ('<?xml version="1.0"?><!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>'.encode("utf-16"), "UTF-8"),
        "cut.glb": (b"glTF\x02\0\0\0", "not a valid GLB"),
        "huge.ply": (
            b"ply\nformat binary_little_endian 1.0\nelement vertex 99999999999\nproperty float x\nend_header\n",
            "not a valid PLY|no triangles",
        ),
    }
    for name, (data, reason) in cases.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(gp.FileFormatError, match=reason):
            mesh_file.read_solid(tmp_path / name)
    with pytest.raises(gp.FileFormatError, match="encloses no volume"):
        mesh_file.read_solid(box(tmp_path, "flat.ply", change=flatten))
    with pytest.raises(gp.FileFormatError, match="No such file"):
        mesh_file.read_solid(tmp_path / "folder.stl")
    path = box(tmp_path)
    monkeypatch.setattr(mesh_file, "MAX_FACES", 5)
    with pytest.raises(gp.FileFormatError, match="12 triangles, more than the 5"):
        mesh_file.read_solid(path)
    monkeypatch.setattr(mesh_file, "MAX_MESH_BYTES", 50)
    with pytest.raises(gp.FileFormatError, match="larger than the 50 bytes"):
        mesh_file.read_solid(path)


def test_a_hollow_body_is_a_solid(tmp_path):
    """A cavity is no self-intersection."""
    hollow = trimesh.boolean.difference([trimesh.creation.box((0.05,) * 3), trimesh.creation.box((0.03,) * 3)])
    hollow.export(tmp_path / "hollow.ply")
    assert mesh_file.read_solid(tmp_path / "hollow.ply").repairs == ()


GUESSES = [
    (1000.0, "; in millimetres, scale=0.001 would fit"),
    (100.0, "; in inches, scale=0.0254 or in centimetres, scale=0.01 would fit"),
    (0.001, "; in metres, scale=1000 would fit"),
]


@pytest.mark.parametrize(("factor", "guess"), GUESSES)
def test_wrong_units_are_guessed(tmp_path, factor, guess):
    path = box(tmp_path, size=tuple(factor * np.array([0.05, 0.06, 0.08])))
    with pytest.warns(MeshWarning, match=guess):
        gp.MeshObject.load(path, resolution=0.004 * factor)
