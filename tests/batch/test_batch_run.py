"""Runs on this machine: every case gets exactly one row, whatever its worker does."""

import threading

import duckdb
import pandas as pd
import polars as pl
import psutil
import pytest

from grasp_planner import GraspPlannerError, grasp_from_record
from grasp_planner.batch import GraspCase, load_grasps, load_row, load_table, run_batch
from grasp_planner.batch.rows import RUN_COLUMNS, columns


def test_rows_are_complete_and_most_are_feasible(real_run):
    table = load_table(real_run)
    assert table.column_names == list(columns())
    assert table["row"].to_pylist() == list(range(4))
    assert sum(table["feasible"].to_pylist()) >= 3
    for values in table.to_pylist():
        assert values["status"] in ("feasible", "infeasible")
        assert (values["reason"] is None) == values["feasible"]
        assert len(values["joint_angles"]) == len(values["joint_names"]) == 15
        assert len(values["contact_forces"]) == len(values["contact_names"])
        assert values["time_s"] > 0.0 and values["time_cpu_s"] > 0.0 and values["attempts"] == 1
        assert {entry["name"] for entry in values["violations"]} >= {"surface", "friction"}


def test_records_are_grasps_that_compute_the_same_numbers(real_run):
    table = load_table(real_run)
    for row in (0, 3):
        record = load_row(real_run, row)
        grasp = grasp_from_record(record)
        values = table.slice(row, 1).to_pylist()[0]
        assert record.time_s == values["time_s"] > 0.0
        assert grasp.force_norm == pytest.approx(values["force_norm"], rel=1e-9)
        assert grasp.feasible == values["feasible"]
        assert load_grasps(real_run, [row])[0].joint_angles.tolist() == values["joint_angles"]
    with pytest.raises(ValueError, match="from 0 to 3"):
        load_row(real_run, 4)


def test_rows_do_not_depend_on_the_number_of_workers(real_spec, real_run, tmp_path):
    run_batch(real_spec, tmp_path, workers=1)
    one, two = (load_table(folder).drop_columns(list(RUN_COLUMNS)) for folder in (tmp_path, real_run))
    assert one.equals(two)


def test_pandas_polars_and_duckdb_read_the_same(real_run):
    pattern = f"{real_run}/results/*.parquet"
    tables = [
        pd.read_parquet(real_run / "results").sort_values("row"),
        pl.read_parquet(pattern).sort("row").to_pandas(use_pyarrow_extension_array=False),
        duckdb.sql(f"select * from '{pattern}' order by row").df(),
    ]
    expected = load_table(real_run).to_pandas()
    for table in tables:
        assert list(table.columns) == list(expected.columns)
        for name in ("row", "status", "feasible", "force_norm", "object", "record"):
            assert table[name].tolist() == expected[name].tolist()
        for name in ("joint_angles", "sigma"):
            assert [list(v) for v in table[name]] == [list(v) for v in expected[name]]
        assert [[list(p) for p in v] for v in table["contact_forces"]] == [
            [list(p) for p in v] for v in expected["contact_forces"]
        ]
    sql = f"""select row from '{pattern}'
        where list_max(list_transform(violations, lambda v: v.value)) = worst_violation_value order by row"""
    assert duckdb.sql(sql).fetchall() == [(row,) for row in range(4)]


def test_a_second_run_repeats_nothing(real_spec, real_run):
    before = load_table(real_run)
    summary = run_batch(real_spec, real_run, workers=1)
    assert (summary.resumed, summary.done) == (4, 4)
    assert load_table(real_run).equals(before)


def test_every_end_of_a_case_is_one_row_with_its_reason(tmp_path, ends, monkeypatch):
    some, check = ends
    monkeypatch.setenv("BATCH_TEST_MARKER", str(tmp_path / "marker"))
    assert run_batch(some, tmp_path / "run", workers=2, planner="batch_hooks:ends_in_any_way").done == len(some)
    check(tmp_path / "run")
    with pytest.raises(ValueError, match="timeout: stopped at its limit"):
        load_row(tmp_path / "run", 3)
    assert not psutil.Process().children(recursive=True)


def test_cancel_keeps_what_is_finished(tmp_path, cases):
    states = []
    summary = run_batch(
        cases(300),
        tmp_path,
        workers=2,
        planner="batch_hooks:slow",
        on_progress=states.append,
        cancel=lambda: bool(states) and states[-1].done >= 5,
    )
    assert summary.interrupted and 5 <= summary.done < 300
    assert len(load_table(tmp_path)) == summary.done
    last = states[-1]
    assert last.total == 300 and last.rate and last.seconds_left and last.success == 0.0


def test_runs_outside_the_main_thread(tmp_path, cases):
    found = []
    thread = threading.Thread(
        target=lambda: found.append(run_batch(cases(2), tmp_path, workers=1, planner="batch_hooks:quick"))
    )
    thread.start()
    thread.join(60.0)
    assert found[0].done == 2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"workers": 0}, "workers: got 0"),
        ({"planner": "batch_hooks:none"}, "planner: got"),
        ({"planner": "x"}, "planner"),
    ],
)
def test_wrong_arguments(tmp_path, cases, options, message):
    with pytest.raises(GraspPlannerError, match=message):
        run_batch(cases(1), tmp_path, **options)
    with pytest.raises(GraspPlannerError, match="at least one case"):
        run_batch([], tmp_path)


def test_settings_that_do_not_exist():
    with pytest.raises(GraspPlannerError, match="did you mean 'friction'"):
        GraspCase(settings={"frictoin": 1.0})
