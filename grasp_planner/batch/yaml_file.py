"""Reading YAML with the line of every entry, so that errors can name it."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..exceptions import FileFormatError, cut
from ..files.text import read_text_file
from .errors import BatchDependencyError, ResultsError, SpecError

MAX_SPEC_BYTES = 5_000_000
"""Largest specification that is read."""
MAX_NODES = 1_000_000
"""Most entries of a specification, those that an alias stands for counted each time."""

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
    text, loader = _text(path), None
    try:
        loader = Loader(text)
        node = loader.get_single_node()
        lines: Lines = {}
        if node is not None:
            _walk(path, node, "", lines, itertools.count(1))
        return (None if node is None else loader.construct_document(node)), lines
    except yaml.MarkedYAMLError as error:
        line = f"line {error.problem_mark.line + 1}: " if error.problem_mark else ""
        raise ResultsError(path, f"is not valid YAML: {line}{error.problem}") from None
    except RecursionError:
        raise ResultsError(path, "is not valid YAML: nested too deeply, or an alias within its own anchor") from None
    except (yaml.YAMLError, ValueError, LookupError, AttributeError, TypeError, ArithmeticError) as error:
        # PyYAML raises all of these on values that do not fit their tag, such as !!int ""
        raise ResultsError(path, f"is not valid YAML: {cut(str(error), 200) or type(error).__name__}") from None
    finally:
        if loader is not None:
            loader.dispose()


def _text(path: Path) -> str:
    """Return the text of a file of limited size."""
    try:
        return read_text_file(path, MAX_SPEC_BYTES)
    except FileFormatError as error:
        raise ResultsError(path, error.reason) from None


def _walk(file: Path, node: Any, where: str, lines: Lines, count: Iterator[int]) -> None:
    """Note the line of a node and of everything below it, as often as aliases name it."""
    if next(count) > MAX_NODES:
        raise ResultsError(file, f"more than {MAX_NODES} entries, aliases counted as often as they are used")
    lines.setdefault(where, node.start_mark.line + 1)
    if node.id == "mapping":
        seen: set[str] = set()
        for key, value in node.value:
            if key.id != "scalar":
                raise SpecError(file, where, f"a {key.id} as a key", "a text as a key", key.start_mark.line + 1)
            inner = join(where, key.value)
            if key.value in seen:
                raise SpecError(file, inner, key.value, "a key given once", key.start_mark.line + 1)
            seen.add(key.value)
            lines[inner] = key.start_mark.line + 1
            _walk(file, value, inner, lines, count)
    elif node.id == "sequence":
        for index, item in enumerate(node.value):
            _walk(file, item, f"{where}[{index}]", lines, count)


def join(where: str, key: str | int) -> str:
    """Return the path of an entry: ``where.key`` or ``where[index]``."""
    if isinstance(key, int):
        return f"{where}[{key}]"
    return f"{where}.{key}" if where else key
