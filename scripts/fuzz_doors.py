"""The doors that scripts/fuzz.py knocks at: everything by which something from outside gets into the package."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

import grasp_planner as gp
from grasp_planner.analysis import measure_contacts
from grasp_planner.batch import GraspCase, load_table, read_spec
from grasp_planner.batch.expand import CaseTable
from grasp_planner.batch.rows import add_failure, case_row
from grasp_planner.batch.run_files import RunInfo, run_info
from grasp_planner.batch.store import ResultStore
from grasp_planner.cli.batch import parse_rows
from grasp_planner.cli.synergies import read_postures
from grasp_planner.exceptions import GraspPlannerError
from grasp_planner.hand.urdf_file import read_urdf
from grasp_planner.model.task_direction import parse_task
from grasp_planner.objects import grid_cache, parse_object
from grasp_planner.objects.mesh_file import read_solid
from grasp_planner.records.contact_file import read_contact_file
from grasp_planner.synergies.space import load_synergies

ROOT = Path(__file__).parents[1]
CASES = 6
"""Cases of the run whose files are damaged."""


@dataclass(frozen=True)
class Door:
    """A way into the package.

    Attributes:
        name: Its name.
        good: Inputs that are good.
        prepare: Puts an input into a folder.
        enter: Gives what is in the folder to the package.
        rewritten: Whether a file of that name may change or go.
    """

    name: str
    good: tuple[bytes, ...]
    prepare: Callable[[bytes, Path], None]
    enter: Callable[[Path], Any]
    rewritten: Callable[[str], bool] = lambda name: False


def file_door(name: str, file: str, read: Callable[[Path], Any], *good: bytes) -> Door:
    """Return a door that reads one file."""
    return Door(name, good, lambda data, folder: _write(folder / file, data), lambda folder: read(folder / file))


def text_door(name: str, read: Callable[[str], Any], *good: bytes) -> Door:
    """Return a door that reads a text."""

    def enter(folder: Path) -> Any:
        return read((folder / "text").read_bytes().decode(errors="replace"))

    return Door(name, good, lambda data, folder: _write(folder / "text", data), enter)


def _write(path: Path, data: bytes) -> None:
    path.write_bytes(data)


SPEC = b"""seed: 1
defaults: {hand: dlr_hit_ii_right, object: "cylinder:radius=0.03", paper: true}
blocks:
  - product: {seed: {from: 0, to: 5}, friction: {uniform: [0.5, 0.9], count: 3}}
  - zip: {object.radius: [0.02, 0.03], task: ["force:+x", "torque:+z"]}
overrides: [{where: {seed: 3}, set: {n_synergies: 4}}]
"""
CONTACTS = b"""{"points": [[0.03, 0.0, 0.0], [-0.03, 0.01, 0.0], [-0.03, -0.01, 0.0]],
"normals": [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]], "friction": 0.8, "contact_model": "soft:torsion=0.003",
"forces": [[2.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]], "wrench": [0, 0, -1, 0, 0, 0]}
"""
HELD = b"""{"points": [[0.03, 0, 0], [-0.02, 0.02, 0], [-0.02, -0.02, 0.01]],
"normals": [[-1, 0, 0], [0.6, -0.8, 0], [0.6, 0.8, 0]], "friction": 0.7, "centre": [0, 0, 0.002],
"wrench": [0, 0, -1, 0, 0, 0],
"J": [[1, 0], [0, 0.5], [0, 0], [0.2, 1], [0, 0.1], [0.3, 0], [0, 0.4], [1, 0], [0.1, 0]], "S": [[1], [0.5]],
"contact_stiffness": 1000, "joint_stiffness": [5, 4], "synergy_stiffness": 2}
"""
LINKED = """<robot name="r"><link name="a"/><link name="b"><collision><geometry>
<mesh filename="link{suffix}"/></geometry></collision></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>"""


@cache
def meshes() -> dict[str, tuple[str, bytes]]:
    """Return a small mesh in every format that is read: suffix and bytes, by name."""
    box = trimesh.creation.box((0.05, 0.04, 0.03))
    forms = {"stl": ("stl", {}), "stl-ascii": ("stl_ascii", {}), "obj": ("obj", {}), "glb": ("glb", {})}
    forms |= {"ply": ("ply", {}), "ply-ascii": ("ply", {"encoding": "ascii"}), "dae": ("dae", {})}
    found = {}
    for name, (kind, options) in forms.items():
        data = box.export(file_type=kind, **options)
        found[name] = (f".{name.split('-')[0]}", data if isinstance(data, bytes) else data.encode())
    return found


def mesh_doors() -> list[Door]:
    """Return the doors of meshes, of objects and of links."""
    found = []
    for name, (suffix, data) in meshes().items():
        found.append(file_door(f"mesh {name}", f"input{suffix}", read_solid, data))

        def prepare(data: bytes, folder: Path, suffix: str = suffix) -> None:
            (folder / f"link{suffix}").write_bytes(data)
            (folder / "hand.urdf").write_text(LINKED.format(suffix=suffix), encoding="utf-8")

        found.append(Door(f"link {name}", (data,), prepare, lambda folder: read_urdf(folder / "hand.urdf")))
    return found


def hand_doors() -> list[Door]:
    """Return the doors of hands: URDF, description, synergies, postures."""
    place = ROOT / "urdf" / "tendon_hand"
    other = place.parent / "dlr_hit_ii"

    def prepare(name: str) -> Callable[[bytes, Path], None]:
        def put(data: bytes, folder: Path) -> None:
            shutil.copytree(place, folder, dirs_exist_ok=True)
            (folder / name).write_bytes(data)

        return put

    urdf, toml = "tendon_hand.urdf", "tendon_hand.toml"
    postures = b"j1,j2,j3\n0.1,0.2,0.3\n0.2,0.1,0.0\n0.5,0.2,0.1\n"
    tables = tuple(path.read_bytes() for path in sorted(other.rglob("*.csv"))[:3])
    return [
        Door("urdf", ((place / urdf).read_bytes(),), prepare(urdf), lambda folder: gp.load_hand(folder / urdf)),
        Door("urdf named", ((place / urdf).read_bytes(),), prepare(urdf), lambda folder: gp.load_hand(folder / toml)),
        Door("description", ((place / toml).read_bytes(),), prepare(toml), lambda folder: gp.load_hand(folder / toml)),
        file_door("synergies", "input.csv", load_synergies, *tables),
        file_door("postures", "input.csv", read_postures, postures),
    ]


def record_doors() -> list[Door]:
    """Return the doors of grasps, contacts and specifications, and of values on the command line."""
    stored = [path.read_bytes() for path in sorted((ROOT / "tests" / "data").glob("*.json"))]
    some = tuple(stored[:4])
    several = b"[" + stored[0] + b"," + stored[1] + b"]"

    def grasp(path: Path) -> Any:
        return gp.grasp_from_record(gp.read_grasp_record(path))

    def contacts(path: Path) -> Any:
        return measure_contacts(read_contact_file(path), quick=True)

    return [
        file_door("grasp", "input.json", grasp, *some),
        file_door("second grasp", "input.json", lambda path: grasp(path.with_name("input.json#2")), several),
        file_door("contacts", "input.json", contacts, CONTACTS, HELD),
        file_door("specification", "input.yaml", lambda path: CaseTable(read_spec(path))[0], SPEC),
        text_door("object", parse_object, *OBJECTS),
        text_door("task", parse_task, b"twist:+0.1,0.2,0.3,0,0,1*0.5", b"force:+x", b"torque:0,1,0*2"),
        text_door("rows", parse_rows, b"0,4,10-19,30"),
    ]


OBJECTS = (b"cylinder:radius=0.03,height=0.15,mass=0.2,edge=0.002", b"box:x=0.05,y=0.04,z=0.1", b"sphere:radius=0.03")


def row(number: int) -> dict[str, Any]:
    """Return a row of a run."""
    values = case_row(number, GraspCase(seed=number), "abc")
    add_failure(values, "error", "test", f"row {number}")
    return values


@cache
def run_template() -> tuple[Path, RunInfo]:
    """Return a run of two Parquet files and a journal, as a kill leaves it."""
    folder, info = Path(tempfile.mkdtemp(prefix="fuzz-run-")) / "run", run_info("abc", CASES, "module:function")
    store = ResultStore(folder, info)
    for first in (0, 2):
        store.append([row(first), row(first + 1)])
        store.fold()
    store.append([row(4)])
    store._journal.close()
    store.log.close()
    return folder, info


def run_doors() -> list[Door]:
    """Return the doors of the folder of a run: each of its files damaged, then read, then gone on with."""
    template, info = run_template()

    def enter(folder: Path) -> None:
        run = folder / "run"
        try:
            numbers = load_table(run)["row"].to_pylist()
            assert numbers == sorted(set(numbers)) and set(numbers) <= set(range(CASES)), "wrong rows are read"
            with ResultStore(run, info) as store:
                store.append([row(number) for number in range(CASES) if not store.done[number]])
        except GraspPlannerError:
            if (run / "run.json").read_bytes() == (template / "run.json").read_bytes():
                raise AssertionError("a run with a good description is refused") from None
            raise
        table = load_table(run)
        assert table["row"].to_pylist() == list(range(CASES)), "rows are lost"
        assert table["message"].to_pylist() == [f"row {number}" for number in range(CASES)], "rows are wrong"

    found = []
    for name in ("run.json", "results/part-000001.parquet", "journal-000003.jsonl", "parts.sha256"):

        def prepare(data: bytes, folder: Path, name: str = name) -> None:
            shutil.copytree(template, folder / "run")
            (folder / "run" / name).write_bytes(data)

        good = ((template / name).read_bytes(),)
        rewritten = {"journal-000003.jsonl", "parts.sha256", "workers.log", "run.lock"}
        found.append(Door(f"run {name}", good, prepare, enter, lambda file, may=rewritten: file in may))
    return found


def cache_door() -> Door:
    """Return the door of the cache: an entry damaged, then used."""
    solid = trimesh.creation.box((0.05, 0.04, 0.03))

    def build() -> Any:
        return grid_cache.cached_distance_grid(solid, 0.008)

    @cache
    def whole() -> tuple[str, bytes, Any]:
        grid = build()
        path = grid_cache.cache_folder() / f"{grid_cache._content_hash(solid, 0.008, np.inf)}.npz"
        return path.name, path.read_bytes(), grid

    def enter(folder: Path) -> None:
        name, _, grid = whole()
        (grid_cache.cache_folder() / name).write_bytes((folder / "entry").read_bytes())
        assert np.array_equal(build().coefficients, grid.coefficients), "another grid"

    return Door("cache", (whole()[1],), lambda data, folder: _write(folder / "entry", data), enter)


@cache
def doors() -> list[Door]:
    """Return every door."""
    from fuzz_cli import cli_doors
    from fuzz_viewer import viewer_doors

    found = [*record_doors(), *hand_doors(), *mesh_doors(), *run_doors(), cache_door()]
    return [*found, *cli_doors(), *viewer_doors()]
