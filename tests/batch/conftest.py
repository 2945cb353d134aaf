"""What the tests of batches share."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from grasp_planner.batch import GraspCase

ROOT = Path(__file__).parents[2]
MAIN = """
import click
from grasp_planner.cli.batch import batch_command, export_command, report_command
click.Group(commands=[batch_command, report_command, export_command])()
"""


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
def write_spec(tmp_path: Path) -> Callable[[str], Path]:
    """Write a specification and return its file."""

    def write(text: str) -> Path:
        path = tmp_path / "spec.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write
