"""Options of the command line, made from settings."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import click

from ..problem.settings import Setting

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]
TYPES: dict[str, Any] = {"number": float, "whole": int, "text": str}


def setting_options(settings: Iterable[Setting]) -> list[Decorator]:
    """Return an option for each setting; its argument is called as its column and is None where it is left out."""
    return [_option(each) for each in settings]


def given_settings(arguments: dict[str, Any], settings: Iterable[Setting]) -> dict[str, Any]:
    """Return the settings that were given as options, by key.

    Args:
        arguments: Arguments of a command, by name.
        settings: The settings that have options.
    """
    given = {}
    for each in settings:
        value = arguments[each.column]
        if each.many and value:
            given[each.key] = each.of_text(" ".join(value))
        elif value is not None and not each.many:
            given[each.key] = value
    return given


def _option(each: Setting) -> Decorator:
    """Return the option of a setting."""
    flag = each.flag if each.kind != "truth" else f"{each.flag}/--no-{each.flag.removeprefix('--')}"
    unit = f" [{each.unit}]" if each.unit else ""
    more = " Repeatable." if each.many else f" [default: {_default(each)}]."
    form: dict[str, Any] = {
        "default": None,
        "help": f"{each.help.rstrip('.')}{unit}{more if not each.many else '.' + more}",
    }
    if each.kind == "choice":
        form["type"] = click.Choice(each.choices)
    elif each.kind != "truth":
        form["type"] = str if each.each_of else TYPES[each.kind]
    if each.many:
        form |= {"multiple": True, "default": ()}
    return click.option(flag, each.column, **form)


def _default(each: Setting) -> str:
    """Return the default of a setting in words, and that of the paper's problem if it is another one."""
    usual, paper = (each.none if value is None else each.text(value) for value in (each.default, each.paper))
    return usual if usual == paper else f"{usual}; {paper} with --paper"
