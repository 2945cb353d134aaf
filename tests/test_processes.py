"""Worker processes: answers, reports, cancelling, limits, crashes and what can't be started."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from grasp_planner.exceptions import GraspPlannerError
from grasp_planner.processes import Job, JobError, JobFunction, WorkerProcess, answers_in_order, work_off
from grasp_planner.processes import pool as pool_module
from grasp_planner.processes.errors import WorkerStartError
from grasp_planner.processes.pool import LocalPool

HERE = "tests.test_processes"


def worker_maker(kind):
    """Return what answers jobs; runs in the worker process."""
    return {"add": add, "listen": listen, "sleep": sleep, "grow": grow}[kind]


def add(content, context):
    """Add one, or fail, die or sleep as told."""
    if content == "fail":
        raise ValueError("on purpose")
    if content == "refuse":
        raise GraspPlannerError("refused")
    if content == "die":
        os._exit(9)
    time.sleep(0.2 if content == 0 else 0.0)
    return content + 1


def listen(content, context):
    """Report until it is cancelled."""
    while not context.cancelled():
        context.report(content)
        time.sleep(0.02)
    return "stopped"


def sleep(content, context):
    """Never answer."""
    time.sleep(content)


def grow(content, context):
    """Take as much memory as asked for [MB], then wait to be stopped, unless that was none."""
    kept = [b"1" * 1_000_000 for _ in range(content)]
    time.sleep(60.0 if kept else 0.0)


class Number:
    """A value of a class of its own."""

    def __init__(self, value):
        self.value = value

    def __add__(self, other):
        return self.value + other


def function(kind):
    return JobFunction(f"{HERE}:worker_maker", {"kind": kind})


def test_answers_come_in_the_order_of_the_jobs():
    assert list(answers_in_order(function("add"), range(6), workers=2)) == [1, 2, 3, 4, 5, 6]
    assert list(answers_in_order(function("add"), [Number(4)], workers=1)) == [5]
    assert not list(answers_in_order(function("add"), [], workers=2))


@pytest.mark.parametrize(
    ("content", "message"),
    [("fail", "job 1 .* ValueError: on purpose"), ("refuse", "refused"), ("die", "exit code 9")],
)
def test_a_job_without_an_answer_is_an_error(content, message):
    with pytest.raises(JobError, match=message):
        list(answers_in_order(function("add"), [1, content, 2], workers=1))


def test_a_job_that_kills_its_worker_is_started_twice_and_the_others_end():
    jobs = [Job(0, "die"), Job(1, 1), Job(2, "fail")]
    found = [outcome for some in work_off(jobs, LocalPool(1, function("add"))) for outcome in some]
    assert {outcome.job.number: (outcome.kind, outcome.job.attempt) for outcome in found} == {
        0: ("died", 2),
        1: ("done", 1),
        2: ("failed", 1),
    }


def test_a_job_beyond_its_limit_is_stopped():
    pool = LocalPool(1, function("sleep"))
    ((outcome,),) = [some for some in work_off([Job(0, 60.0, time_limit_s=0.3)], pool) if some]
    assert outcome.kind == "timeout"
    assert "limit of 0.3 s" in outcome.detail


def test_a_job_beyond_its_memory_is_stopped_and_the_next_one_answered():
    jobs = [Job(0, 1000, 60.0, memory_limit_mb=300.0), Job(1, 0, memory_limit_mb=1000.0)]
    found = [outcome for some in work_off(jobs, LocalPool(1, function("grow"))) for outcome in some]
    assert [outcome.kind for outcome in found] == ["memory", "done"]
    assert "limit of 300 MB" in found[0].detail


def test_a_job_reports_and_listens():
    worker = WorkerProcess(function("listen"))
    try:
        assert worker.start(Job(7, "on the way"))
        kinds = [worker.receive().kind for _ in range(3)]
        assert kinds == ["ready", "report", "report"]
        worker.cancel()
        while (message := worker.receive()).kind == "report":
            assert (message.number, message.content) == (7, "on the way")
        assert (message.kind, message.number, message.content) == ("done", 7, "stopped")
        assert worker.free
    finally:
        assert worker.kill() == "signal 9"


def test_workers_that_do_not_start_are_one_error(monkeypatch):
    monkeypatch.setattr(pool_module, "MAX_FAILED_STARTS", 2)
    with pytest.raises(WorkerStartError, match="workers do not start"):
        list(work_off([Job(0, 1)], LocalPool(1, JobFunction(f"{HERE}:no_such_function"))))


def test_a_worker_ends_with_its_parent():
    worker = WorkerProcess(function("sleep"))
    worker.start(Job(0, 60.0))
    worker.receive()
    worker._process.stdin.close()
    assert worker.kill(grace_s=5.0) == "exit code 1"


SCRIPT = """
from grasp_planner.processes import Job, JobFunction, WorkerProcess

class Own:
    def __add__(self, other):
        return "of its own class"

if __name__ == "__main__":
    worker = WorkerProcess(JobFunction("tests.test_processes:worker_maker", {"kind": "add"}))
    worker.start(Job(0, Own()))
    worker.receive()
    print(worker.receive().content)
"""


def test_classes_of_the_script_itself_are_known_to_its_workers(tmp_path):
    path = tmp_path / "script.py"
    path.write_text(SCRIPT, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
    done = subprocess.run([sys.executable, path], env=environment, capture_output=True, text=True, check=False)
    assert done.stdout == "of its own class\n", done.stderr
