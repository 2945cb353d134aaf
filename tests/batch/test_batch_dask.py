"""A real Dask scheduler with workers over TCP: the same rows, also when workers or the scheduler are lost."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time

import pytest

from grasp_planner.batch import SchedulerError, load_table, run_batch
from grasp_planner.batch.rows import RUN_COLUMNS


class Cluster:
    """A scheduler and workers, each a process of its own."""

    def __init__(self, folder):
        self.file = folder / "scheduler.json"
        self.log = (folder / "cluster.log").open("wb")
        self.processes = []
        self.workers = []
        self.start_scheduler("0")

    def start_scheduler(self, port):
        """Start a scheduler and wait for its address."""
        self.file.unlink(missing_ok=True)
        words = ("--host", "127.0.0.1", "--port", port, "--no-dashboard", "--no-show")
        self.scheduler = self._start("dask_scheduler", *words)
        try:
            self.address = self._announced_address(limit_s=60.0)
        except BaseException:
            self.close()
            raise

    def _announced_address(self, limit_s):
        until = time.monotonic() + limit_s
        while time.monotonic() < until:
            # The file exists, empty, a moment before the scheduler has written it.
            with contextlib.suppress(FileNotFoundError, json.JSONDecodeError):
                return json.loads(self.file.read_text())["address"]
            time.sleep(0.05)
        raise TimeoutError(f"no scheduler after {limit_s:g} s")

    def add_worker(self, *options):
        """Start a worker with one thread."""
        self.workers.append(self._start("dask_worker", "--nthreads", "1", "--no-dashboard", *options))

    def _start(self, module, *options):
        words = [sys.executable, "-m", f"distributed.cli.{module}", "--scheduler-file", str(self.file), *options]
        process = subprocess.Popen(words, stdout=self.log, stderr=self.log, start_new_session=True)
        self.processes.append(process)
        return process

    def kill(self, process):
        """Kill a process and its children at once."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

    def close(self):
        """Kill everything."""
        for process in reversed(self.processes):
            self.kill(process)
        self.log.close()


@pytest.fixture
def cluster(tmp_path):
    """A scheduler without workers."""
    found = Cluster(tmp_path)
    yield found
    found.close()


@pytest.mark.slow
def test_same_rows_as_on_this_machine_with_one_worker_killed(
    cluster, tmp_path, cases, ends, real_spec, real_run, monkeypatch
):
    monkeypatch.setenv("BATCH_TEST_MARKER", str(tmp_path / "marker"))
    cluster.add_worker("--no-nanny")
    cluster.add_worker()
    assert cluster.address.startswith("tcp://")
    run_batch(real_spec, tmp_path / "far", scheduler=cluster.address)
    far, near = (load_table(folder).drop_columns(list(RUN_COLUMNS)) for folder in (tmp_path / "far", real_run))
    assert far.equals(near)

    some, killed = cases(60), []

    def kill_one(state):
        if state.done >= 10 and not killed:
            killed.append(state.done)
            cluster.kill(cluster.workers[1])

    planner = "batch_hooks:slow"
    summary = run_batch(some, tmp_path / "kill", scheduler=cluster.address, planner=planner, on_progress=kill_one)
    assert killed and summary.done == 60
    table = load_table(tmp_path / "kill")
    assert table["row"].to_pylist() == list(range(60))
    assert set(table["status"].to_pylist()) == {"infeasible"}

    some, check = ends
    run_batch(some, tmp_path / "ends", scheduler=cluster.address, planner="batch_hooks:ends_in_any_way")
    check(tmp_path / "ends")


@pytest.mark.slow
def test_a_scheduler_killed_and_started_again(cluster, tmp_path, command, run, write_spec, monkeypatch):
    monkeypatch.setenv("DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT", "2s")
    cluster.add_worker("--no-nanny")
    spec, folder = write_spec("blocks: [{product: {seed: {from: 0, to: 39}}}]"), tmp_path / "run"
    words = ["batch", spec, "--out", folder, "--scheduler", cluster.address, "--planner", "batch_hooks:slow"]
    process = subprocess.Popen(command(*words), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    until = time.monotonic() + 100.0
    while not (list(folder.glob("journal-*")) and len(load_table(folder, ["row"])) >= 3):
        assert time.monotonic() < until
        time.sleep(0.05)
    cluster.kill(cluster.scheduler)
    _, errors = process.communicate(timeout=100)
    finished = len(load_table(folder, ["row"]))
    assert process.returncode == 2 and 3 <= finished < 40
    assert "Traceback" not in errors
    (line,) = [line for line in errors.splitlines() if " · " not in line]  # progress
    assert line.startswith("grasp-planner: error: the Dask") and line.endswith("run again to go on")

    cluster.start_scheduler(cluster.address.rpartition(":")[2])
    cluster.add_worker("--no-nanny")
    again = run(*words)
    assert again.returncode == 0 and f"({40 - finished} now" in again.stdout, again.stderr
    assert load_table(folder)["row"].to_pylist() == list(range(40))


def test_no_scheduler_at_the_address(tmp_path, cases, monkeypatch):
    from grasp_planner.batch import dask_pool

    monkeypatch.setattr(dask_pool, "CONNECT_LIMIT_S", 1.0)
    with pytest.raises(SchedulerError, match=r"tcp://127\.0\.0\.1:9"):
        run_batch(cases(1), tmp_path, scheduler="tcp://127.0.0.1:9")
