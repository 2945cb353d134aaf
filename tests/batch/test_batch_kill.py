"""Kills: workers and the parent, again and again, until the batch is complete; every case exactly once."""

import json
import signal
import time

import psutil
import pytest

from grasp_planner.batch import load_row, load_table
from grasp_planner.batch.rows import columns
from tests.processes import interruptible
from tests.scripts import load_script

CASES = 80
SPEC = f"""
defaults: {{paper: true, object: cylinder, object.radius: 0.03}}
blocks: [{{product: {{seed: {{from: 0, to: {CASES - 1}}}}}}}]
"""


def start(command, spec, folder, *options):
    words = command("batch", spec, "--out", folder, "--workers", 2, *options)
    return interruptible(words)


def workers_of(process):
    try:
        return psutil.Process(process.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []


def count_rows(folder):
    return len(load_table(folder, ["row"])) if (folder / "run.json").exists() else 0


def wait_until(condition, limit=100.0):
    until = time.monotonic() + limit
    while not condition():
        assert time.monotonic() < until, "it takes too long"
        time.sleep(0.02)


def gone(workers):
    return not any(worker.is_running() and worker.status() != psutil.STATUS_ZOMBIE for worker in workers)


@pytest.mark.slow
def test_every_case_has_one_row_whatever_is_killed(tmp_path):
    report = load_script("kill_batch").attack(tmp_path, cases=200, rounds=2, seed=2)
    assert report["rows"] == report["distinct"] == report["of their case"] == 200
    assert report["never fewer"], "rows that were on disk are lost"
    assert report["events"]["kill command"] == 2 and report["events"]["kill worker"] >= 2
    events = [json.loads(line) for line in (tmp_path / "kills.jsonl").read_text(encoding="utf-8").splitlines()]
    (second,) = [event for event in events if event["event"] == "second command"]
    assert second["exit"] == 2 and second["said"].endswith("another process runs this batch now")
    table = load_table(tmp_path / "run")
    assert set(table["status"].to_pylist()) <= {"infeasible", "error", "crashed"}
    assert table["status"].to_pylist().count("crashed") <= 2
    assert table.column_names == list(columns())
    assert load_row(tmp_path / "run", 20).hand == "dlr_hit_ii_right"


@pytest.mark.slow
def test_ctrl_c_stops_early_and_a_rerun_goes_on(command, write_spec, run, tmp_path):
    folder, spec = tmp_path / "run", write_spec(SPEC)
    process = start(command, spec, folder, "--planner", "batch_hooks:slow")
    wait_until(lambda: count_rows(folder) > 3)
    workers = workers_of(process)
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=100)
    assert process.returncode == 130 and "run the same command again" in errors
    finished = count_rows(folder)
    assert f"{finished} of {CASES} cases done" in output and 3 < finished < CASES
    assert not list(folder.glob("journal-*")) and gone(workers)
    done = run("batch", spec, "--out", folder, "--planner", "batch_hooks:slow")
    assert done.returncode == 0 and f"({CASES - finished} now" in done.stdout
    assert load_table(folder)["row"].to_pylist() == list(range(CASES))


@pytest.mark.slow
def test_a_second_ctrl_c_stops_at_once(command, write_spec, tmp_path):
    folder, spec = tmp_path / "run", write_spec(SPEC)
    process = start(command, spec, folder, "--planner", "batch_hooks:slow")
    wait_until(lambda: count_rows(folder) > 0)
    workers = workers_of(process)
    process.send_signal(signal.SIGINT)
    time.sleep(0.02)  # signals that wait count once
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=100)
    assert process.returncode == 130 and 0 < count_rows(folder) < CASES
    wait_until(lambda: gone(workers))


@pytest.mark.slow
def test_hanging_workers_end_with_a_killed_parent(command, write_spec, tmp_path):
    spec = write_spec("blocks: [{product: {seed: [3, 3]}}]")
    process = start(command, spec, tmp_path / "run", "--planner", "batch_hooks:hangs")
    wait_until(lambda: len(workers_of(process)) == 2)
    time.sleep(3.0)
    workers = workers_of(process)
    process.kill()
    process.communicate()
    wait_until(lambda: gone(workers))
