"""A short run of the fuzzing script; the long one is by hand."""

import json
import os
import subprocess
import sys

import pytest

from .scripts import FOLDER, load_script

PACKAGE = FOLDER.parent


@pytest.fixture
def script(monkeypatch):
    """Return the script as a module."""
    monkeypatch.syspath_prepend(str(FOLDER))
    return load_script("fuzz")


def test_damaged_inputs_at_every_door_are_values_or_typed_errors(tmp_path):
    words = [sys.executable, str(FOLDER / "fuzz.py"), "--inputs", "90", "--seed", "2"]
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE)}
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path, env=environment, check=False)
    report = json.loads(done.stdout)
    assert done.returncode == 0 and report["broken"] == [], done.stderr
    assert report["taken"] and report["refused"], "some are refused, some are still good"
    assert len(report["by door"]) == report["doors"] and all(report["by door"].values())
    assert 0.0 < report["slowest_s"] < 60.0 and 50 < report["largest_mb"] < 2000


def enter_and(deed):
    """Return a door that takes a file and does a deed."""
    import fuzz_doors

    return fuzz_doors.Door("bad", (b"good",), lambda data, folder: (folder / "a").write_bytes(data), deed)


@pytest.mark.parametrize(
    ("deed", "what"),
    [
        (lambda folder: 1 / 0, "ZeroDivisionError"),
        (lambda folder: os.write(2, b"Traceback (most recent call last):\nOh: no\n"), "a traceback: Oh: no"),
        (lambda folder: (folder / "a").unlink(), "1 files lost"),
        (lambda folder: (folder / "a").write_bytes(b"other"), "1 files lost"),
        (lambda folder: (folder / "a").rename(folder / "b"), ""),
    ],
)
def test_the_script_sees_what_breaks(script, deed, what):
    found = script.try_input(enter_and(deed), b"good")
    assert (found["kind"] == "broken") == bool(what) and what in found["detail"]


def test_the_script_measures_memory_and_time(script):
    small = script.try_input(enter_and(lambda folder: None), b"")
    large = script.try_input(enter_and(lambda folder: bytearray(b"x") * 200_000_000), b"")
    again = script.try_input(enter_and(lambda folder: sum(range(3_000_000))), b"")
    assert large["peak_mb"] > small["peak_mb"] + 150 > again["peak_mb"] + 50, "the peak is that of one input"
    assert again["cpu_s"] > small["cpu_s"]


def test_inputs_are_the_same_for_a_seed(script):
    known = [enter_and(lambda folder: None)]
    one, other = ([script.case(number, seed, known)[1] for number in range(20)] for seed in (1, 2))
    assert one == [script.case(number, 1, known)[1] for number in range(20)] != other


def test_a_process_that_dies_is_seen_and_replaced(script, monkeypatch, tmp_path):
    (tmp_path / "dies.py").write_text("import os\nos.abort()\n", encoding="utf-8")
    monkeypatch.setattr(script, "__file__", str(tmp_path / "dies.py"))
    watched = script.Watched()
    assert [watched.tried(number, 0)["detail"] for number in range(2)] == ["the process died"] * 2
