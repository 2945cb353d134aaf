"""MkDocs hook: the command reference, made from the command line itself whenever the guide is built.

Registered in mkdocs.yml; replaces the line MARK of a page.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import Any

import click

from grasp_planner.cli.main import main

MARK = "<!-- commands -->"
PROGRAM = "grasp-planner"
NOTES = re.compile(r"\s*\[(default: [^\]]*|required|[^\]]*x[<>][^\]]*)\]\.?")
"""What is said in brackets at the end of a help text: defaults and ranges."""


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Return the Markdown of a page with the reference in place of the mark."""
    return markdown.replace(MARK, reference()) if MARK in markdown else markdown


def reference() -> str:
    """Return the reference of every command as Markdown."""
    return "\n".join(line for path, command in commands() for line in _section(path, command))


def commands(group: click.Group = main, path: tuple[str, ...] = (PROGRAM,)) -> Iterator[tuple[str, click.Command]]:
    """Yield every command that does something, with the words that call it."""
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None, name
        if isinstance(command, click.Group):
            yield from commands(command, (*path, name))
        else:
            yield " ".join((*path, name)), command


def _section(path: str, command: click.Command) -> Iterator[str]:
    """Yield the lines of one command."""
    context = click.Context(command, info_name=path)
    yield from (f"## {path}", "", _escaped(inspect.cleandoc(command.help or "")), "")
    yield from ("```text", " ".join([path, *command.collect_usage_pieces(context)]), "```", "")
    yield from ("| option | meaning | default |", "| --- | --- | --- |")
    for option in command.params:
        if isinstance(option, click.Option):
            yield _row(option, context)
    yield ""


def _row(option: click.Option, context: click.Context) -> str:
    """Return the table row of an option."""
    record = option.get_help_record(context)
    assert record is not None, option.name
    names, text = record
    notes = NOTES.findall(text)
    parts = [part for note in notes for part in note.split("; ")]
    default = next((part.removeprefix("default: ") for part in parts if part.startswith("default: ")), "")
    meaning = [_escaped(NOTES.sub("", text).strip())]
    meaning += [f"`{part}`" for part in parts if "x<" in part or "x>" in part]
    meaning += ["**Required.**"] if option.required else []
    cells = (f"`{names}`".replace("|", "\\|"), " ".join(filter(None, meaning)), f"`{default}`" if default else "")
    return f"| {' | '.join(cells)} |"


def _escaped(text: str) -> str:
    """Return a help text as Markdown."""
    return re.sub(r"([\[\]|*_<>])", r"\\\1", " ".join(text.split()) if "\n\n" not in text else text)
