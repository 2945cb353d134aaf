"""Simulating the grasps of a run: one row each, in a folder of its own beside them; stops and goes on."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from ..exceptions import GraspPlannerError, InvalidValueError
from ..hand.hand import Hand
from ..hand.loading import load_hand
from ..records.grasp_record import grasp_from_record
from ..records.layout import GraspRecord
from ..simulate import Protocol, Simulation, protocol_from, simulate_grasp, simulation_json, simulation_record
from .interrupts import StopOnSignal
from .pool import LocalPool
from .process import Job
from .progress import BatchProgress
from .results import find_rows, load_hands_and_records
from .rows import Row
from .runner import BatchLoop, BatchSummary
from .store import ResultStore, RunInfo
from .worker import serve

WORKER = "grasp_planner.batch.simulations"
"""Module whose ``main`` simulates cases."""
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
            hand=hand,
            record=record.model_dump_json(),
            protocol=fields,
            squeeze=squeeze,
            ladder=ladder,
        )
        for row, (hand, record) in zip(rows, load_hands_and_records(run, rows), strict=True)
    ]
    digest = hashlib.sha256()
    for case in cases:
        digest.update(case.model_dump_json(exclude={"time_limit_s"}).encode())
    info = RunInfo(digest.hexdigest()[:16], len(cases), WORKER, COLUMNS)
    folder = run / f"simulation-{protocol.name}" if folder is None else Path(folder)
    with StopOnSignal() as stop, ResultStore(folder, info) as store:
        loop = _SimulationLoop(cases, store, on_progress, lambda: stop.stopped)
        return loop.run(lambda: LocalPool(workers or os.cpu_count() or 1, WORKER, info.spec_hash, store.log, WORKER))


class _SimulationLoop(BatchLoop):
    """Works off grasps to be simulated."""

    def _failure(self, job: Job, status: str, reason: str, message: str) -> Row:
        """Return the row of a case that gave no result."""
        assert isinstance(job.case, SimulationCase)
        return _failed(job.row, job.case, status, f"{reason}: {message}")


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


def main(arguments: Sequence[str]) -> None:
    """Simulate cases until the parent closes the socket or ends.

    Args:
        arguments: The number of the socket.
    """
    serve(list(arguments), partial(_answer, {}))


def _answer(hands: dict[str, Hand], job: dict[str, Any]) -> Row:
    """Simulate one case; hands are loaded once."""
    case = SimulationCase.model_validate(job["case"])
    try:
        if case.hand not in hands:
            hands[case.hand] = load_hand(case.hand)
        grasp = grasp_from_record(GraspRecord.model_validate_json(case.record), hands[case.hand])
        found = simulate_grasp(grasp, protocol_from(case.protocol), squeeze=case.squeeze, ladder=case.ladder)
        return simulation_row(job["row"], case, found)
    except GraspPlannerError as error:
        return _failed(job["row"], case, "error", str(error))
    except Exception as error:  # a case may fail in any way; the others go on
        return _failed(job["row"], case, "error", f"{type(error).__name__}: {error}")
