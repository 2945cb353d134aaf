"""The guide: equations lead to functions, names exist, the command reference is whole, pages need no network."""

import os
import re
import subprocess
import sys

import pytest
import yaml

import grasp_planner as gp

from .documents import PAGES, ROOT, code_links, find_object

GUIDE = ROOT / "scripts" / "guide"
THEORY = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
EQUATION = re.compile(r"\$\$(.*?)\$\$(.*?)(?=\$\$|\Z)", re.S)
NUMBERS = {1, 2, 3, 4, 5, 6, 9, 10, 11, 12, 17, 18, 21, 22, 24, 25, 26, 27, 28, 29, 30, 31, 32, 33}
"""Equations of the paper that the planner uses."""


@pytest.fixture
def hooks(monkeypatch):
    monkeypatch.syspath_prepend(str(GUIDE))


def numbered():
    """Return the numbers of each numbered equation, and the text up to the next equation."""
    for formula, text in EQUATION.findall(THEORY):
        tags = re.findall(r"\\tag\{([\d, ]+)\}", formula)
        if tags:
            yield [int(number) for number in tags[0].split(",")], text


def test_every_equation_is_there():
    assert {number for numbers, _ in numbered() for number in numbers} == NUMBERS


@pytest.mark.parametrize(("numbers", "text"), list(numbered()), ids=lambda value: str(value)[:12])
def test_equations_lead_to_functions_that_name_them(numbers, text):
    paths = code_links(text)
    assert paths
    documents = " ".join(find_object(path).__doc__ or "" for path in paths)
    assert any(re.search(rf"\({number}\)", documents) for number in numbers), (numbers, paths)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_code_that_is_linked_exists(page):
    text = page.read_text(encoding="utf-8")
    for path in code_links(text) + re.findall(r"^::: (\S+)$", text, re.M):
        find_object(path)


def test_public_names_are_in_the_reference():
    pages = [page.read_text(encoding="utf-8") for page in (ROOT / "docs" / "api").glob("*.md")]
    shown = set(re.findall(r"^::: (\S+)$", "\n".join(pages), re.M))
    for package, name in ((room, name) for room in (gp, gp.model, gp.analysis) for name in room.__all__):
        module = getattr(getattr(package, name), "__module__", "") or ""
        if module.startswith("grasp_planner."):
            assert module in shown, f"{name} of {module}"


def test_the_command_reference_has_every_option(hooks):
    reference = pytest.importorskip("commands")
    text = reference.reference()
    for path, command in reference.commands():
        section = text.split(f"## {path}\n", 1)[1].split("\n## ", 1)[0]
        for option in command.params:
            for name in option.opts if option.opts[0].startswith("-") else ():
                assert name in section, f"{path} {name}"


def test_unknown_equations_end_the_build(hooks):
    pytest.importorskip("latex2mathml")
    pytest.importorskip("mkdocs")
    from equations import as_mathml
    from mkdocs.exceptions import PluginError

    assert as_mathml(r"F = \sqrt{x} \tag{18}", block=True).count("(18)") == 1
    with pytest.raises(PluginError):
        as_mathml(r"\nosuchcommand{x}", block=False)


def test_the_citation_is_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["version"] == gp.__version__
    assert citation["license"] == "BSD-3-Clause"
    assert citation["references"][0]["title"] == "Task-Specific Grasp Selection for Underactuated Hands"


@pytest.mark.slow
def test_the_built_pages_need_no_network(tmp_path):
    pytest.importorskip("mkdocs")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    finished = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert finished.returncode == 0, finished.stderr
    pages = {path.relative_to(tmp_path).as_posix(): path.read_text() for path in tmp_path.rglob("*.html")}
    for name, html in pages.items():
        assert not re.findall(r"<(?:script|img|iframe)[^>]*src=\"?(?:https?:)?//", html), name
        assert not re.findall(r"<link[^>]*href=\"?(?:https?:)?//", html), name
        assert "arithmatex" not in html, name
    assert pages["theory.html"].count("<math") >= len(EQUATION.findall(THEORY))
    assert 'id="grasp_planner.model.compliance.contact_forces"' in pages["api/model.html"]
    assert "--clearance" in pages["commands.html"]
