"""What follows from a hand check: a description file to correct, and a report."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

from .check import HandCheck
from .description import HandDescription

GUESSES = {
    "palm": "derived: where the fingertips go when the fingers close, what they close around, what they hold",
    "compliance": "the numbers of [Mavrogiannis2014]: C_q [rad/(N m)], C_s [m/N], K_c [N/m]",
    "contact_sets.opposed": "derived: the fingers that hold an object between them, the first set is the default",
    "contact_sets.sphere": "derived: balls that fit the last links where they close, the opposing finger first",
    "collision": "derived: neighbours, and links that overlap with the hand open",
    "couplings": "what joints follow in place of their <mimic>: none, or another joint",
    "tendons.motors": "one motor winds up a tendon; of the moment arms [m] only those relative to each other are known",
    "locked": "joints before the palm, with their values [rad or m]",
    "synergies": "made from the geometry; `motors` has one for each joint",
}
"""Comments of the tables of a derived description."""
FEWEST_HARD = 3
"""Fewest contacts that hold an object without torsion."""
LONGEST_LINE = 1000
"""Most characters of a line of the report."""


def proposed_description(check: HandCheck, folder: Path | None = None, planned: HandDescription | None = None) -> str:
    """Return the text of a description file (TOML) for a hand.

    Args:
        check: A check without errors.
        folder: Folder the file will be in; that of the URDF if left out.
        planned: A description whose contact sets are written in place of those of the check.

    Returns:
        The text; what is derived says so, repairs stand at its head.
    """
    assert check.description is not None
    beside = folder is None or folder.resolve() == check.path.parent.resolve()
    description = check.description
    if planned is not None:
        description = description.model_copy(update={"contact_sets": planned.contact_sets})
    if not beside:
        description = description.model_copy(update={"urdf": str(check.path.resolve())})
    head = [f"# Derived from {check.path.name}; correct what is wrong. SI units: m, rad, N."]
    head += [f"# repair: {line}" for line in check.repairs]
    return "\n".join(head) + "\n" + description_text(description, GUESSES)


def description_text(description: HandDescription, comments: dict[str, str] | None = None) -> str:
    """Return a description as TOML, which :func:`~grasp_planner.hand.description.read_hand_description` reads back.

    Args:
        description: The description.
        comments: Comments of its tables, by name.

    Returns:
        The text.
    """
    data = description.model_dump(mode="json", exclude_none=True, exclude_defaults=True)
    return "\n".join(_table("", data, comments or {})) + "\n"


def _table(name: str, data: dict[str, Any], comments: dict[str, str]) -> list[str]:
    """Return the lines of a table and of those within it."""
    plain = {key: value for key, value in data.items() if not (isinstance(value, dict) and _own_header(name))}
    lines = []
    if name and (plain or not data):
        comment = f" # {comments[name]}" if name in comments else ""
        lines += ["", f"[{name}]{comment}"]
    lines += [f"{_key(key)} = {_value(value)}" for key, value in plain.items()]
    for key, value in data.items():
        if key not in plain:
            lines += _table(f"{name}.{_key(key)}" if name else _key(key), value, comments)
    return lines


def _own_header(name: str) -> bool:
    """Return whether tables within one stand under headers of their own; contacts, couplings stand on a line each."""
    return not name.startswith("contact_sets.") and name != "couplings"


def _key(key: str) -> str:
    """Return a key, quoted where it has to be."""
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else json.dumps(key)


def _value(value: Any) -> str:
    """Return a value."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {_value(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, list):
        if value and isinstance(value[0], list):
            return "[\n" + "".join(f"  {_value(entry)},\n" for entry in value) + "]"
        return "[" + ", ".join(_value(entry) for entry in value) + "]"
    return json.dumps(value, ensure_ascii=False)


def report_lines(check: HandCheck) -> list[str]:
    """Return the findings as lines of text."""
    lines = [f"{check.path}: {check.name}, {len(check.joints)} moving joints, {len(check.fingers)} fingers"]
    lines += [f"repair: {line}" for line in check.repairs]
    for finger in check.fingers:
        lines.append(f"finger {finger.name}: {' → '.join(finger.joints)}")
        for tip in finger.tips:
            lines.append(f"  tip {tip.frame} + {list(tip.offset)} m, radius {tip.radius:g} m ({tip.reason})")
    for joint in check.joints:
        follows = f", follows {joint.mimics}" if joint.mimics else ""
        lines.append(f"joint {joint.name}: {joint.lower:.4g} … {joint.upper:.4g}{follows}")
    if check.description is not None:
        palm = check.description.palm
        lines.append(
            f"palm {palm.link}: normal {list(palm.normal)}, closing axis {list(palm.closing_axis)}, "
            f"grasp centre {list(palm.grasp_centre)} m"
        )
    lines += [f"note: {line}" for line in check.notes]
    lines += [f"missing: {line}" for line in check.missing]
    lines += [f"error: {line}" for line in check.errors]
    return [_one_line(line) for line in (*lines, *_first_grasp(check))]


def _first_grasp(check: HandCheck) -> list[str]:
    """Return the line that says how a first grasp is planned; none of a check with errors."""
    if check.description is None:
        return []
    count = len(next(iter(check.description.contact_sets.values())))
    return [
        f"first grasp: {first_command(check)}" if count > 1 else "first grasp: none, a single contact holds nothing"
    ]


def _one_line(text: str) -> str:
    """Return a line without control characters, which XML allows in names, and of bounded length."""
    plain = "".join(character if character.isprintable() else "?" for character in text)
    return plain if len(plain) <= LONGEST_LINE else plain[: LONGEST_LINE - 1] + "…"


def first_command(check: HandCheck) -> str:
    """Return the command that plans a first grasp, of an object in size for the hand; for a check without errors."""
    assert check.derived is not None
    locks = [f"--lock {name}={value:g}" for name, value in check.derived.description.locked.items() if value != 0.0]
    thing = check.derived.first_object()
    words = ["grasp-planner plan --hand", shlex.quote(str(check.path)), *locks, "--object", thing]
    assert check.description is not None
    few = len(next(iter(check.description.contact_sets.values()))) < FEWEST_HARD
    return " ".join([*words, "--contact-model soft"] if few else words)
