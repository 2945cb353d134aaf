"""The rows of a study of synergies: what is kept of every planned and simulated problem, in memory and on disk."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..simulate import Survival

COLUMNS = {
    "row": "int64",
    "status": "string",
    "message": "string",
    "synergy_set": "string",
    "object_kind": "string",
    "n_synergies": "int64",
    "seed": "int64",
    "feasible": "bool",
    "refused": "bool",
    "passed": "bool",
    "forces_held": "int64",
    "weakest_force": "double",
    "rest_held": "bool",
    "rest_displacement": "double",
    "normal_force_error": "double",
    "margins": "list<struct<name: string, value: double>>",
    "survival": "list<struct<name: string, survived: int64, tried: int64, worst: string>>",
}
"""Columns of the rows on disk: ``status`` is done, error, timeout or crashed; the others as in :class:`StudyRow`."""
Key = tuple[str, str, int, int]
"""Synergy set, kind of object, number of synergies, seed."""


@dataclass(frozen=True)
class StudyRow:
    """One planned and simulated problem.

    Attributes:
        synergy_set: Name of the set.
        object_kind: Kind of object.
        n_synergies: n_s.
        seed: Seed of the problem and of its starts.
        feasible: Whether a feasible grasp was found; if not, the rest is None.
        refused: Whether the penetration gate refused it; if so, nothing was simulated.
        passed: Whether all six forces were held.
        forces_held: How many of them were.
        weakest_force: Load held in the weakest direction [N].
        rest_held: Whether the object was still within the limits at rest.
        rest_displacement: Of the object at rest [m].
        normal_force_error: Of the simulated normal forces at rest, relative to F.
        margins: Static margins by name, of the grasp as simulated; None where undefined.
        survival: What of closing survives errors; None if that was not asked for.
        message: Why there is no answer, if the case ended in an error, at its time limit or with its worker.
    """

    synergy_set: str
    object_kind: str
    n_synergies: int
    seed: int
    feasible: bool
    refused: bool | None = None
    passed: bool | None = None
    forces_held: int | None = None
    weakest_force: float | None = None
    rest_held: bool | None = None
    rest_displacement: float | None = None
    normal_force_error: float | None = None
    margins: dict[str, float | None] | None = None
    survival: tuple[Survival, ...] | None = None
    message: str | None = None

    @property
    def key(self) -> Key:
        """Which case it is."""
        return self.synergy_set, self.object_kind, self.n_synergies, self.seed


def load_study(folder: Path) -> list[StudyRow]:
    """Return the rows of a study that are there, in the order of their numbers.

    Raises:
        BatchDependencyError: If the extra ``batch`` is not installed.
        FileFormatError: If there is no study.
    """
    from ..batch.results import load_table

    rows = []
    for values in load_table(folder).to_pylist():
        margins = values["margins"]
        known = {name: value for name, value in values.items() if name not in ("row", "status", "margins", "survival")}
        named = None if margins is None else {entry["name"]: entry["value"] for entry in margins}
        tried = values.get("survival")
        closed = None if tried is None else tuple(Survival(**entry) for entry in tried)
        rows.append(StudyRow(**known, margins=named, survival=closed))
    return rows


def row_values(row: int, found: StudyRow, status: str) -> dict[str, Any]:
    """Return the row on disk."""
    margins = None if found.margins is None else [{"name": k, "value": v} for k, v in found.margins.items()]
    return {"row": row, "status": status, **asdict(found), "margins": margins}
