"""Kill a batch again and again, fill its disk, start it twice: does every case still get exactly one row?

``python scripts/kill_batch.py --cases 10000 --folder FOLDER`` runs cheap cases through the command line. A seeded plan
kills workers and the whole command (SIGKILL), starts two commands at once in one folder and, with ``--fill``, fills the
file system, which then has to be a small one for this alone (such as a tmpfs). Every event is a line of
``FOLDER/kills.jsonl``; exit code 1 if a row is missing, stands there twice or was lost.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pyarrow.parquet as pq

from grasp_planner import Grasp, GraspPlannerError, GraspProblem, PlannerOptions, standard_start
from grasp_planner.batch import load_table

PLANNER = "kill_batch:cheap"
REAL_EVERY = 20
"""Every so many cases has a grasp; the others are refused at once, which is a row too."""
PAUSE_S = 0.02
"""What every case takes at least, without work [s]."""
LIMIT_S = 300.0
"""Longest wait for anything [s]."""
FILLED_MOST = 2**28
"""Largest file system that is filled [bytes]."""


def cheap(problem: GraspProblem, *, seed: int, options: PlannerOptions) -> Grasp:
    """Return the standard start or refuse, by the seed; runs in the workers."""
    time.sleep(PAUSE_S)
    if seed % REAL_EVERY:
        raise GraspPlannerError(f"case {seed}")
    start = standard_start(problem)
    return Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma)


@dataclass
class Trouble:
    """A batch under attack.

    Attributes:
        folder: Folder of the specification, the log and the run.
        cases: Cases of the batch.
        rng: Decides when and what is killed.
        events: What happened so far.
    """

    folder: Path
    cases: int
    rng: np.random.Generator
    events: list[dict[str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.run, self.spec = self.folder / "run", self.folder / "spec.yaml"
        self.folder.mkdir(parents=True, exist_ok=True)
        seeds = f"{{from: 0, to: {self.cases - 1}}}"
        self.spec.write_text(f"defaults: {{paper: true}}\nblocks: [{{product: {{seed: {seeds}}}}}]\n", encoding="utf-8")
        self._began = time.monotonic()
        self._log = self.folder / "kills.jsonl"
        self._log.unlink(missing_ok=True)

    def note(self, event: str, **values: object) -> None:
        """Write an event to the log, with the rows that are on disk then."""
        line = {"t": round(time.monotonic() - self._began, 2), "event": event, "rows": self.rows(), **values}
        self.events.append(line)
        with self._log.open("a", encoding="utf-8") as log:
            log.write(json.dumps(line) + "\n")

    def rows(self) -> int:
        """Return how many rows are on disk."""
        return len(load_table(self.run, ["row"])) if (self.run / "run.json").exists() else 0

    def start(self) -> subprocess.Popen[str]:
        """Start the command."""
        words = [sys.executable, "-m", "grasp_planner", "batch", str(self.spec), "--out", str(self.run)]
        path = os.pathsep.join([str(Path(__file__).parents[1]), str(Path(__file__).parent)])
        return subprocess.Popen(
            [*words, "--workers", "2", "--planner", PLANNER],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": path},
        )

    def wait_for_rows(self, command: subprocess.Popen[str], wanted: int) -> bool:
        """Wait until as many rows are on disk, at least one more than now; return whether the command still runs."""
        wanted, until = max(wanted, self._written() + 1), time.monotonic() + LIMIT_S
        while command.poll() is None and self._written() < wanted:
            if time.monotonic() > until:
                raise TimeoutError(f"no {wanted} rows are written")
            time.sleep(0.05)
        time.sleep(self.rng.uniform(0.0, 1.0))
        return command.poll() is None

    def kill_all(self, command: subprocess.Popen[str]) -> None:
        """Kill some workers, then the command, and see that no worker is left behind."""
        workers = _children(command)
        for worker in self.rng.permutation(np.array(workers, dtype=object))[: self.rng.integers(1, 3)]:
            worker.kill()
            self.note("kill worker", pid=worker.pid)
        time.sleep(self.rng.uniform(0.0, 1.0))
        workers += _children(command)
        command.kill()
        command.communicate()
        self.note("kill command", pid=command.pid)
        _, left = psutil.wait_procs(workers, timeout=LIMIT_S)
        if left:
            raise TimeoutError(f"workers outlive their parent: {[worker.pid for worker in left]}")

    def start_two(self) -> subprocess.Popen[str]:
        """Start two commands at once: one has to be refused, in one line; return the other."""
        both, until = [self.start(), self.start()], time.monotonic() + LIMIT_S
        while not (ended := [command for command in both if command.poll() is not None]):
            if time.monotonic() > until:
                raise TimeoutError("two commands run in one folder")
            time.sleep(0.05)
        _, errors = ended[0].communicate()
        self.note("second command", exit=ended[0].returncode, said=errors.strip())
        return both[1 - both.index(ended[0])]

    def fill_disk(self, command: subprocess.Popen[str]) -> None:
        """Fill the file system until the command ends, then free it."""
        filler = self.folder / "filler"
        with filler.open("wb", buffering=0) as file:
            until = time.monotonic() + LIMIT_S
            while command.poll() is None and time.monotonic() < until:
                try:
                    file.write(bytes(4096))
                except OSError:
                    time.sleep(0.02)
        _, errors = command.communicate(timeout=LIMIT_S)
        filler.unlink()
        self.note("disk full", exit=command.returncode, said=errors.strip())

    def _written(self) -> int:
        """Return about how many rows are on disk, without reading them."""
        count = 0
        with contextlib.suppress(FileNotFoundError):  # a journal becomes a Parquet file
            count += sum(path.read_bytes().count(b"\n") for path in self.run.glob("journal-*.jsonl"))
            count += sum(pq.read_metadata(path).num_rows for path in self.run.glob("results/part-*.parquet"))
        return count


def _children(command: subprocess.Popen[str]) -> list[psutil.Process]:
    """Return the workers of a command."""
    try:
        return psutil.Process(command.pid).children(recursive=True)
    except psutil.NoSuchProcess:
        return []


def attack(folder: Path, cases: int, rounds: int, seed: int, *, fill: bool = False) -> dict[str, Any]:
    """Run a batch to its end through trouble.

    Args:
        folder: Folder for everything.
        cases: Cases of the batch.
        rounds: How often workers and command are killed.
        seed: Seed of the plan.
        fill: Whether to fill the file system of the folder once.

    Returns:
        Counts of events and of rows: how many there are in the Parquet files, how many of them are distinct.
    """
    trouble = Trouble(folder, cases, np.random.default_rng(seed))
    for number in range(rounds):
        command = trouble.start() if number else trouble.start_two()
        if not trouble.wait_for_rows(command, cases * number // (rounds + 1)):
            break
        if number == 1 and fill:
            trouble.fill_disk(command)
        else:
            trouble.kill_all(command)
    command = trouble.start()
    _, errors = command.communicate()
    trouble.note("end", exit=command.returncode, said=errors.strip().splitlines()[-1:])
    return {**_counts(trouble), "events": dict(Counter(event["event"] for event in trouble.events))}


def _counts(trouble: Trouble) -> dict[str, Any]:
    """Count the rows as they stand in the Parquet files, without the reader of the package."""
    parts = sorted(trouble.run.glob("results/*.parquet"))
    names = ["row", "seed", "status"]
    rows = [values for path in parts for values in pq.read_table(path, columns=names).to_pylist()]
    seen = [event["rows"] for event in trouble.events]
    return {
        "cases": trouble.cases,
        "rows": len(rows),
        "distinct": len({values["row"] for values in rows}),
        "of their case": sum(values["row"] == values["seed"] for values in rows),
        "status": dict(Counter(values["status"] for values in rows)),
        "never fewer": seen == sorted(seen),
    }


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--rounds", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--fill", action="store_true", help="the folder is alone on a small file system: fill it once")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    disk = os.statvfs(options.folder)
    if options.fill and disk.f_blocks * disk.f_frsize > FILLED_MOST:
        parser.error(f"--fill: the file system is larger than {FILLED_MOST} bytes")
    report = attack(options.folder, options.cases, options.rounds, options.seed, fill=options.fill)
    sys.stdout.write(json.dumps(report, indent=1) + "\n")
    counts = {report[name] for name in ("cases", "rows", "distinct", "of their case")}
    sys.exit(len(counts) != 1 or not report["never fewer"])


if __name__ == "__main__":
    main()
