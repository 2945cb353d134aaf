"""The command line as doors of scripts/fuzz.py: values of options, and files that commands open."""

from __future__ import annotations

import importlib
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import click
from click.testing import CliRunner
from fuzz_doors import CONTACTS, OBJECTS, ROOT, SPEC, Door, run_template

from grasp_planner.cli.main import main
from grasp_planner.exceptions import GraspPlannerError

EXITS = (0, 1, 2, 3, 130)
"""Exit codes that are documented; 70 is an error that nobody foresaw."""
LONGEST = 330
"""Longest line of an error: 300 characters and what stands before them."""
FILED = ("analyse", "improve", "export", "simulate", "report", "export-rows", "view")
"""Commands whose file is missing here: only their options are read."""
EXAMPLES = {
    "--hand": "tendon_hand",
    "--object": OBJECTS[0].decode(),
    "--task": "force:+x",
    "--gravity": "0,0,-9.81",
    "--contact-model": "soft:torsion=0.005",
}
"""Good values of options that have no default to start from."""


def run(words: list[str]) -> None:
    """Give words to the command line.

    Raises:
        GraspPlannerError: If it refused them, as it has to.
        AssertionError: If it did not say so as it has to.
    """
    result = CliRunner().invoke(main, words)
    problem = result.exception
    if problem is not None and not isinstance(problem, SystemExit):
        raise problem
    lines = result.stderr.splitlines()
    assert result.exit_code in EXITS, f"exit code {result.exit_code}: {lines[-1:]}"
    assert max(map(len, lines), default=0) <= LONGEST, f"a line of {max(map(len, lines))} characters"
    errors = [line for line in lines if line.startswith(("grasp-planner: error", "Error:"))]
    assert len(errors) <= 1, f"several errors: {errors}"
    if result.exit_code:
        raise GraspPlannerError(errors[0] if errors else str(result.exit_code))


def _interrupted(*_: Any, **__: Any) -> None:
    """Stand in for the search: options have been read when it begins."""
    raise KeyboardInterrupt


def words_of(data: bytes) -> list[str]:
    """Return the words of a command as a shell can pass them on."""
    text = data.replace(b"\0", b"").decode(errors="surrogateescape")
    return text.split("\n")


def _options(name: str) -> list[bytes]:
    """Return a good input for every option of a command that takes a value."""
    command = main.get_command(click.Context(main), name)
    assert command is not None
    file = [] if name == "plan" else ["missing.json"]
    found = []
    for option in command.params:
        if not isinstance(option, click.Option) or option.is_flag or option.name in ("port", "host"):
            continue
        default = option.default if isinstance(option.default, int | float | str) else "0.5"
        value = EXAMPLES.get(option.opts[0], default)
        found.append("\n".join([name, option.opts[0], str(value), *file]).encode())
    return found


def _command_door(name: str, file: str, words: Callable[[Path], list[str]], *good: bytes) -> Door:
    """Return a door that is a command which opens a file."""

    def prepare(data: bytes, folder: Path) -> None:
        (folder / file).write_bytes(data)
        (folder / "kept.txt").write_text("a file that was there before", encoding="utf-8")

    return Door(f"command {name}", good, prepare, lambda folder: run(words(folder)))


def _run_door(name: str, words: Callable[[Path], list[str]]) -> Door:
    """Return a door that is a command on the folder of a run with a damaged Parquet file."""
    template, _ = run_template()
    part = "results/part-000001.parquet"

    def prepare(data: bytes, folder: Path) -> None:
        shutil.copytree(template, folder / "run")
        (folder / "run" / part).write_bytes(data)

    return Door(f"command {name}", ((template / part).read_bytes(),), prepare, lambda folder: run(words(folder)))


@cache
def cli_doors() -> list[Door]:
    """Return the doors of the command line."""
    vars(importlib.import_module("grasp_planner.cli.plan"))["plan_grasps"] = _interrupted
    values = tuple(text for name in ("plan", *FILED) for text in _options(name))
    place = ROOT / "urdf" / "tendon_hand"
    grasp = (ROOT / "tests" / "data" / "paper.json").read_bytes()
    joints = [f"joint_{k}" for k in range(3)]
    postures = (",".join(joints) + "\n0.1,0.2,0.3\n0.2,0.1,0.0\n").encode()

    def put(data: bytes, folder: Path) -> None:
        (folder / "words").write_bytes(data)

    return [
        Door("command words", values, put, lambda folder: run(words_of((folder / "words").read_bytes()))),
        _command_door("analyse", "a.json", lambda folder: ["analyse", str(folder / "a.json")], CONTACTS),
        _command_door(
            "export",
            "a.json",
            lambda folder: ["export", str(folder / "a.json#1"), "--html", str(folder / "a.html")],
            grasp,
        ),
        _command_door(
            "hand check",
            "a.urdf",
            lambda folder: ["hand", "check", str(folder / "a.urdf"), "--toml", str(folder / "a.toml")],
            (place / "tendon_hand.urdf").read_bytes(),
        ),
        _command_door(
            "synergies fit",
            "a.csv",
            lambda folder: ["synergies", "fit", str(folder / "a.csv"), "--out", str(folder / "b.csv")],
            postures,
        ),
        _command_door(
            "batch",
            "a.yaml",
            lambda folder: ["batch", str(folder / "a.yaml"), "--out", str(folder / "run"), "--dry-run"],
            SPEC,
        ),
        _run_door("report", lambda folder: ["report", str(folder / "run"), "--output", str(folder / "a.html")]),
        _run_door(
            "export-rows",
            lambda folder: ["export-rows", str(folder / "run"), "--out", str(folder / "out"), "--rows", "0-5"],
        ),
    ]
