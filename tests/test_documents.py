"""What README and guide print works: Python runs, files are read, command lines exist, the quick start is followed."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import tomllib
import urllib.request

import click
import pytest

import grasp_planner as gp
from grasp_planner.cli.main import main
from grasp_planner.hand.description import HandDescription

from .documents import PAGES, ROOT, blocks, code_spans, command_lines
from .processes import interruptible

WITH_PYTHON = [page for page in PAGES if blocks(page, "python")]
COMMANDS = [(block.name, line) for page in PAGES for block in blocks(page) for line in command_lines(block)]
PREPARE = {
    "docs/batch.md": """
from grasp_planner.batch import GraspCase, run_batch
cases = [GraspCase(seed=seed, settings={"starts": 1}) for seed in range(18)]
run_batch(cases, "runs/cyl", workers=2, planner="batch_hooks:quick")
"""
}
"""What the commands of a page have done before its Python runs."""


def run(code, folder):
    path = os.pathsep.join([str(ROOT), str(ROOT / "tests" / "batch"), os.environ.get("PYTHONPATH", "")])
    finished = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


@pytest.mark.parametrize("page", WITH_PYTHON, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_the_python_of_a_page_runs_as_printed(page, tmp_path):
    if page.name == "batch.md":
        pytest.importorskip("duckdb")
    code = "\n".join(block.text for block in blocks(page, "python"))
    printed = run(PREPARE.get(page.relative_to(ROOT).as_posix(), "") + code, tmp_path)
    if page.name in ("README.md", "quickstart.md"):
        assert "feasible: every requirement is met" in printed


def test_the_python_of_readme_and_guide_was_found():
    names = {page.relative_to(ROOT).as_posix() for page in WITH_PYTHON}
    assert {
        "README.md",
        "docs/quickstart.md",
        "docs/extend/object.md",
        "docs/extend/term.md",
        "docs/extend/contact_model.md",
    } <= names


def parse(words):
    """Parse a command line as the program would, without running it; return the command."""
    command, context, rest = main, click.Context(main, info_name="grasp-planner"), words[1:]
    while isinstance(command, click.Group):
        _, command, rest = command.resolve_command(context, rest)
        context = click.Context(command, parent=context, info_name=command.name)
    command.make_context(command.name, list(rest), parent=context.parent)
    return command


@pytest.mark.parametrize(("page", "words"), COMMANDS, ids=lambda value: value if isinstance(value, str) else value[1])
def test_command_lines_are_understood(page, words):
    parse(words)


def test_command_lines_were_found():
    assert {"README.md", "docs/quickstart.md", "docs/batch.md", "docs/viewer.md"} <= {page for page, _ in COMMANDS}


def test_wrong_command_lines_are_not():
    with pytest.raises(click.UsageError):
        parse(["grasp-planner", "plan", "--no-such-option", "1"])
    with pytest.raises(click.UsageError):
        parse(["grasp-planner", "no-such-command"])


def test_commands_named_in_the_text_exist():
    # A single capital stands for a number.
    spans = [
        re.sub(r"\b[A-Z]\b", "1", span).split()
        for page in PAGES
        for span in code_spans(page)
        if span.startswith("grasp-planner ")
    ]
    assert spans
    for words in spans:
        with contextlib.suppress(click.MissingParameter, click.BadOptionUsage):  # named without its arguments
            parse(words)


def test_files_named_in_the_documents_exist():
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for name in re.findall(r"\b((?:scripts|notebooks|tests)/[\w/]+(?:\.\w+)?)", text):
            assert (ROOT / name).exists() or name.endswith("/"), f"{page.name}: {name}"
        for name in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", text):
            assert (page.parent / name).is_file(), f"{page.name}: {name}"
        if page.name in ("README.md", "CONTRIBUTING.md"):
            for name in re.findall(r"(?<!!)\[[^\]]*\]\((?!http|#)([^)#]+)", text):
                assert (page.parent / name).exists(), f"{page.name}: {name}"


def test_the_readme_is_short():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").split()) <= 700


@pytest.mark.parametrize(("page", "synergy_set"), [("README.md", "santello"), ("docs/measured.md", "native_apart")])
def test_the_tables_beside_the_paper_are_what_reproduce_found(page, synergy_set):
    every = json.loads((ROOT / "docs" / "reproduction" / "reproduce.json").read_text(encoding="utf-8"))
    cells = [cell for cell in every if cell["synergy_set"] == synergy_set]
    text = (ROOT / page).read_text(encoding="utf-8")
    for n_s in (1, 2, 3, 15):
        expected = [str(n_s)]
        for direction in "yx":
            (cell,) = (c for c in cells if (c["table"], c["direction"], c["n_synergies"]) == (1, direction, n_s))
            for key in ("force_norm", "alignment_angle_deg"):
                expected += [f"{cell['paper'][key]:.2f}", "undefined" if cell[key] is None else f"{cell[key]:.2f}"]
        assert f"| {' | '.join(expected)} |" in text, expected


def test_descriptions_in_the_guide_are_valid():
    whole = tomllib.loads(gp.hand_library()["tendon_hand"].read_text(encoding="utf-8"))
    found = [block for page in PAGES for block in blocks(page, "toml")]
    assert len(found) >= 2
    for block in found:
        HandDescription.model_validate({**whole, **tomllib.loads(block.text)})


def test_specifications_in_the_guide_are_valid(tmp_path):
    batch = pytest.importorskip("grasp_planner.batch")
    # Recipes of Kubernetes have a test of their own.
    found = [block for page in PAGES for block in blocks(page, "yaml") if "apiVersion:" not in block.text]
    assert found
    for block in found:
        path = tmp_path / "spec.yaml"
        path.write_text(block.text, encoding="utf-8")
        table = batch.CaseTable(batch.read_spec(path))
        table.check()
        assert len(table) > 1


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1])
def test_the_quick_start_works_as_printed(number, tmp_path):
    block = blocks(ROOT / "docs" / "quickstart.md", "sh")[number]
    for words in command_lines(block):
        command = [sys.executable, "-m", "grasp_planner", *words[1:]]
        if words[1] == "view":
            check_viewer(command, tmp_path)
            continue
        # scripts/plan also names the files that it writes.
        outputs = ["--json", "grasp.json", "--picture", "grasp.png"] if words[1:] == ["plan"] else []
        finished = subprocess.run([*command, *outputs], cwd=tmp_path, capture_output=True, text=True, check=False)
        assert finished.returncode == 0, finished.stderr
    assert "--json grasp.json --picture grasp.png" in (ROOT / "scripts" / "plan").read_text(encoding="utf-8")


def check_viewer(command, folder):
    """Start the viewer, read its page and end it as Ctrl+C does."""
    viewer = interruptible([*command, "--no-open", "--port", "0"], cwd=folder)
    try:
        url = re.search(r"http://\S+[^;\s]", viewer.stdout.readline()).group()
        with urllib.request.urlopen(url, timeout=30) as answer:
            assert answer.status == 200
    finally:
        viewer.send_signal(signal.SIGINT)
        viewer.communicate(timeout=120)
    assert viewer.returncode == 0
