"""One row for one case: its columns, and how they are filled from a grasp or from what went wrong."""

from __future__ import annotations

import functools
import json
import math
import platform
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from ..exceptions import GraspPlannerError
from ..grasp.grasp import Grasp
from ..hand.hand import Hand
from ..hand.loading import load_hand
from ..records.grasp_record import grasp_record
from ..records.layout import GraspRecord
from .case import GraspCase, column_types

Row = dict[str, Any]
"""Values by column; plain numbers, texts and lists, None where there is none."""

RUN_COLUMNS = ("time_s", "time_cpu_s", "time_total_s", "started_utc", "worker", "attempts", "versions")
"""Columns that depend on the machine or the moment; all others depend on the case alone."""

_SETTING_TYPE = {bool: "bool", int: "int64", float: "double", str: "string"}


def columns() -> dict[str, str]:
    """Return the type of every column, by name, in order; what they mean is in ``docs/batch.md``."""
    return {
        "row": "int64",
        "case_id": "string",
        "spec_hash": "string",
        "status": "string",
        "reason": "string",
        "message": "string",
        "feasible": "bool",
        "hand": "string",
        "object": "string",
        "object_kind": "string",
        "task": "string",
        "n_synergies": "int64",  # here for its place; it is one of the settings below
        "seed": "int64",
        "time_limit_s": "double",
        "memory_limit_mb": "double",
        **{name: _SETTING_TYPE[kind] for name, kind in column_types().items()},
        "settings": "string",
        **_METRICS,
        **_GRASP,
        "time_s": "double",
        "time_cpu_s": "double",
        "time_total_s": "double",
        "started_utc": "string",
        "worker": "string",
        "attempts": "int64",
        "version": "string",
        "versions": "string",
        "record": "string",
    }


_METRICS = {
    "objective": "double",
    "force_norm": "double",
    "force_norm_floor": "double",
    "task_index": "double",
    "transmission_ratios": "list<double>",
    "alignment_angle_deg": "double",
    "alignment_degenerate": "bool",
    "force_closed": "bool",
    "force_closure_margin": "double",
    "iterations": "int64",
    "phase_one_iterations": "int64",
    "evaluations": "int64",
    "starts_tried": "int64",
    "starts_feasible": "int64",
    "worst_violation": "string",
    "worst_violation_value": "double",
    "worst_violation_unit": "string",
    "violations": "list<struct<name: string, value: double, unit: string>>",
}
_GRASP = {
    "joint_names": "list<string>",
    "joint_angles": "list<double>",
    "reference_joint_angles": "list<double>",
    "joint_torques": "list<double>",
    "sigma": "list<double>",
    "delta_sigma": "list<double>",
    "palm_position": "list<double>",
    "palm_quaternion_xyzw": "list<double>",
    "contact_names": "list<string>",
    "contact_points": "list<list<double>>",
    "contact_normals": "list<list<double>>",
    "contact_gaps": "list<double>",
    "contact_forces": "list<list<double>>",
    "normal_forces": "list<double>",
    "friction_margins": "list<double>",
}
_CONTACT_KEYS = {
    "contact_names": "name",
    "contact_points": "point",
    "contact_normals": "normal",
    "contact_gaps": "gap",
    "contact_forces": "force",
    "normal_forces": "normal_force",
    "friction_margins": "friction_margin",
}


def case_row(row: int, case: GraspCase, spec_hash: str) -> Row:
    """Return the row of a case before it is planned; every other column is None.

    Args:
        row: Number of the case.
        case: The case.
        spec_hash: Hash of all cases of the run.
    """
    values: Row = dict.fromkeys(columns())
    values.update(
        row=row,
        case_id=case.case_id,
        spec_hash=spec_hash,
        feasible=False,
        hand=case.hand,
        object=case.object,
        object_kind=case.object.partition(":")[0],
        task=" + ".join(case.task),
        seed=case.seed,
        time_limit_s=case.time_limit_s,
        memory_limit_mb=case.memory_limit_mb,
        settings=json.dumps(case.settings, sort_keys=True),
        version=_versions()["grasp_planner"],
        versions=json.dumps(_versions()),
    )
    values.update(case.columns(_hand(case.hand)))
    return values


@functools.cache
def _hand(name: str) -> Hand | None:
    """Return a hand, loaded once; None if it can't be."""
    try:
        return load_hand(name)
    except GraspPlannerError:
        return None


def add_grasp(values: Row, grasp: Grasp) -> None:
    """Fill a row from a planned grasp.

    Args:
        values: The row, changed in place.
        grasp: The grasp.
    """
    record = grasp_record(grasp)
    values["time_s"] = record.time_s
    if record.hand_source is not None:  # not in every row: a run has its hands by name
        record = record.model_copy(update={"hand_source": record.hand_source.model_copy(update={"texts": {}})})
    # The time is kept in its column only, so that equal grasps have equal records.
    values["record"] = record.model_copy(update={"time_s": 0.0}).model_dump_json()
    plain = json.loads(values["record"])
    for name in (*_METRICS, *_GRASP):
        if name in plain and name not in ("violations", "task"):
            values[name] = plain[name]
    violations = tuple(grasp.violations.values())
    worst = next(iter(grasp.failures().values()), None)
    largest = worst or max(violations, key=lambda found: found.value)
    values.update(
        status=record.status,
        feasible=record.feasible,
        message=record.message,
        reason=None if record.feasible else worst.name if worst else "not force-closed",
        worst_violation=largest.name,
        worst_violation_value=_finite(largest.value),
        worst_violation_unit=largest.unit.symbol,
        violations=[{"name": v.name, "value": _finite(v.value), "unit": v.unit.symbol} for v in violations],
        palm_position=plain["palm_pose"]["position"],
        palm_quaternion_xyzw=plain["palm_pose"]["quaternion_xyzw"],
    )
    for column, key in _CONTACT_KEYS.items():
        values[column] = [contact[key] for contact in plain["contacts"]]


def add_failure(values: Row, status: str, reason: str, message: str) -> None:
    """Fill a row of a case that gave no grasp.

    Args:
        values: The row, changed in place.
        status: ``error``, ``timeout``, ``memory`` or ``crashed``.
        reason: A short name to count by.
        message: One line that says what happened.
    """
    values.update(status=status, reason=reason, message=message, feasible=False)


def record_of(values: Row) -> GraspRecord | None:
    """Return the grasp record of a row, with its time; None if there is no grasp."""
    if values.get("record") is None:
        return None
    record = GraspRecord.model_validate_json(values["record"])
    return record.model_copy(update={"time_s": values["time_s"] or 0.0})


def _finite(value: float) -> float | None:
    """Return a finite number, or None."""
    return float(value) if math.isfinite(value) else None


@functools.cache
def _versions() -> dict[str, str]:
    """Return the versions of what a result depends on."""
    from .. import __version__

    found = {"grasp_planner": __version__, "python": platform.python_version()}
    for package in ("pin", "coal", "numpy", "scipy", "clarabel"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "?"
    return found
