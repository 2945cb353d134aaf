"""Small files that stand for large ones, devices and pipes are refused from their headers, before they are unpacked."""

import json
import os
import shutil
import struct
import warnings
import zipfile

import coal
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import trimesh

from grasp_planner.batch import ResultsError, arrow, journal
from grasp_planner.batch.arrow import read_part, schema_of, write_part
from grasp_planner.batch.run_files import file_sum, run_info
from grasp_planner.exceptions import FileFormatError
from grasp_planner.files import scenes
from grasp_planner.files.reading import hash_of_file
from grasp_planner.hand.source import file_hash
from grasp_planner.hand.urdf_checks import _solid_defects
from grasp_planner.objects import grid_cache, mesh_file
from grasp_planner.objects.mesh_file import read_solid

COLUMNS = {
    "row": "int64",
    "text": "string",
    "texts": "list<string>",
    "pairs": "list<struct<name: string, value: double>>",
    "numbers": "list<double>",
}
LONG = "x" * 500_000


def part_of(path, **values):
    """Write a Parquet file of 40 rows, each with the same values."""
    row = {"row": 1, "text": "a", "texts": ["a", None], "pairs": [{"name": "a", "value": 1.0}], "numbers": [1.0]}
    table = pa.Table.from_pylist([{**row, **values}] * 40, schema=schema_of(COLUMNS))
    write_part(table, path)
    return table


def test_what_is_small_reads_as_it_was_written(tmp_path):
    table = part_of(tmp_path / "part.parquet", text=None, pairs=[])
    assert read_part(tmp_path / "part.parquet", COLUMNS, list(COLUMNS), 40).equals(table)
    write_part(table.slice(0, 0), tmp_path / "empty.parquet")
    assert read_part(tmp_path / "empty.parquet", COLUMNS, ["text", "row"], 40).num_rows == 0


@pytest.mark.parametrize(
    "values",
    [
        {"text": LONG},
        {"texts": [LONG, "a"]},
        {"pairs": [{"name": LONG, "value": 1.0}]},
        {"numbers": [1.0] * 50_000},
        {"texts": [None] * 50_000},
    ],
    ids=["text", "texts", "pairs", "numbers", "nulls"],
)
def test_a_few_bytes_of_parquet_do_not_become_millions(tmp_path, monkeypatch, values):
    path = tmp_path / "part.parquet"
    part_of(path, **values)
    assert path.stat().st_size < 60_000
    monkeypatch.setattr(arrow, "MAX_PART_BYTES", 10_000_000)
    with pytest.raises(ResultsError, match="holds more than 40 rows or 10000000 bytes"):
        read_part(path, COLUMNS, list(COLUMNS), 40)
    assert read_part(path, COLUMNS, ["row"], 40).num_rows == 40, "other columns can be read"


def test_garbage_instead_of_pages_is_one_error(tmp_path):
    path = tmp_path / "part.parquet"
    part_of(path)
    meta, good = pq.read_metadata(path).row_group(0), path.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(50):
        data = bytearray(good)
        column = meta.column(int(rng.integers(meta.num_columns)))
        start = column.data_page_offset
        data[start : start + 20] = rng.bytes(20)
        path.write_bytes(data)
        with pytest.raises(ResultsError):
            read_part(path, COLUMNS, list(COLUMNS), 40)


def test_devices_pipes_and_large_files_have_no_checksum(tmp_path):
    pipe, large, link = tmp_path / "pipe", tmp_path / "large", tmp_path / "link"
    os.mkfifo(pipe)
    link.symlink_to("/dev/zero")
    with large.open("wb") as file:
        file.truncate(10**12)
    for path, reason in ((pipe, "is no file"), (link, "is no file"), (large, "larger than"), (tmp_path, "is no file")):
        assert file_hash(str(path)) == ""
        with pytest.raises(ResultsError, match=reason):
            file_sum(path)
        with pytest.raises(ResultsError, match=reason):
            read_part(path, COLUMNS, ["row"], 40)
        with pytest.raises(FileFormatError, match=reason):
            hash_of_file(path, 10)
    with pytest.raises(FileNotFoundError):
        file_sum(tmp_path / "none")
    assert file_hash("a\0b") == file_hash(str(tmp_path / "none")) == ""
    (tmp_path / "a").write_bytes(b"abc")
    assert file_hash(str(tmp_path / "a")) == file_sum(tmp_path / "a")


def test_a_journal_is_read_up_to_a_bound(tmp_path, monkeypatch):
    monkeypatch.setattr(journal, "MAX_JOURNAL_BYTES", 1000)
    path = tmp_path / "journal-000001.jsonl"
    path.write_bytes(b"x" * 99 + b"\n" + (b"y" * 99 + b"\n") * 10_000)
    lines = list(journal.journal_lines(path, run_info("abc", 3, "module:function")))
    assert len(lines) == 11 and not any(line.values or line.torn for line in lines)


def entry(path, shape, *, compression=zipfile.ZIP_STORED, numbers=8):
    """Write an entry of the cache whose largest array says a shape and holds some numbers."""
    with zipfile.ZipFile(path, "w", compression) as archive, archive.open("coefficients.npy", "w") as file:
        head = {"descr": "<f4", "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(file, head)
        file.write(bytes(4 * numbers))


def test_entries_of_the_cache_are_checked_by_their_headers(tmp_path, monkeypatch):
    path, loaded = tmp_path / "a.npz", []
    monkeypatch.setattr(grid_cache.np, "load", lambda *_, **__: loaded.append(1))
    large = 2 * grid_cache.MAX_NODES
    for options in (
        {"shape": (10**9,)},
        {"shape": (2, 2, 2), "numbers": 9},
        {"shape": (large,), "numbers": large, "compression": zipfile.ZIP_DEFLATED},
        {"shape": (2, 2, 2), "compression": zipfile.ZIP_DEFLATED},
    ):
        entry(path, **options)
        assert path.stat().st_size < 100_000 and grid_cache._sound(path) is None and not loaded
    path.unlink()
    os.mkfifo(path)
    assert grid_cache._sound(path) is None and not loaded


def scene(path, count):
    """Write a GLB file that uses one ball many times."""
    whole = trimesh.Scene()
    whole.add_geometry(trimesh.creation.icosphere(3, radius=0.01), geom_name="ball", node_name="n0")
    for number in range(1, count):
        shift = trimesh.transformations.translation_matrix([0.05 * number, 0.0, 0.0])
        whole.graph.update(frame_to=f"n{number}", geometry="ball", matrix=shift)
    path.write_bytes(whole.export(file_type="glb"))


def header_of(path, **changes):
    """Change the header of a GLB file."""
    data = path.read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    header = json.loads(data[20 : 20 + length])
    header |= {name: change(header) for name, change in changes.items()}
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + data[20 + length :]
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)


DEEP = [{"children": [k + 1, k + 1]} for k in range(40)] + [{"mesh": 0}]


@pytest.mark.parametrize(
    "changes",
    [
        {"nodes": lambda _: DEEP, "scenes": lambda _: [{"nodes": [0]}]},
        {"nodes": lambda _: [{"children": [0], "mesh": 0}], "scenes": lambda _: [{"nodes": [0]}]},
        {"accessors": lambda head: [{**entry, "count": 10**9} for entry in head["accessors"]]},
        {"accessors": lambda head: [{**entry, "count": -1} for entry in head["accessors"]]},
        {"bufferViews": lambda head: head["bufferViews"] * 10},
        {"meshes": lambda head: [{"primitives": head["meshes"][0]["primitives"] * 20_000}]},
        {"meshes": lambda _: 5},
    ],
    ids=["tree", "loop", "count", "negative", "views", "parts", "number"],
)
def test_scenes_are_not_unfolded_without_end(tmp_path, monkeypatch, changes):
    path = tmp_path / "a.glb"
    scene(path, 2)
    assert len(read_solid(path).mesh.faces) == 2560 and not _solid_defects("a", path)
    header_of(path, **changes)
    monkeypatch.setattr(trimesh, "load_mesh", None)
    monkeypatch.setattr(coal, "MeshLoader", None)
    with pytest.raises(FileFormatError, match=r"GLB mesh|too large together"):
        read_solid(path)
    assert "GLB mesh" in str(_solid_defects("a", path)) or "too large together" in str(_solid_defects("a", path))


def test_a_mesh_that_is_used_often_counts_each_time(tmp_path, monkeypatch):
    path = tmp_path / "a.glb"
    scene(path, 4)
    monkeypatch.setattr(mesh_file, "MAX_FACES", 4000)
    with pytest.raises(FileFormatError, match="5120 triangles, more than the 4000"):
        read_solid(path)
    dae = tmp_path / "a.dae"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # pycollada writes in a way that newer NumPy warns of
        dae.write_bytes(trimesh.creation.box((0.05, 0.04, 0.03)).export(file_type="dae"))
    assert len(read_solid(dae).mesh.faces) == 12
    text = dae.read_text()
    part = text[text.index("<instance_geometry") : text.index("</instance_geometry>") + len("</instance_geometry>")]
    monkeypatch.setattr(scenes, "MAX_GEOMETRY_BYTES", 100 * len(text))
    for many in (part * 200, "<instance_node url='#a'/>" * 20):
        dae.write_text(text.replace(part, many))
        with pytest.raises(FileFormatError, match=r"too large together|references to nodes"):
            read_solid(dae)
    shutil.copy(dae, tmp_path / "b.dae")
    assert "references to nodes" in str(_solid_defects("b", tmp_path / "b.dae"))
