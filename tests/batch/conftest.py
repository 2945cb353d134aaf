"""What the tests of batches share."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from grasp_planner.batch import BatchSpec, GraspCase, load_table, parse_spec, run_batch

ROOT = Path(__file__).parents[2]
MAIN = """
import click
from grasp_planner.cli.batch import batch_command, export_command, report_command
click.Group(commands=[batch_command, report_command, export_command])()
"""


@pytest.fixture(scope="session")
def real_spec() -> BatchSpec:
    """Return cases that are planned in earnest."""
    axes = {"object.radius": [0.025, 0.035], "task": ["force:+x", "force:+y"], "n_synergies": [15]}
    return parse_spec({"defaults": {"paper": True, "starts": 2, "enough": 1}, "blocks": [{"product": axes}]})


@pytest.fixture(scope="session")
def real_run(real_spec: BatchSpec, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of their run on two workers."""
    folder = tmp_path_factory.mktemp("real")
    summary = run_batch(real_spec, folder, workers=2)
    assert (summary.done, summary.total, summary.interrupted) == (4, 4, False)
    return folder


@pytest.fixture(autouse=True)
def import_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let child processes find the package and the hooks."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), str(Path(__file__).parent)]))


@pytest.fixture
def command() -> Callable[..., list[str]]:
    """Return the command line of a command."""
    return lambda *arguments: [sys.executable, "-c", MAIN, *map(str, arguments)]


@pytest.fixture
def run(command: Callable[..., list[str]]) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run a command and return its exit code and output."""
    return lambda *arguments, **options: subprocess.run(
        command(*arguments), capture_output=True, text=True, timeout=120, check=False, **options
    )


@pytest.fixture
def cases() -> Callable[[int], Sequence[GraspCase]]:
    """Return a number of cases that differ in their seeds."""
    return lambda count: [GraspCase(object="cylinder:radius=0.03", seed=seed) for seed in range(count)]


@pytest.fixture
def ends() -> tuple[list[GraspCase], Callable[[Path], None]]:
    """Return cases for ``batch_hooks:ends_in_any_way``, and what checks the rows in their folder."""
    limits = {3: {"time_limit_s": 3.0}, 4: {"memory_limit_mb": 500.0}}
    expected = [
        ("infeasible", 1, ""),
        ("crashed", 2, "worker died.*its worker died 2 times .signal 9"),
        ("infeasible", 2, ""),
        ("timeout", 1, "time limit.*stopped at its limit of 3 s"),
        ("memory", 1, r"memory limit.*stopped at its limit of 500 MB .its worker held \d+ MB"),
        ("error", 1, "RuntimeError.*on purpose"),
        ("infeasible", 1, ""),
    ]

    def check(folder: Path) -> None:
        rows = load_table(folder).to_pylist()
        assert [(row["status"], row["attempts"]) for row in rows] == [(status, count) for status, count, _ in expected]
        for row, (_, _, words) in zip(rows, expected, strict=True):
            assert re.search(words, f"{row['reason']}: {row['message']}")

    some = [
        GraspCase(object="cylinder:radius=0.03", seed=seed, **limits.get(seed, {})) for seed in range(len(expected))
    ]
    return some, check


@pytest.fixture
def write_spec(tmp_path: Path) -> Callable[[str], Path]:
    """Write a specification and return its file."""

    def write(text: str) -> Path:
        path = tmp_path / "spec.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write
