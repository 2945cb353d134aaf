"""Try every URDF of a folder as a hand and print a table: check, load, plan, links clear, simulated, reopened.

    python scripts/check_hands.py FOLDER [--seconds 60] [--markdown table.md]

Nothing is edited by hand and every option is the default; the object is a cylinder in size for the hand.
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import tempfile
import time
from pathlib import Path
from queue import Empty

import numpy as np

import grasp_planner as gp
from grasp_planner.hand.check import check_hand
from grasp_planner.hand.loading import loaded_hand
from grasp_planner.records.grasp_files import grasp_json, read_grasp_record
from grasp_planner.records.grasp_record import grasp_from_record
from grasp_planner.simulate.run import simulate_grasp

COLUMNS = (
    "hand",
    "check",
    "load",
    "joints",
    "synergies",
    "plan",
    "clear",
    "pushes held",
    "reopened",
    "CPU s",
    "what fails",
)
STARTS = 12


def tried(path: Path, queue: multiprocessing.Queue[dict[str, str]]) -> None:
    """Try one URDF and send what is known after each step."""
    row = dict.fromkeys(COLUMNS, "–") | {"hand": path.stem}

    def say(**found: str) -> None:
        row.update({key.replace("_", " "): value for key, value in found.items()})
        queue.put(row | {"CPU s": f"{time.process_time():.0f}"})

    try:
        check = check_hand(path)
        say(check="yes" if check.usable else "no", what_fails="; ".join(check.errors))
        loaded = loaded_hand(path)
        hand = loaded.hand
        say(load="yes", joints=str(hand.n_joints), what_fails="plan: no time left")
        problem = gp.GraspProblem(hand, gp.parse_object(loaded.first_object))
        say(synergies=str(problem.n_synergies))
        grasp = gp.plan_grasp(problem, options=gp.PlannerOptions(starts=STARTS, enough=1))
        clear = all(pair.distance > -pair.tolerated - 1e-6 for pair in grasp.clearances if not pair.exempt)
        fails = "" if grasp.feasible else str(grasp.verdict)
        say(plan="yes" if grasp.feasible else "no", clear="yes" if clear else "no", what_fails=fails)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "grasp.json"
            file.write_text(grasp_json(grasp), encoding="utf-8")
            again = grasp_from_record(read_grasp_record(file))
        say(reopened="yes" if np.allclose(again.joint_angles, grasp.joint_angles) else "no")
        if grasp.feasible:
            result = simulate_grasp(grasp, ladder=False)
            say(pushes_held=f"{sum(push.held for push in result.directions)} of {len(result.directions)}")
    except Exception as error:
        say(what_fails=f"{type(error).__name__}: {str(error).splitlines()[0][:120]}")


def row_of(path: Path, seconds: float) -> dict[str, str]:
    """Return the row of a URDF, tried in a process of its own that is given so long."""
    context = multiprocessing.get_context("spawn")
    queue: multiprocessing.Queue[dict[str, str]] = context.Queue()
    process = context.Process(target=tried, args=(path, queue))
    process.start()
    row = dict.fromkeys(COLUMNS, "–") | {"hand": path.stem, "what fails": "no answer in time"}
    end = time.monotonic() + seconds
    while process.is_alive() and time.monotonic() < end:
        with contextlib.suppress(Empty):
            row = queue.get(timeout=0.5)
    if process.is_alive():
        process.terminate()
    process.join()
    with contextlib.suppress(Empty):
        while True:
            row = queue.get(timeout=0.5)  # what it said last may still be on its way
    return row


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seconds", type=float, default=120.0, help="wall-clock time for each hand")
    parser.add_argument("--markdown", type=Path, help="write the table to this file")
    arguments = parser.parse_args()
    lines = ["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    for path in sorted(arguments.folder.rglob("*.urdf")):
        row = row_of(path, arguments.seconds)
        lines.append("| " + " | ".join(row[column] for column in COLUMNS) + " |")
        print(lines[-1], flush=True)
    if arguments.markdown:
        arguments.markdown.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
