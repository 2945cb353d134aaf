"""Kills: workers and the parent, again and again, until the batch is complete; every case exactly once."""

import signal
import subprocess
import time

import numpy as np
import psutil
import pytest

from grasp_planner.batch import load_row, load_table
from grasp_planner.batch.rows import columns
from grasp_planner.batch.run_files import part_files

CASES = 160
SPEC = f"""
defaults: {{paper: true, object: cylinder, object.radius: 0.03}}
blocks: [{{product: {{seed: {{from: 0, to: {CASES - 1}}}}}}}]
"""


def start(command, spec, folder, *options):
    words = command("batch", spec, "--out", folder, "--workers", 2, *options)
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def workers_of(process):
    try:
        return psutil.Process(process.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []


def count_rows(folder):
    return len(load_table(folder, ["row"])) if (folder / "run.json").exists() else 0


def wait_until(condition, limit=30.0):
    until = time.monotonic() + limit
    while not condition():
        assert time.monotonic() < until, "it takes too long"
        time.sleep(0.02)


def gone(workers):
    return not any(worker.is_running() and worker.status() != psutil.STATUS_ZOMBIE for worker in workers)


@pytest.mark.slow
def test_sigkill_of_workers_and_parent_until_complete(command, write_spec, tmp_path):
    folder, spec, rng = tmp_path / "run", write_spec(SPEC), np.random.default_rng(0)
    rows, orphans, kills = 0, [], {"worker": 0, "parent": 0}
    for round_number in range(7):
        process = start(command, spec, folder, "--planner", "batch_hooks:slow")
        if round_number == 6:
            break
        wait_until(lambda have=rows: count_rows(folder) > have + 5)
        for worker in rng.permutation(workers_of(process))[: rng.integers(0, 3)]:
            worker.kill()
            kills["worker"] += 1
        time.sleep(rng.uniform(0.0, 0.8))
        orphans += workers_of(process)
        process.kill()
        process.communicate()
        kills["parent"] += 1
        assert count_rows(folder) >= rows, "rows that were on disk are lost"
        rows = count_rows(folder)
        if rows == CASES:
            break
    output, errors = process.communicate(timeout=100)
    if rows < CASES:
        assert process.returncode == 0, errors
        assert f"{CASES} of {CASES} cases done" in output
    assert kills["parent"] >= 3 and kills["worker"] >= 1
    table = load_table(folder)
    assert table["row"].to_pylist() == list(range(CASES))
    assert table["seed"].to_pylist() == list(range(CASES))
    assert set(table["status"].to_pylist()) <= {"infeasible", "crashed"}
    assert table["status"].to_pylist().count("infeasible") >= CASES - 4
    assert table.column_names == list(columns()) and part_files(folder)
    for values in table.slice(0, 20).to_pylist():
        if values["status"] == "infeasible":
            assert load_row(folder, values["row"]).seed == values["row"]
    wait_until(lambda: gone(orphans), 10.0)


@pytest.mark.slow
def test_ctrl_c_stops_within_two_seconds_and_a_rerun_goes_on(command, write_spec, run, tmp_path):
    folder, spec = tmp_path / "run", write_spec(SPEC)
    process = start(command, spec, folder, "--planner", "batch_hooks:slow")
    wait_until(lambda: count_rows(folder) > 3)
    workers = workers_of(process)
    began = time.monotonic()
    process.send_signal(signal.SIGINT)
    output, errors = process.communicate(timeout=20)
    assert time.monotonic() - began < 2.0
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
    began = time.monotonic()
    process.send_signal(signal.SIGINT)
    time.sleep(0.02)  # signals that wait count once
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=20)
    assert time.monotonic() - began < 1.0 and process.returncode == 130
    assert count_rows(folder) > 0
    wait_until(lambda: gone(workers), 10.0)


@pytest.mark.slow
def test_hanging_workers_end_with_a_killed_parent(command, write_spec, tmp_path):
    spec = write_spec("blocks: [{product: {seed: [3, 3]}}]")
    process = start(command, spec, tmp_path / "run", "--planner", "batch_hooks:hangs")
    wait_until(lambda: len(workers_of(process)) == 2)
    time.sleep(3.0)
    workers = workers_of(process)
    process.kill()
    process.communicate()
    wait_until(lambda: gone(workers), 10.0)
