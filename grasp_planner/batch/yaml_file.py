"""Reading YAML with the line of every entry, so that errors can name it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from ..exceptions import FileFormatError
from ..files.text import read_text_file
from .errors import BatchDependencyError, ResultsError, SpecError

MAX_SPEC_BYTES = 5_000_000
"""Largest specification that is read."""

Lines = dict[str, int]
"""Line of every entry, from 1, by its path inside the file."""


def read_yaml(path: Path) -> tuple[Any, Lines]:
    """Read a YAML file.

    Numbers such as ``1e-6`` are numbers (YAML 1.2), and a key given twice is an error.

    Args:
        path: The file.

    Returns:
        Its content, and the line of every entry.

    Raises:
        ResultsError: If it can't be read or is no YAML; the reason names the line.
        SpecError: If a key is given twice.
    """
    try:
        import yaml
    except ImportError:
        raise BatchDependencyError("pyyaml") from None

    class Loader(yaml.SafeLoader):
        """Safe loader with the floating-point numbers of YAML 1.2."""

    number = re.compile(r"^[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?$")
    Loader.yaml_implicit_resolvers = {
        first: [(tag, pattern) for tag, pattern in resolvers if tag != "tag:yaml.org,2002:float"]
        for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }
    Loader.add_implicit_resolver("tag:yaml.org,2002:float", number, list("-+0123456789."))
    loader = Loader(_text(path))
    try:
        node = loader.get_single_node()
        lines: Lines = {}
        if node is not None:
            _walk(path, node, "", lines)
        return (None if node is None else loader.construct_document(node)), lines
    except yaml.MarkedYAMLError as error:
        line = f"line {error.problem_mark.line + 1}: " if error.problem_mark else ""
        raise ResultsError(path, f"is not valid YAML: {line}{error.problem}") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ResultsError(path, f"is not valid YAML: {error}") from None
    finally:
        loader.dispose()


def _text(path: Path) -> str:
    """Return the text of a file of limited size."""
    try:
        return read_text_file(path, MAX_SPEC_BYTES)
    except FileFormatError as error:
        raise ResultsError(path, error.reason) from None


def _walk(file: Path, node: Any, where: str, lines: Lines) -> None:
    """Note the line of a node and of everything below it."""
    lines.setdefault(where, node.start_mark.line + 1)
    if node.id == "mapping":
        seen: set[str] = set()
        for key, value in node.value:
            inner = join(where, str(key.value))
            if key.value in seen:
                raise SpecError(file, inner, key.value, "a key given once", key.start_mark.line + 1)
            seen.add(key.value)
            lines[inner] = key.start_mark.line + 1
            _walk(file, value, inner, lines)
    elif node.id == "sequence":
        for index, item in enumerate(node.value):
            _walk(file, item, f"{where}[{index}]", lines)


def join(where: str, key: str | int) -> str:
    """Return the path of an entry: ``where.key`` or ``where[index]``."""
    if isinstance(key, int):
        return f"{where}[{key}]"
    return f"{where}.{key}" if where else key
