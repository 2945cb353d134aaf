"""Simulating the grasps of a run: one row each, in a folder of its own beside them; stops and goes on."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from ..exceptions import InvalidValueError
from ..hand.hand import Hand
from ..hand.loading import load_hand
from ..processes import Job, JobContext, JobFunction
from ..records.grasp_record import grasp_from_record
from ..records.layout import GraspRecord
from ..simulate import Protocol, Simulation, protocol_from, simulate_grasp, simulation_json, simulation_record
from .case import DEFAULT_MEMORY_LIMIT_MB
from .progress import BatchProgress
from .results import find_rows, load_hands_and_records
from .rows import Row
from .run_files import RunInfo
from .work import BatchSummary, RowWork, work_off_rows

FUNCTION = JobFunction("grasp_planner.batch.simulations:case_simulator")
"""What simulates cases in worker processes."""
TIME_LIMIT_S = 300.0
"""Wall time after which a simulation is stopped [s]."""

COLUMNS = {
    "row": "int64",
    "grasp_row": "int64",
    "status": "string",
    "message": "string",
    "feasible": "bool",
    "passed": "bool",
    "gate_passed": "bool",
    "simulated": "bool",
    "forces_held": "int64",
    "torques_held": "int64",
    "weakest_force": "double",
    "weakest_torque": "double",
    "rest_held": "bool",
    "rest_displacement": "double",
    "rest_rotation_deg": "double",
    "normal_force_error": "double",
    "normal_forces": "list<double>",
    "predicted_normal_forces": "list<double>",
    "surface_error": "double",
    "record": "string",
}
"""Columns of the rows: ``grasp_row`` is the row in the run of grasps, ``feasible`` and ``passed`` are the same."""


class SimulationCase(BaseModel):
    """One grasp to be simulated, as plain values.

    Attributes:
        grasp_row: Its row in the run of grasps.
        hand: Hand as the run named it.
        record: Its JSON record.
        protocol: The fields of the protocol.
        squeeze: Factor on δσ.
        ladder: Whether to look for the loads at failure.
        time_limit_s: Wall time after which it is stopped [s].
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    grasp_row: int
    hand: str
    record: str
    protocol: dict[str, Any]
    squeeze: float = 1.0
    ladder: bool = True
    time_limit_s: float = TIME_LIMIT_S


def simulate_run(
    run: str | Path,
    folder: str | Path | None,
    protocol: Protocol,
    *,
    squeeze: float = 1.0,
    ladder: bool = True,
    where: str = "feasible",
    hand: str | None = None,
    workers: int | None = None,
    on_progress: Callable[[BatchProgress], None] | None = None,
) -> BatchSummary:
    """Simulate grasps of a run; the same call again goes on after a stop of any kind.

    Args:
        run: Folder of the run of grasps.
        folder: Folder of the results; ``simulation-<protocol>`` within the run if left out.
        protocol: The test.
        squeeze: Factor on δσ.
        ladder: Whether to look for the loads at failure.
        where: Which rows, a condition in SQL.
        hand: Hand to take instead of the one that each case names: name or description file.
        workers: Worker processes; as many as there are cores if left out.
        on_progress: Called several times a second.

    Returns:
        What it came to; ``feasible`` counts those that passed.

    Raises:
        ResultsError: If there is no run, or the folder can't be written or holds other simulations.
        InvalidValueError: If no row meets the condition.
    """
    run = Path(run)
    rows = find_rows(run, where)
    if not rows:
        raise InvalidValueError("where", where, f"a condition that some row of {run} meets")
    fields = json.loads(json.dumps(asdict(protocol)))
    cases = [
        SimulationCase(
            grasp_row=row,
            hand=name,
            record=record.model_dump_json(),
            protocol=fields,
            squeeze=squeeze,
            ladder=ladder,
        )
        for row, (name, record) in zip(rows, load_hands_and_records(run, rows, hand), strict=True)
    ]
    digest = hashlib.sha256()
    for case in cases:
        digest.update(case.model_dump_json(exclude={"time_limit_s"}).encode())
    info = RunInfo(digest.hexdigest()[:16], len(cases), "grasp_planner.batch.simulations", COLUMNS)
    folder = run / f"simulation-{protocol.name}" if folder is None else Path(folder)

    def job(row: int) -> Job:
        content = {"row": row, "case": cases[row].model_dump(mode="json")}
        return Job(row, content, cases[row].time_limit_s, memory_limit_mb=DEFAULT_MEMORY_LIMIT_MB)

    def failed(row: int, status: str, reason: str, message: str) -> Row:
        return _failed(row, cases[row], status, message if status == "error" else f"{reason}: {message}")

    return work_off_rows(RowWork(info, FUNCTION, job, failed), folder, workers=workers, on_progress=on_progress)


def _failed(row: int, case: SimulationCase, status: str, message: str) -> Row:
    """Return the row of a case that gave no result."""
    values: Row = dict.fromkeys(COLUMNS)
    values.update(row=row, grasp_row=case.grasp_row, status=status, message=message, feasible=False, passed=False)
    return values


def simulation_row(row: int, case: SimulationCase, found: Simulation) -> Row:
    """Return the row of a simulation."""
    record = simulation_record(found)
    rest = record["rest"] or {}
    values: Row = dict.fromkeys(COLUMNS)
    values.update({name: record[name] for name in COLUMNS if name in record})
    values.update({name: rest[name] for name in COLUMNS if name in rest})
    values.update(
        row=row,
        grasp_row=case.grasp_row,
        status="done",
        message=found.verdict,
        feasible=found.passed,
        rest_held=rest.get("held"),
        rest_displacement=rest.get("displacement"),
        rest_rotation_deg=rest.get("rotation_deg"),
        record=simulation_json(found),
    )
    return values


def case_simulator() -> Callable[[dict[str, Any], JobContext], Row]:
    """Return what answers a job, in the worker process; hands are loaded once."""
    hands: dict[str, Hand] = {}

    def simulate(job: dict[str, Any], _: JobContext) -> Row:
        case = SimulationCase.model_validate(job["case"])
        if case.hand not in hands:
            hands[case.hand] = load_hand(case.hand)
        grasp = grasp_from_record(GraspRecord.model_validate_json(case.record), hands[case.hand])
        found = simulate_grasp(grasp, protocol_from(case.protocol), squeeze=case.squeeze, ladder=case.ladder)
        return simulation_row(job["row"], case, found)

    return simulate
