"""Settings: what a field of a problem or a search is, said once, where the field is declared.

From these descriptions the command line, the JSON form, the batch and the viewer make their own forms of the fields;
the dataclasses check their values by them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import Any, Literal

import numpy as np

from ..checks import positive_definite
from ..exceptions import InvalidValueError, NameNotFoundError

Kind = Literal["number", "whole", "truth", "choice", "text"]
_KEY = "setting"


@dataclass(frozen=True)
class Setting:
    """One field that a user may set.

    Attributes:
        help: What it is, in one line.
        kind: number, whole number, truth value, one of :attr:`choices`, or anything else that has a text form.
        unit: Its unit; empty for none.
        low: Least value, of every number in it.
        high: Largest value.
        above: Whether the value has to be more than :attr:`low`.
        choices: What may be chosen.
        none: What None stands for; empty where None is not allowed.
        step: Step of its number input; None where its values span decades, so that it is typed.
        option: Option of the command line, where it is not the name with dashes.
        many: Whether it is a tuple of values, given one by one.
        matrix: Whether it may also be a symmetric positive definite matrix; as text its rows with semicolons.
        each_of: Whether a number may be given for each of something, by its name; as text with commas.
        read: Makes the value, of ``many`` one of them, from its text.
        write: Makes the text.
        plain: Type of its JSON form.
        name: Name of the field.
        group: Field of the problem that holds it, as ``loads.``; empty if its name needs none.
        default: Its default.
        paper: Its default in the paper's problem, where it is another one.
    """

    help: str
    kind: Kind
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    above: bool = False
    choices: tuple[str, ...] = ()
    none: str = ""
    step: float | None = None
    option: str = ""
    many: bool = False
    matrix: bool = False
    each_of: str = ""
    read: Callable[[str], Any] = str
    write: Callable[[Any], str] = str
    plain: Any = str
    name: str = ""
    group: str = ""
    default: Any = None
    paper: Any = None

    @property
    def key(self) -> str:
        """Its name in a batch and in errors: ``friction``, ``loads.force``."""
        return self.group + self.name

    @property
    def column(self) -> str:
        """Its key as one word: ``loads_force``."""
        return self.key.replace(".", "_")

    @property
    def flag(self) -> str:
        """Its option of the command line."""
        return self.option or "--" + self.name.replace("_", "-")

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        unit = f" {self.unit}" if self.unit else ""
        if self.kind == "truth":
            words = "true or false"
        elif self.kind in ("number", "whole") or math.isfinite(self.high):
            what = {"number": "a finite number", "whole": "a whole number"}.get(self.kind, "finite numbers")
            low = f" {'>' if self.above else '>='} {self.low:g}" if math.isfinite(self.low) else ""
            high = f"{' and' if low else ''} <= {self.high:g}" if math.isfinite(self.high) else ""
            several = f", or one for each {self.each_of}" if self.each_of else ""
            matrix = ", or a symmetric positive definite matrix" if self.matrix else ""
            words = f"{what}{low}{high}{unit}{several}{matrix}"
        else:
            words = "a text"
        return f"{words}, or none for {self.none}" if self.none else words

    def checked(self, value: Any) -> Any:
        """Return a value as the field holds it.

        Raises:
            InvalidValueError: If it is out of range or of another kind.
            NameNotFoundError: If it is none of the choices.
        """
        if value is None and self.none:
            return None
        if self.kind == "choice" and value not in self.choices:
            raise NameNotFoundError(self.key, str(value), self.choices)
        if self.kind == "truth" and not isinstance(value, bool):
            raise InvalidValueError(self.key, value, self.allowed)
        if self.kind == "whole" and (isinstance(value, bool) or not isinstance(value, int | np.integer)):
            raise InvalidValueError(self.key, value, self.allowed)
        if self.kind in ("number", "whole") or (self.kind == "text" and math.isfinite(self.high)):
            numbers = self._numbers(value)
            if self.kind == "number":
                if numbers.ndim > bool(self.each_of) or not numbers.size:
                    raise InvalidValueError(self.key, value, self.allowed)
                return tuple(numbers.tolist()) if numbers.ndim else float(value)
            if self.kind == "whole":
                return int(value)
        return value

    def of_plain(self, value: Any) -> Any:
        """Return the value of its plain form: a text, or a value of JSON or YAML."""
        if isinstance(value, str) and (self.kind == "text" or self.each_of):
            return self.of_text(value)
        return _tuples(value)

    def of_text(self, text: str) -> Any:
        """Return the value of a text.

        Raises:
            InvalidValueError: If it is malformed.
        """
        if not text.strip() and self.none:
            return None
        if self.many:
            return tuple(self.read(part) for part in text.split())
        if self.kind in ("number", "whole"):
            try:
                if self.each_of and "," in text:
                    return tuple(float(part) for part in text.split(","))
                return float(text) if self.kind == "number" else int(text)
            except ValueError:
                raise InvalidValueError(self.key, text, self.allowed) from None
        return self.read(text)

    def text(self, value: Any) -> str:
        """Return the text of a value; empty for None."""
        if value is None:
            return ""
        if self.many:
            return " ".join(self.write(part) for part in value)
        if self.kind == "truth":
            return "yes" if value else "no"
        if isinstance(value, tuple) and self.each_of:
            return text_of_numbers(value)
        return f"{value:g}" if self.kind in ("number", "whole") else self.write(value)

    def _numbers(self, value: Any) -> np.ndarray:
        """Return the numbers of a value, all in range."""
        try:
            given = np.asarray(value)
        except ValueError:  # rows of different length
            raise InvalidValueError(self.key, value, self.allowed) from None
        if given.dtype.kind not in "iuf":  # neither texts nor truth values
            raise InvalidValueError(self.key, value, self.allowed)
        numbers = given.astype(float)
        if self.matrix and numbers.ndim == 2:
            if not (np.abs(numbers) <= self.high).all():
                raise InvalidValueError(self.key, value, self.allowed)
            return positive_definite(self.key, numbers, len(numbers))
        below = numbers <= self.low if self.above else numbers < self.low
        if not np.isfinite(numbers).all() or below.any() or (numbers > self.high).any():
            raise InvalidValueError(self.key, value, self.allowed)
        return numbers


def setting(default: Any, help: str, **form: Any) -> Any:
    """Return a field of a dataclass that is a setting.

    Args:
        default: Its default, or a function without arguments that makes it.
        help: What it is, in one line.
        **form: Further attributes of :class:`Setting`; the kind follows from the default if left out.
    """
    value = default() if callable(default) else default
    kinds = {bool: "truth", int: "whole", float: "number"}
    form.setdefault("kind", "choice" if form.get("choices") else kinds.get(type(value), "text"))
    metadata = {_KEY: Setting(help=help, default=value, **form)}
    if callable(default):
        return field(default_factory=default, metadata=metadata)
    return field(default=default, metadata=metadata)


@cache
def settings_of(owner: type) -> tuple[Setting, ...]:
    """Return the settings of a dataclass, in the order of its fields.

    Its attribute ``settings_group`` says which field of the problem holds it; ``off()`` makes the paper's.
    """
    off = owner.off() if hasattr(owner, "off") else None
    group = getattr(owner, "settings_group", "")
    found = []
    for each in fields(owner):
        if (described := each.metadata.get(_KEY)) is not None:
            paper = described.paper
            if paper is None:
                paper = described.default if off is None else getattr(off, each.name)
            found.append(replace(described, name=each.name, group=group, paper=paper))
    return tuple(found)


def check_settings(values: Any) -> None:
    """Check every setting of a dataclass and bring it to its form; to be called from ``__post_init__``.

    Raises:
        GraspPlannerError: If one is out of range; names it.
    """
    for each in _named_settings(values.__class__):
        object.__setattr__(values, each.name, each.checked(getattr(values, each.name)))


@cache
def _named_settings(owner: type[Any]) -> tuple[Setting, ...]:
    """Return the settings of a dataclass as they are declared, with name and group."""
    group = getattr(owner, "settings_group", "")
    described = ((each.name, each.metadata.get(_KEY)) for each in fields(owner))
    return tuple(replace(setting, name=name, group=group) for name, setting in described if setting is not None)


def numbers_of_text(text: str) -> tuple[float, ...]:
    """Return the numbers of a text such as ``0,0,-9.81``.

    Raises:
        InvalidValueError: If it is malformed.
    """
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InvalidValueError("numbers", text, "numbers separated by commas") from None


def rows_of_text(text: str) -> Any:
    """Return the numbers of a text such as ``0.1`` or ``0.1,0.2``, or the rows of one such as ``0.2,0;0,0.1``.

    Raises:
        InvalidValueError: If it is malformed.
    """
    if ";" in text:
        return tuple(numbers_of_text(row) for row in text.split(";"))
    numbers = numbers_of_text(text)
    return numbers[0] if len(numbers) == 1 else numbers


def text_of_rows(values: Any) -> str:
    """Return numbers as a text with commas, the rows of a matrix with semicolons."""
    return ";".join(text_of_numbers(row) for row in values) if np.ndim(values) == 2 else text_of_numbers(values)


def text_of_numbers(values: Any) -> str:
    """Return numbers as a text with commas."""
    return ",".join(f"{value:.12g}" for value in np.atleast_1d(values))


def _tuples(value: Any) -> Any:
    """Return lists as tuples, at every depth."""
    return tuple(_tuples(part) for part in value) if isinstance(value, list | tuple) else value
