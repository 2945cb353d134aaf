"""The rooms of the package, from the lowest up: the one list that layer rule, picture and CONTRIBUTING are made from.

What a room holds is said by the first line of its docstring; which room uses which, by the imports in the source.
"""

from __future__ import annotations

import ast
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "grasp_planner"

ROOMS = (
    "exceptions",
    "values",
    "spatial",
    "checks",
    "files",
    "processes",
    "optimisation",
    "synergies",
    "hand",
    "objects",
    "collision",
    "model",
    "problem",
    "evaluation",
    "multistart",
    "judge",
    "closing",
    "terms",
    "grasp",
    "planning",
    "analysis",
    "records",
    "drawing",
    "synergy_design",
    "simulate",
    "batch",
    "studies",
    "viewer",
    "cli",
)
"""A room (a folder, or a module at the root) imports only those before it."""

FILES = sorted(PACKAGE.rglob("*.py"))


def room_of(path: Path) -> str:
    """Return the room that a file of the package stands in."""
    return path.relative_to(PACKAGE).with_suffix("").parts[0]


def files_of(room: str) -> list[Path]:
    """Return the files of a room."""
    return [path for path in FILES if room_of(path) == room]


def note_of(room: str) -> str:
    """Return what a room holds: the first line of its docstring."""
    path = PACKAGE / room / "__init__.py" if (PACKAGE / room).is_dir() else PACKAGE / f"{room}.py"
    return (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").splitlines()[0]


def imports_of(path: Path) -> set[Path]:
    """Return the files of the package that a file imports, wherever in it."""
    folder = path.relative_to(PACKAGE).parent.parts
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = PACKAGE.joinpath(*folder[: len(folder) - node.level + 1], *(node.module or "").split("."))
            found |= {_file(base / alias.name) or _file(base) for alias in node.names}
    return {file for file in found if file is not None and file != PACKAGE / "__init__.py"}


def _file(module: Path) -> Path | None:
    """Return the file of a module, if there is one."""
    candidates = (module.with_suffix(".py"), module / "__init__.py")
    return next((path for path in candidates if path.is_file()), None)


def uses() -> dict[str, set[str]]:
    """Return the rooms that each room imports."""
    return {room: {room_of(used) for path in files_of(room) for used in imports_of(path)} - {room} for room in ROOMS}


def circles() -> list[list[Path]]:
    """Return circles of files that import each other, the first found from each file."""
    graph = {path: imports_of(path) for path in FILES}
    done: set[Path] = set()

    def visit(path: Path, trail: list[Path]) -> list[Path] | None:
        if path in trail:
            return [*trail[trail.index(path) :], path]
        if path in done:
            return None
        found = next((c for used in sorted(graph[path]) if (c := visit(used, [*trail, path]))), None)
        done.add(path)
        return found

    return [circle for path in FILES if (circle := visit(path, []))]
