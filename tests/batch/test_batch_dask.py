"""A real Dask scheduler with workers over TCP: the same rows, also when workers or the scheduler are lost."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time

import pytest

from grasp_planner.batch import GraspCase, SchedulerError, load_table, parse_spec, run_batch
from grasp_planner.batch.rows import RUN_COLUMNS

REAL = {
    "defaults": {"paper": True, "starts": 2, "enough": 1},
    "blocks": [{"product": {"object.radius": [0.025, 0.035], "n_synergies": [3, 15]}}],
}


class Cluster:
    """A scheduler and workers, each a process of its own."""

    def __init__(self, folder):
        self.file = folder / "scheduler.json"
        self.log = (folder / "cluster.log").open("wb")
        self.processes = []
        self.scheduler = self._start(
            "dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show"
        )
        self.workers = []
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
def test_same_rows_as_on_this_machine_with_one_worker_killed(cluster, tmp_path, cases):
    cluster.add_worker("--no-nanny")
    cluster.add_worker()
    assert cluster.address.startswith("tcp://")
    run_batch(parse_spec(REAL), tmp_path / "far", scheduler=cluster.address)
    run_batch(parse_spec(REAL), tmp_path / "near", workers=1)
    far, near = (load_table(tmp_path / name).drop_columns(list(RUN_COLUMNS)) for name in ("far", "near"))
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

    limited = [GraspCase(seed=seed, time_limit_s=3.0) for seed in range(5)]
    run_batch(limited, tmp_path / "hang", scheduler=cluster.address, planner="batch_hooks:hangs")
    run_batch(cases(5), tmp_path / "die", scheduler=cluster.address, planner="batch_hooks:dies")
    for name, status in (("hang", "timeout"), ("die", "crashed")):
        found = load_table(tmp_path / name)["status"].to_pylist()
        assert found[3] == status and found.count("infeasible") == 4


@pytest.mark.slow
def test_a_lost_scheduler_is_one_error_and_a_rerun_goes_on(cluster, tmp_path, cases):
    cluster.add_worker("--no-nanny")
    some, planner = cases(40), "batch_hooks:slow"

    def kill_scheduler(state):
        if state.done >= 5:
            cluster.kill(cluster.scheduler)

    with pytest.raises(SchedulerError, match="run again to go on"):
        run_batch(some, tmp_path / "run", scheduler=cluster.address, planner=planner, on_progress=kill_scheduler)
    assert 5 <= len(load_table(tmp_path / "run")) < 40
    run_batch(some, tmp_path / "run", workers=2, planner=planner)
    assert load_table(tmp_path / "run")["row"].to_pylist() == list(range(40))


def test_no_scheduler_at_the_address(tmp_path, cases, monkeypatch):
    from grasp_planner.batch import dask_pool

    monkeypatch.setattr(dask_pool, "CONNECT_LIMIT_S", 1.0)
    with pytest.raises(SchedulerError, match=r"tcp://127\.0\.0\.1:9"):
        run_batch(cases(1), tmp_path, scheduler="tcp://127.0.0.1:9")
