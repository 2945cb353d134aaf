"""The batch specification: what to vary and how, read from YAML and checked entry by entry."""

from __future__ import annotations

import difflib
from operator import itemgetter
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, ValidationError

from ..exceptions import GraspPlannerError, InvalidValueError, NameNotFoundError
from ..hand.loading import load_hand
from ..model.task_direction import parse_task
from .axes import AXES, AXIS_HELP, MAX_WHOLE
from .case import SETTINGS, GraspCase
from .errors import SpecError
from .yaml_file import Lines, join, read_yaml

CASE_KEYS = tuple(name for name in GraspCase.model_fields if name != "settings")
OBJECT_KEY = "object."
"""Prefix of keys that set one size of the object, such as ``object.radius``."""
MAX_CHECKED_VALUES = 5000
"""Values of an axis that are checked one by one; of more numbers the least and the largest tell for the others."""


class _Part(BaseModel):
    """Part of a specification; refuses unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Block(_Part):
    """Cases made by one rule: every product value with every other, and with every row of the zip."""

    name: str = ""
    fixed: dict[str, Any] = Field(default_factory=dict)
    product: dict[str, Any] = Field(default_factory=dict)
    zip: dict[str, Any] = Field(default_factory=dict)


class Override(_Part):
    """Values for the cases that match: ``set`` where every key of ``where`` has the value, or one of the list."""

    where: dict[str, Any] = Field(min_length=1)
    set: dict[str, Any] = Field(min_length=1)


class BatchSpec(_Part):
    """A whole specification.

    Attributes:
        description: For the reader.
        seed: Seed of all samples.
        defaults: Values of every case, unless its block says otherwise.
        blocks: Rules that make cases, in order.
        overrides: Exceptions, applied in order.
    """

    description: str = ""
    seed: Annotated[int, Field(ge=0, le=MAX_WHOLE, strict=True)] = 0
    defaults: dict[str, Any] = Field(default_factory=dict)
    blocks: tuple[Block, ...] = Field(min_length=1)
    overrides: tuple[Override, ...] = ()
    _file: Path | None = PrivateAttr(default=None)
    _lines: Lines = PrivateAttr(default_factory=dict)

    def error(self, where: str, value: object, allowed: str) -> SpecError:
        """Return the error about one entry, with its line if the specification came from a file."""
        return _error(self._file, self._lines, where, value, allowed)


def read_spec(path: Path) -> BatchSpec:
    """Read a specification.

    Args:
        path: YAML file.

    Returns:
        The specification.

    Raises:
        ResultsError: If the file can't be read or is no YAML.
        SpecError: If an entry is wrong; names its path in the file, its line, its value, and what is allowed.
    """
    data, lines = read_yaml(path)
    return parse_spec(data, file=path, lines=lines)


def parse_spec(data: Any, *, file: Path | None = None, lines: Lines | None = None) -> BatchSpec:
    """Check a specification given as plain values.

    Args:
        data: Mapping as in the YAML file.
        file: File named in errors.
        lines: Line of every entry, by its path.

    Returns:
        The specification.

    Raises:
        SpecError: If an entry is wrong.
    """
    lines = lines or {}
    if not isinstance(data, dict):
        raise _error(file, lines, "", data, f"a mapping with {', '.join(_keys(BatchSpec))}")
    try:
        spec = BatchSpec.model_validate(data)
    except ValidationError as error:
        first = _most_telling(error)
        where = _where(first["loc"])
        value, allowed = first["input"], first["msg"][:1].lower() + first["msg"][1:]
        if first["type"] == "extra_forbidden":
            value, allowed = first["loc"][-1], one_of(str(first["loc"][-1]), _keys(_owner(first["loc"])))
        elif first["type"] == "missing":
            value, allowed = None, "a value (the key is required)"
        raise _error(file, lines, where, value, allowed) from None
    spec._file, spec._lines = file, lines
    _check_blocks(spec)
    return spec


def one_of(given: str, known: tuple[str, ...]) -> str:
    """Return the text that lists what is known, and what was probably meant."""
    close = difflib.get_close_matches(given, known, n=1)
    return ("did you mean " + repr(close[0]) + "? " if close else "") + "one of " + ", ".join(known)


def check_value(spec: BatchSpec, where: str, key: str, value: Any) -> None:
    """Check one value of one key on its own.

    Args:
        spec: The specification.
        where: Path of the value.
        key: Key of a case, such as ``friction`` or ``object.radius``.
        value: The value.

    Raises:
        SpecError: If no case could have it.
    """
    if isinstance(value, dict):
        raise spec.error(where, value, "a plain value here")
    if key == "object" or key.startswith(OBJECT_KEY):
        wanted = str if key == "object" else (int, float, str)
        if not isinstance(value, wanted) or isinstance(value, bool):
            raise spec.error(where, value, "a text such as cylinder:radius=0.03" if key == "object" else "a number")
        return
    try:
        if key in CASE_KEYS:
            GraspCase.model_validate({key: value})
            if key == "hand":
                load_hand(value)
            for task in ([value] if isinstance(value, str) else value) if key == "task" else ():
                parse_task(task)
        else:
            GraspCase(settings={key: value}).check()
    except ValidationError as error:
        raise spec.error(where, value, error.errors()[0]["msg"].lower()) from None
    except InvalidValueError as error:
        raise spec.error(where, value, error.allowed) from None
    except NameNotFoundError as error:
        raise spec.error(where, value, one_of(error.name, error.known)) from None
    except (GraspPlannerError, TypeError, ValueError) as error:
        raise spec.error(where, value, str(error)) from None


def _check_blocks(spec: BatchSpec) -> None:
    """Check every key and value that is written out."""
    check_mapping(spec, "defaults", spec.defaults)
    for number, block in enumerate(spec.blocks):
        here = f"blocks[{number}]"
        check_mapping(spec, f"{here}.fixed", block.fixed)
        for part, axes in (("product", block.product), ("zip", block.zip)):
            for key, values in axes.items():
                where = join(f"{here}.{part}", key)
                check_key(spec, where, key)
                if key in block.fixed or (part == "zip" and key in block.product):
                    raise spec.error(where, key, "a key given once within a block")
                _check_axis(spec, where, key, values)
    for number, override in enumerate(spec.overrides):
        here = f"overrides[{number}]"
        for key in override.where:
            check_key(spec, join(f"{here}.where", key), key)
        check_mapping(spec, f"{here}.set", override.set)


def check_mapping(spec: BatchSpec, where: str, mapping: dict[str, Any]) -> None:
    """Check keys and values that are fixed."""
    for key, value in mapping.items():
        check_key(spec, join(where, key), key)
        check_value(spec, join(where, key), key, value)


def check_key(spec: BatchSpec, where: str, key: str) -> None:
    """Check that a key of a case exists."""
    if not key.startswith(OBJECT_KEY) and key not in (*CASE_KEYS, *SETTINGS):
        raise spec.error(where, key, one_of(key, (*CASE_KEYS, f"{OBJECT_KEY}<size>", *SETTINGS)))


def _check_axis(spec: BatchSpec, where: str, key: str, values: Any) -> None:
    """Check the values of an axis, of samples and ranges those that they give; each once."""
    given = axis_values(spec, where, values, np.random.default_rng(0))
    distinct = {repr(value): (index, value) for index, value in reversed(list(enumerate(given)))}
    for index, value in sorted(_telling(list(distinct.values())), key=itemgetter(0)):
        check_value(spec, f"{where}[{index}]" if isinstance(values, list) else where, key, value)


def _telling(entries: list[tuple[int, Any]]) -> list[tuple[int, Any]]:
    """Return the values that are checked, each with its index: all, or of too many those that tell most."""
    if len(entries) <= MAX_CHECKED_VALUES:
        return entries
    told: list[tuple[int, Any]] = []
    rest = entries
    for kind in (int, float):
        numbers = [entry for entry in rest if type(entry[1]) is kind and entry[1] == entry[1]]
        rest = [entry for entry in rest if type(entry[1]) is not kind or entry[1] != entry[1]]
        told += [end(numbers, key=itemgetter(1)) for end in (min, max) if numbers]
    return told + rest[:MAX_CHECKED_VALUES]


def axis_values(spec: BatchSpec, where: str, values: Any, rng: np.random.Generator) -> list[Any]:
    """Return the values of an axis.

    Args:
        spec: The specification.
        where: Path of the axis.
        values: What the file says: a value, a list, a range or a sample.
        rng: Random numbers of the axis.

    Returns:
        Its values, at least one.

    Raises:
        SpecError: If it is malformed.
    """
    if isinstance(values, list):
        if not values:
            raise spec.error(where, values, f"at least one value; {AXIS_HELP}")
        return values
    if not isinstance(values, dict):
        return [values]
    kind = next((model for tell, model in AXES.items() if tell in values), None)
    if kind is None:
        raise spec.error(where, values, AXIS_HELP)
    try:
        return kind.model_validate(values).values(rng)
    except ValidationError as error:
        first = _most_telling(error)
        key, value, allowed = first["loc"][:1], first["input"], first["msg"].removeprefix("Value error, ")
        if first["type"] == "extra_forbidden":
            value, allowed = key[0], one_of(str(key[0]), tuple(f.alias or n for n, f in kind.model_fields.items()))
        elif first["type"] == "missing":
            allowed = f"a value for {first['loc'][-1]!r}" if len(first["loc"]) == 1 else "[low, high]"
            key = key if len(first["loc"]) > 1 else ()
        raise spec.error(join(where, str(key[0])) if key else where, value, allowed[:1].lower() + allowed[1:]) from None


def _most_telling(error: ValidationError) -> Any:
    """Return the first entry of an error; unknown keys first, as a key is often missing because it is misspelt."""
    return min(error.errors(), key=lambda entry: entry["type"] != "extra_forbidden")


def _error(file: Path | None, lines: Lines, where: str, value: object, allowed: str) -> SpecError:
    """Return an error with the line of the nearest entry that has one."""
    known = where
    while known and known not in lines:
        known = known[: max(known.rfind("."), known.rfind("["), 0)]
    return SpecError(file, where, value, allowed, lines.get(known))


def _keys(model: type[BaseModel]) -> tuple[str, ...]:
    """Return the keys of a part of the specification."""
    return tuple(model.model_fields)


def _owner(loc: tuple[int | str, ...]) -> type[BaseModel]:
    """Return the part of the specification in which a key was refused."""
    parts: dict[str, type[BaseModel]] = {"blocks": Block, "overrides": Override}
    return parts.get(str(loc[0]), BatchSpec) if len(loc) > 1 else BatchSpec


def _where(loc: tuple[int | str, ...]) -> str:
    """Return the path of an entry."""
    where = ""
    for part in loc:
        where = join(where, part)
    return where
