"""The JSON form of a simulation: plain numbers in SI units."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import Any

import numpy as np

from .result import RestReport, Simulation

SCHEMA_VERSION = 1


def simulation_record(simulation: Simulation) -> dict[str, Any]:
    """Return a simulation as plain values; numbers that are not finite become None."""
    problem = simulation.grasp.problem
    record: dict[str, Any] = {
        "schema_version": SCHEMA_VERSION,
        "hand": problem.hand.name,
        "object": problem.grasp_object.text,
        "n_synergies": problem.n_synergies,
        "protocol": asdict(simulation.protocol),
        "squeeze": simulation.squeeze,
        "mass": simulation.mass,
        "friction": simulation.friction,
        "passed": simulation.passed,
        "verdict": simulation.verdict,
        "gate_passed": simulation.gate_passed,
        "gates": [{**asdict(gate), "passed": gate.passed} for gate in simulation.gates],
        "simulated": simulation.rest is not None,
        "surface_error": simulation.surface_error,
        "notes": list(simulation.notes),
        "contacts": [frame.name for frame in problem.frames],
        "rest": None if simulation.rest is None else _rest(simulation.rest),
        "forces_held": simulation.forces_held,
        "torques_held": simulation.torques_held,
        "weakest_force": simulation.weakest("force"),
        "weakest_torque": simulation.weakest("torque"),
        "directions": [asdict(report) for report in simulation.directions],
    }
    plain: dict[str, Any] = _plain(record)
    return plain


def simulation_json(simulation: Simulation) -> str:
    """Return the JSON text of a simulation."""
    return json.dumps(simulation_record(simulation), indent=1, allow_nan=False) + "\n"


def _rest(rest: RestReport) -> dict[str, Any]:
    """Return the record of the object at rest."""
    return {**asdict(rest), "normal_force_error": rest.normal_force_error}


def _plain(value: Any) -> Any:
    """Return arrays as lists and numbers that are not finite as None."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value
