"""The commands ``view`` and ``export``, and the planning process by itself."""

import os
import signal
import sys
import threading
import time
import urllib.request

import pytest
from click.testing import CliRunner

from grasp_planner import PlannerOptions, grasp_json
from grasp_planner.cli.main import main
from grasp_planner.viewer import planning
from grasp_planner.viewer.planning import PlanEvents, PlanningProcess, PlanRequest

from ..processes import interruptible


@pytest.fixture
def saved(grasp, tmp_path):
    path = tmp_path / "result.json"
    path.write_text(grasp_json(grasp))
    return path


def test_export_writes_one_page_that_loads_nothing(saved, tmp_path):
    page = tmp_path / "out.html"
    result = CliRunner().invoke(main, ["export", str(saved), "--html", str(page), "--title", "<script>x</script>"])
    assert result.exit_code == 0, result.output
    text = page.read_text()
    assert "data-model='met'" in text
    assert "&lt;script&gt;x&lt;/script&gt;" in text
    assert "<script>x" not in text
    assert len(text) < 1_500_000


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["view", "/no/such/file.json", "--no-open"], "No such file"),
        (["view", "--host", "0.0.0.0", "--no-open"], "--allow-remote"),
        (["export", "/no/such/file.json", "--html", "x.html"], "No such file"),
    ],
)
def test_wrong_use_ends_with_one_line_and_code_2(arguments, words):
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2
    assert words in result.output
    assert result.output.count("\n") == 1


def test_export_to_an_impossible_place_says_so(saved, tmp_path):
    result = CliRunner().invoke(main, ["export", str(saved), "--html", str(tmp_path / "no" / "out.html")])
    assert result.exit_code == 2
    assert "can't be written" in result.output


def test_a_file_that_is_no_grasp_is_refused(tmp_path):
    path = tmp_path / "bad.json"
    path.write_text('{"hand": 1}')
    result = CliRunner().invoke(main, ["view", str(path), "--no-open"])
    assert result.exit_code == 2
    assert "bad.json" in result.output


@pytest.mark.slow
@pytest.mark.parametrize("remote", [False, True])
def test_view_serves_the_page_until_it_is_interrupted(saved, remote):
    command = [sys.executable, "-m", "grasp_planner", "view", str(saved), "--no-open", "--port", "0"]
    command += ["--host", "0.0.0.0", "--allow-remote"] if remote else []
    process = interruptible(command)
    try:
        line = process.stdout.readline()
        url = line.split()[4].rstrip(";")
        assert url.startswith("http://127.0.0.1:")
        assert b"<html" in urllib.request.urlopen(url, timeout=20).read()[:2000].lower()
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=20)
    finally:
        process.kill()
    assert process.returncode == 0, errors
    assert ("Warning" in errors) == remote
    assert "Traceback" not in errors


class Listener:
    """Collects what a search reports."""

    def __init__(self):
        self.results, self.progress, self.best, self.ended = [], [], [], threading.Event()
        self.outcome = None
        self.events = PlanEvents(self.progress.extend, self.results.append, self.best.extend, self._end)

    def _end(self, outcome, message):
        self.outcome, self.message = outcome, message
        self.ended.set()


@pytest.fixture
def process():
    running = PlanningProcess()
    yield running
    running.close()


@pytest.mark.slow
def test_only_one_search_runs_at_a_time(process, easy_problem):
    one, two = Listener(), Listener()
    request = PlanRequest(easy_problem, options=PlannerOptions(enough=1, starts=6))
    assert process.start(request, one.events)
    assert not process.start(request, two.events)
    assert one.ended.wait(90.0)
    assert one.outcome == "done"
    assert one.progress
    assert one.progress[0].start == 0
    assert process.start(request, two.events)
    assert two.ended.wait(90.0)
    assert [g.objective for g in one.results] == [g.objective for g in two.results]
    assert [g.objective for g in one.best] == [min(g.objective for g in one.results if g.feasible)]


@pytest.mark.slow
def test_a_search_that_does_not_listen_is_ended(process, easy_problem, monkeypatch):
    """Cancelled while the fresh process still loads its libraries, it can't listen."""
    listener = Listener()
    assert process.start(PlanRequest(easy_problem, options=PlannerOptions(enough=50, starts=500)), listener.events)
    began = time.perf_counter()
    process.cancel()
    assert listener.ended.wait(5.0)
    assert time.perf_counter() - began < 5.0
    assert listener.outcome == "cancelled"
    assert planning.GRACE_S < 0.2


@pytest.mark.slow
def test_a_dead_process_is_reported_and_replaced(process, easy_problem):
    listener, again = Listener(), Listener()
    assert process.start(PlanRequest(easy_problem, options=PlannerOptions(enough=50, starts=500)), listener.events)
    os.kill(process.pid, signal.SIGKILL)
    assert listener.ended.wait(20.0)
    assert listener.outcome == "failed"
    assert process.start(PlanRequest(easy_problem, options=PlannerOptions(enough=1, starts=6)), again.events)
    assert again.ended.wait(90.0)
    assert again.outcome == "done"
