"""The public names of a package, listed once in its stub ``__init__.pyi``, each imported when it is first used.

Type checkers, editors and the reference read the stub; at run time its imports are found without doing them
(PEP 562), so that importing the package costs nothing for what is not used.
"""

from __future__ import annotations

import ast
import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any


def listed_names(stub: Path) -> dict[str, tuple[str, str | None]]:
    """Return what a stub file imports from its own package.

    Args:
        stub: File of lines ``from .module import name as name`` or ``from . import module as module``.

    Returns:
        For each name, relative name of the module and name within it; None if the name is the module.
    """
    found: dict[str, tuple[str, str | None]] = {}
    for node in ast.parse(stub.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom) and node.level:
            dots = "." * node.level
            for alias in node.names:
                source = (dots + node.module, alias.name) if node.module else (dots + alias.name, None)
                found[alias.asname or alias.name] = source
    return found


def public_names(package: str, file: str) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """Return ``__all__``, ``__getattr__`` and ``__dir__`` of a package out of the stub beside it.

    Args:
        package: Its ``__name__``.
        file: Its ``__file__``; the stub is ``__init__.pyi`` in the same folder.

    Returns:
        Sorted public names, the function that imports one, and the function that lists them.
    """
    sources = listed_names(Path(file).with_suffix(".pyi"))
    names = sorted(sources)

    def imported(name: str) -> Any:
        if name not in sources:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module, attribute = sources[name]
        loaded = importlib.import_module(module, package)
        return loaded if attribute is None else getattr(loaded, attribute)

    return names, imported, lambda: names
