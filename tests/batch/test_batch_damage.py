"""Damage of any kind to the folder of a run: what is left is right, the rest is planned again, nothing is deleted."""

import contextlib
import json
import shutil
import warnings

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from grasp_planner.batch import GraspCase, ResultsError, load_rows, load_table
from grasp_planner.batch.rows import add_failure, case_row
from grasp_planner.batch.run_files import DamagedRunWarning, part_files, read_run_info, run_info
from grasp_planner.batch.store import ResultStore

CASES = 12
INFO = run_info("abc", CASES, "module:function")


def row(number, spec_hash="abc"):
    values = case_row(number, GraspCase(seed=number), spec_hash)
    add_failure(values, "error", "test", f"row {number}")
    values["started_utc"] = "2000-01-01" * 20  # long enough that a byte somewhere in it is likely hit
    return values


@pytest.fixture(scope="module")
def template(tmp_path_factory):
    """Make a run of three Parquet files and a journal, as a kill leaves it."""
    folder = tmp_path_factory.mktemp("template") / "run"
    store = ResultStore(folder, INFO)
    for first in (0, 3, 6):
        store.append([row(number) for number in range(first, first + 3)])
        store.fold()
    store.append([row(9), row(10)])
    store._journal.close()
    store.log.close()
    return folder


def flip(rng, path):
    data = bytearray(path.read_bytes())
    for place in rng.integers(0, len(data), rng.integers(1, 4)):
        data[place] ^= int(rng.integers(1, 256))
    path.write_bytes(data)


def cut(rng, path):
    path.write_bytes(path.read_bytes()[: rng.integers(0, path.stat().st_size)])


def overwrite(rng, path):
    path.write_bytes(rng.bytes(int(rng.integers(0, 3000))))


def copy(rng, path):
    number = rng.integers(1, 9)
    name = path.name.replace("000001", f"00000{number}") if rng.random() < 0.5 else f"{path.stem} (copy){path.suffix}"
    shutil.copy(path, path.with_name(name))


def remove(rng, path):
    path.unlink()


def swap(rng, path):
    others = [
        other for other in path.parent.iterdir() if other.is_file() and other.name not in ("run.lock", "run.json")
    ]
    other = others[rng.integers(0, len(others))]
    data = other.read_bytes()
    other.write_bytes(path.read_bytes())
    path.write_bytes(data)


def change_rows(rng, path):
    """Write a file that is sound in itself, with rows that do not belong there, and let its checksum go."""
    if path.suffix != ".parquet":
        return
    (path.parents[1] / "parts.sha256").unlink(missing_ok=True)
    rows = pq.read_table(path).to_pylist()
    victim = rows[rng.integers(0, len(rows))]
    column, value = [
        ("row", -1),
        ("row", CASES),
        ("row", 2**62),
        ("row", None),
        ("row", 0),
        ("feasible", None),
        ("spec_hash", "xyz"),
        ("spec_hash", None),
    ][rng.integers(0, 8)]
    victim[column] = value
    pq.write_table(pa.Table.from_pylist(rows, schema=pq.read_schema(path)), path)


def change_columns(rng, path):
    if path.suffix != ".parquet":
        return
    (path.parents[1] / "parts.sha256").unlink(missing_ok=True)
    table = pq.read_table(path)
    name = ("row", "feasible", "seed", "record")[rng.integers(0, 4)]
    kind = rng.integers(0, 3)
    if kind == 0:
        table = table.drop_columns([name])
    elif kind == 1:
        table = table.set_column(0, "row", pa.array([str(k) for k in range(table.num_rows)]))
    else:
        table = table.append_column(name, table[name])
    pq.write_table(table, path)


DAMAGES = (flip, cut, overwrite, copy, remove, swap, change_rows, change_columns)


def data_files(folder):
    return [*part_files(folder), *folder.glob("journal-*"), *folder.glob("parts.sha256")]


def finish(folder):
    """Go on with the run, planning what has no row, and return how many rows were there."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DamagedRunWarning)
        with ResultStore(folder, INFO) as store:
            left = [number for number in range(CASES) if not store.done[number]]
            assert store.finished == CASES - len(left) and set(store.done) <= {0, 1}
            store.append([row(number) for number in left])
    return CASES - len(left)


def check_readers(folder):
    """Check that reading a damaged run gives rows of it, and right ones, or one error."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DamagedRunWarning)
        table = load_table(folder)
        numbers = table["row"].to_pylist()
        assert numbers == sorted(set(numbers)) and set(numbers) <= set(range(CASES))
        assert table["message"].to_pylist() == [f"row {number}" for number in numbers]
        with pytest.raises((ResultsError, ValueError)):
            load_rows(folder, [0, CASES - 1])  # these rows have no grasp


@pytest.mark.parametrize("seed", range(60))
def test_random_damage_loses_no_case_and_doubles_none(template, tmp_path, seed):
    rng = np.random.default_rng(seed)
    folder = tmp_path / "run"
    shutil.copytree(template, folder)
    for _ in range(rng.integers(1, 4)):
        files = data_files(folder)
        with contextlib.suppress(pa.ArrowException, IndexError, OSError):  # damaged too much already
            DAMAGES[rng.integers(0, len(DAMAGES))](rng, files[rng.integers(0, max(len(files), 1))])
    check_readers(folder)
    held = {path.name: path.read_bytes() for path in data_files(folder) if path.suffix == ".parquet"}
    finish(folder)
    raw = pa.concat_tables([pq.read_table(path) for path in (folder / "results").iterdir()])
    assert sorted(raw["row"].to_pylist()) == list(range(CASES)), "every case exactly once, for any reader"
    assert sorted(raw["message"].to_pylist()) == sorted(f"row {number}" for number in range(CASES))
    assert finish(folder) == CASES, "and then nothing is left to do"
    kept = {path.read_bytes() for place in ("results", "set-aside") for path in (folder / place).glob("*")}
    assert set(held.values()) <= kept, "nothing was deleted"


def test_a_copied_part_changes_nothing(template, tmp_path):
    shutil.copytree(template, tmp_path / "run")
    results = tmp_path / "run" / "results"
    shutil.copy(results / "part-000001.parquet", results / "part-000009.parquet")
    with pytest.warns(DamagedRunWarning, match=r"part-000009.parquet: left out: row 0 stands there already"):
        assert load_table(tmp_path / "run")["row"].to_pylist() == list(range(11))
    assert finish(tmp_path / "run") == 11
    assert [path.name for path in (tmp_path / "run" / "set-aside").iterdir()] == ["part-000009.parquet"]


def test_what_is_good_in_a_bad_file_stays(template, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(template, folder)
    path = folder / "results" / "part-000002.parquet"
    (folder / "parts.sha256").unlink()
    table = pq.read_table(path)
    rows = table.to_pylist()
    rows[1]["row"] = 99
    pq.write_table(pa.Table.from_pylist(rows, schema=table.schema), path)
    assert finish(folder) == 10
    assert sorted(pq.read_table(path)["row"].to_pylist()) == [3, 5]


BAD_INFO = {
    "cases": [0, -1, True, "12", 10**12, None, 1.5],
    "columns": [{}, [], None, {"row": "int64"}, {"row": "double", "feasible": "bool"}, {**INFO.columns, "a": "object"}],
    "spec_hash": [None, 3],
    "planner": [[]],
    "spec": [{}],
    "format": [2, None, "1" * 5000],
}


@pytest.mark.parametrize(("field", "value"), [(field, value) for field, values in BAD_INFO.items() for value in values])
def test_a_damaged_description_of_the_run_is_one_error(template, tmp_path, field, value):
    shutil.copytree(template, tmp_path / "run")
    path = tmp_path / "run" / "run.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), field: value}))
    with pytest.raises(ResultsError) as caught:
        read_run_info(tmp_path / "run")
    assert field in str(caught.value) and len(str(caught.value)) < 1000


@pytest.mark.parametrize("text", ["", "[", "[]", "null", "1", '"a"', "[" * 100_000, "{}", '{"format": 1}', "\ufeff{}"])
def test_a_description_that_is_none_is_one_error(template, tmp_path, text):
    shutil.copytree(template, tmp_path / "run")
    (tmp_path / "run" / "run.json").write_text(text)
    with pytest.raises(ResultsError):
        load_table(tmp_path / "run")


def test_without_its_description_a_run_keeps_its_rows(template, tmp_path):
    shutil.copytree(template, tmp_path / "run")
    (tmp_path / "run" / "run.json").unlink()
    assert finish(tmp_path / "run") == 11


def test_a_file_of_another_run_is_set_aside(template, tmp_path):
    other = run_info("xyz", CASES, "module:function")
    with ResultStore(tmp_path / "other", other) as store:
        store.append([row(11, "xyz")])
    shutil.copytree(template, tmp_path / "run")
    shutil.copy(part_files(tmp_path / "other")[0], tmp_path / "run" / "results" / "part-000007.parquet")
    with pytest.warns(DamagedRunWarning, match="row 11 is of another run"):
        assert load_table(tmp_path / "run")["row"].to_pylist() == list(range(11))
    assert finish(tmp_path / "run") == 11
