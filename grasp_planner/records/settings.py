"""Settings in the JSON form: the layout, and the way there and back."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from pydantic import AliasChoices, BaseModel, Field, create_model

from ..problem.settings import Setting, settings_of

OLD_NAMES = {
    "friction": "mu",
    "structural_compliance": "C_s",
    "joint_compliance": "C_q",
    "contact_stiffness": "K_c",
    "force_weight": "w_F",
    "task_weight": "w_C",
}
"""What parameters are called in older files."""
TYPES: dict[str, Any] = {"number": float, "whole": int, "truth": bool}


def settings_layout(name: str, owner: type, base: type[BaseModel]) -> Any:
    """Return the layout of the settings of a dataclass.

    A key that is left out was not asked for when the file was written: it stands for the paper's value.

    Args:
        name: Name of the layout.
        owner: The dataclass.
        base: What it is derived from.
    """
    entries: dict[str, Any] = {each.name: (_type(each), _field(each)) for each in settings_of(owner)}
    return create_model(name, __base__=base, **entries)


def plain_settings(options: Any) -> dict[str, Any]:
    """Return the settings of a dataclass as plain values by name."""
    owner: type = type(options)
    return {each.name: _plain(each, getattr(options, each.name)) for each in settings_of(owner)}


def settings_from(owner: type, record: Any) -> Any:
    """Return the dataclass of a record of its settings.

    Raises:
        GraspPlannerError: If one is out of range.
    """
    return owner(**{each.name: each.of_plain(getattr(record, each.name)) for each in settings_of(owner)})


def _type(each: Setting) -> Any:
    """Return the type of a setting."""
    found: Any = Literal[each.choices] if each.kind == "choice" else TYPES.get(each.kind, each.plain)
    if each.each_of:
        found = found | list[float]
    if each.many and found is str:
        found = list[str]
    return found | None if each.none else found


def _field(each: Setting) -> Any:
    """Return the field of a setting."""
    unit = f"; {each.unit}" if each.unit else ""
    none = f"; null for {each.none}" if each.none else ""
    form: dict[str, Any] = {"description": f"{each.help.rstrip('.')}{unit}{none}", "default": _plain(each, each.paper)}
    if each.name in OLD_NAMES and not each.group:
        form["validation_alias"] = AliasChoices(each.name, OLD_NAMES[each.name])
    return Field(**form)


def _plain(each: Setting, value: Any) -> Any:
    """Return the plain form of a value: as JSON has it, or its text where its form is one."""
    if each.kind != "text" or value is None:
        return _lists(value)
    if each.plain is str:
        return [each.write(part) for part in value] if each.many else each.write(value)
    return np.asarray(value).tolist() if not isinstance(value, tuple) else _lists(value)


def _lists(value: Any) -> Any:
    """Return tuples as lists, at every depth."""
    return [_lists(part) for part in value] if isinstance(value, tuple) else value
