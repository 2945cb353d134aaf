"""Results on disk: nothing is lost or doubled, whatever happens between two writes."""

import errno
import json
import os
import warnings

import duckdb
import pandas as pd
import polars as pl
import pytest

from grasp_planner.batch import GraspCase, ResultsError, find_rows, load_table
from grasp_planner.batch import store as store_module
from grasp_planner.batch.rows import add_failure, case_row, columns
from grasp_planner.batch.run_files import DamagedRunWarning, part_files, run_info
from grasp_planner.batch.store import ResultStore
from grasp_planner.files import writing

INFO = run_info("abc", 10, "module:function")


def row(number):
    values = case_row(number, GraspCase(seed=number), "abc")
    add_failure(values, "error", "test", f"row {number}")
    return values


def rows_of(folder):
    return load_table(folder, ["row"])["row"].to_pylist()


def test_rows_are_there_before_and_after_the_journal_becomes_a_part(tmp_path):
    with ResultStore(tmp_path, INFO) as store:
        store.append([row(2), row(0)])
        assert rows_of(tmp_path) == [0, 2] and not part_files(tmp_path)
        store.fold()
        assert rows_of(tmp_path) == [0, 2] and len(part_files(tmp_path)) == 1
        store.append([row(1)])
        assert rows_of(tmp_path) == [0, 1, 2]
    assert len(part_files(tmp_path)) == 2 and not list(tmp_path.glob("journal-*"))
    with ResultStore(tmp_path, INFO) as again:
        assert again.finished == 3 and list(again.done[:4]) == [1, 1, 1, 0]


def test_a_row_is_written_once(tmp_path):
    with ResultStore(tmp_path, INFO) as store:
        store.append([row(1)])
        store.append([row(1)])
    assert rows_of(tmp_path) == [1]


def test_journal_becomes_a_part_when_it_is_long(tmp_path, monkeypatch):
    monkeypatch.setattr(store_module, "PART_ROWS", 3)
    with ResultStore(tmp_path, INFO) as store:
        for number in range(7):
            store.append([row(number)])
        assert [pl.read_parquet(path).height for path in part_files(tmp_path)] == [3, 3]
    assert rows_of(tmp_path) == list(range(7))


@pytest.mark.parametrize("torn", [b'{"row": 3, "status": "fea', b"\n", b"\x00\x00\x00", b"[1]\n"])
def test_a_line_cut_off_by_a_kill_is_left_out(tmp_path, torn):
    store = ResultStore(tmp_path, INFO)
    store.append([row(0), row(1)])
    os.close(store._lock)  # what a kill leaves behind
    with (tmp_path / "journal-000001.jsonl").open("ab") as file:
        file.write(torn)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert rows_of(tmp_path) == [0, 1]
    assert len(said) == torn.endswith(b"\n")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        with ResultStore(tmp_path, INFO) as again:
            assert again.finished == 2
    # The last line cut off is what a kill leaves; a whole line that is no row is not.
    assert len(said) == torn.endswith(b"\n") == (tmp_path / "set-aside").exists()
    assert rows_of(tmp_path) == [0, 1]
    store.log.close()
    store._journal.close()


def test_a_kill_between_rename_and_removal_doubles_nothing(tmp_path):
    with ResultStore(tmp_path, INFO) as store:
        store.append([row(0), row(1)])
        journal = (tmp_path / "journal-000001.jsonl").read_bytes()
    (tmp_path / "journal-000001.jsonl").write_bytes(journal)
    assert rows_of(tmp_path) == [0, 1]
    with ResultStore(tmp_path, INFO) as again:
        again.append([row(2)])
    assert rows_of(tmp_path) == [0, 1, 2] and duckdb.sql(
        f"select count(*) from '{tmp_path}/results/*.parquet'"
    ).fetchall() == [(3,)]


def test_a_kill_while_a_part_is_written_leaves_no_half_of_it(tmp_path):
    with ResultStore(tmp_path, INFO) as store:
        store.append([row(0)])
    (tmp_path / "results" / ".0123456789abcdef.part").write_bytes(b"PAR1 half")
    assert rows_of(tmp_path) == [0]
    assert pd.read_parquet(tmp_path / "results").shape == (1, len(columns()))
    with ResultStore(tmp_path, INFO) as again:
        again.append([row(1)])
    assert rows_of(tmp_path) == [0, 1]


def test_full_disk_is_one_error_and_earlier_rows_stay(tmp_path, monkeypatch):
    written = []

    def full(handle, data):
        if written:
            os.write(handle, bytes(data[:100]))
            raise OSError(errno.ENOSPC, "No space left on device")
        written.append(1)
        os.write(handle, data)

    monkeypatch.setattr(writing, "write_all", full)
    with (
        pytest.raises(ResultsError, match="No space left on device; 1 rows are intact"),
        ResultStore(tmp_path, INFO) as store,
    ):
        store.append([row(0)])
        store.append([row(1)])
    assert rows_of(tmp_path) == [0]
    monkeypatch.undo()
    with ResultStore(tmp_path, INFO) as again:
        again.append([row(1)])
    assert rows_of(tmp_path) == [0, 1]


def test_unwritable_folder(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(ResultsError, match="can't be written: Not a directory"):
        ResultStore(tmp_path / "file" / "run", INFO)


def test_one_process_at_a_time(tmp_path):
    with ResultStore(tmp_path, INFO), pytest.raises(ResultsError, match="another process"):
        ResultStore(tmp_path, INFO)


def test_another_run_in_the_folder(tmp_path):
    ResultStore(tmp_path, INFO).close()
    with pytest.raises(ResultsError, match="other cases"):
        ResultStore(tmp_path, run_info("xyz", 10, "module:function"))
    data = json.loads((tmp_path / "run.json").read_text())
    data["columns"].pop("hand")
    (tmp_path / "run.json").write_text(json.dumps(data))
    with pytest.raises(ResultsError, match="other columns"):
        ResultStore(tmp_path, INFO)
    (tmp_path / "run.json").write_text("{")
    with pytest.raises(ResultsError, match="damaged"):
        ResultStore(tmp_path, INFO)


def test_damaged_part_is_named(tmp_path):
    with ResultStore(tmp_path, INFO) as store:
        store.append([row(0)])
    part_files(tmp_path)[0].write_bytes(b"PAR1nonsense")
    with pytest.warns(DamagedRunWarning, match=r"part-000001.parquet: left out: is damaged"):
        assert load_table(tmp_path).num_rows == 0
    with pytest.warns(DamagedRunWarning, match=r"part-000001.parquet set aside"), ResultStore(tmp_path, INFO) as again:
        assert not any(again.done)
    assert (tmp_path / "set-aside" / "part-000001.parquet").read_bytes() == b"PAR1nonsense"


def test_no_run_here(tmp_path):
    with pytest.raises(ResultsError, match="no run here"):
        load_table(tmp_path)


def test_conditions_see_the_rows_and_nothing_else(tmp_path):
    with ResultStore(tmp_path, INFO) as store:
        store.append([row(number) for number in range(5)])
    assert find_rows(tmp_path, "seed > 2") == [3, 4]
    assert find_rows(tmp_path, "seed > 2 order by seed desc") == [4, 3]
    assert find_rows(tmp_path) == [0, 1, 2, 3, 4]
    for condition in ("colour = 1", "1 = (", "row in (select 1 from read_csv('/etc/passwd'))"):
        with pytest.raises(ValueError, match="a condition in SQL"):
            find_rows(tmp_path, condition)
