"""The documents and what is in them: fenced blocks, command lines, links to code."""

from __future__ import annotations

import importlib
import re
import shlex
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGES = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md")))
FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```\s*$", re.M | re.S)
PROGRAMS = ("grasp-planner", ".venv/bin/grasp-planner", "scripts/plan")


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    page: Path
    language: str
    text: str

    @property
    def name(self):
        """Path of the page within the project."""
        return self.page.relative_to(ROOT).as_posix()


def blocks(page, language=None):
    """Return the fenced blocks of a page, of one language if asked for."""
    found = [Block(page, *match) for match in FENCE.findall(page.read_text(encoding="utf-8"))]
    return [block for block in found if language is None or block.language == language]


def command_lines(block):
    """Return the command lines of a block that call the package, as lists of words."""
    lines = block.text.replace("\\\n", " ").splitlines()
    words = [shlex.split(line, comments=True) for line in lines if line.startswith(PROGRAMS)]
    return [["grasp-planner", "plan", *line[1:]] if line[0] == "scripts/plan" else line for line in words]


def code_spans(page):
    """Return what a page has between single backticks, outside of fenced blocks."""
    return re.findall(r"`([^`\n]+)`", FENCE.sub("", page.read_text(encoding="utf-8")))


def code_links(text):
    """Return the paths of code that a Markdown text links to."""
    return re.findall(r"\]\[(grasp_planner[\w.]*)\]", text)


def find_object(path):
    """Return what a dotted path names, however many of its first parts are modules."""
    parts = path.split(".")
    for count in range(len(parts), 0, -1):
        try:
            value = importlib.import_module(".".join(parts[:count]))
        except ModuleNotFoundError:
            continue
        for part in parts[count:]:
            value = getattr(value, part)
        return value
    raise ModuleNotFoundError(path)
