"""Measure a batch on two workers against two plain single-core runs of the same cases, and the parent's memory.

The cases are cylinder radii x directions x n_s = 3, 5, 15 x seeds. Plain runs and batch take turns, block by
block, so that whatever else the machine does hits both alike. Every block starts its processes anew.

Usage: ``python scripts/benchmark_batch.py [--cases 1000] [--blocks 4] [--output benchmark_batch.json]``
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from grasp_planner.batch import BatchProgress, CaseTable, load_table, parse_spec, run_batch

WORKERS = 2
SPEC = {
    "defaults": {"paper": True, "object": "cylinder", "starts": 2, "enough": 1},
    "blocks": [
        {
            "product": {
                "seed": {"from": 0, "to": 6},
                "object.radius": {"from": 0.020, "to": 0.040, "count": 8},
                "task": ["force:+x", "force:+y", "force:+z", "force:-x", "force:-y", "force:-z"],
                "n_synergies": [3, 5, 15],
            }
        }
    ],
}
PLAIN = """
import sys
import grasp_planner as gp
from grasp_planner.batch import GraspCase
hand = gp.load_hand()
for line in sys.stdin:
    case = GraspCase.model_validate_json(line)
    gp.grasp_json(gp.plan_grasp(case.problem(hand), seed=case.seed, options=case.options()))
"""


def plain_runs(cases: CaseTable, rows: range) -> None:
    """Plan cases in two processes that know nothing of each other."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    processes = []
    for share in range(WORKERS):
        # Sessions of their own, as the workers have: some kernels share the processor out by session.
        process = subprocess.Popen(
            [sys.executable, "-c", PLAIN], stdin=subprocess.PIPE, env=environment, start_new_session=True
        )
        assert process.stdin is not None
        lines = "".join(cases[row].model_dump_json() + "\n" for row in rows[share::WORKERS])
        process.stdin.write(lines.encode())
        process.stdin.close()
        processes.append(process)
    for process in processes:
        if process.wait():
            raise SystemExit(f"a plain run ended with {process.returncode}")


def resident_mb() -> float:
    """Return the resident memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def children_cpu_s() -> float:
    """Return the processor time of all child processes that have ended [s]."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


@dataclass
class Totals:
    """Times [s] and memory [MB] summed over the blocks."""

    plain_s: float = 0.0
    plain_cpu_s: float = 0.0
    batch_s: float = 0.0
    batch_cpu_s: float = 0.0
    memory: list[tuple[int, float]] = field(default_factory=list)

    def note(self, state: BatchProgress) -> None:
        """Note the memory after every case."""
        if not self.memory or self.memory[-1][0] != state.done:
            self.memory.append((state.done, resident_mb()))

    def report(self, cases: int, folder: Path) -> dict[str, object]:
        """Return the numbers so far."""
        table = load_table(folder, ["feasible", "time_total_s"])
        return {
            "cases": cases,
            "rows": table.num_rows,
            "feasible": sum(table["feasible"].to_pylist()),
            "workers": WORKERS,
            "plain_s": self.plain_s,
            "batch_s": self.batch_s,
            "efficiency": self.plain_s / self.batch_s,
            "plain_cpu_s": self.plain_cpu_s,
            "batch_cpu_s": self.batch_cpu_s,
            "efficiency_by_cpu_time": self.plain_cpu_s / self.batch_cpu_s,
            "share_of_time_inside_cases": sum(table["time_total_s"].to_pylist()) / (WORKERS * self.batch_s),
            "parent_memory_mb": dict(self.memory[:: max(1, len(self.memory) // 12)]),
            "machine": f"{platform.machine()}, {os.cpu_count()} cores",
            "load_average": os.getloadavg(),
        }


def measure(count: int, blocks: int, folder: Path, output: Path) -> dict[str, object]:
    """Run everything, write the numbers after every block, and return them."""
    cases = CaseTable(parse_spec(SPEC))
    totals = Totals()
    found: dict[str, object] = {}
    for block in range(blocks):
        end = count * (block + 1) // blocks
        began, cpu = time.perf_counter(), children_cpu_s()
        plain_runs(cases, range(count * block // blocks, end))
        totals.plain_s += time.perf_counter() - began
        totals.plain_cpu_s += children_cpu_s() - cpu
        began, cpu = time.perf_counter(), children_cpu_s() + time.process_time()
        reached = _reached(totals, end)
        run_batch(cases[:count], folder, workers=WORKERS, on_progress=totals.note, cancel=reached)
        if not reached():
            raise SystemExit("stopped")
        totals.batch_s += time.perf_counter() - began
        totals.batch_cpu_s += children_cpu_s() + time.process_time() - cpu
        found = totals.report(count, folder)
        output.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
        sys.stdout.write(f"{end} cases: plain {totals.plain_s:.1f} s, batch {totals.batch_s:.1f} s\n")
        sys.stdout.flush()
    return found


def _reached(totals: Totals, end: int) -> Callable[[], bool]:
    """Return what tells that a block is done."""
    return lambda: bool(totals.memory) and totals.memory[-1][0] >= end


def main() -> None:
    """Parse the arguments, measure, print and write the numbers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--blocks", type=int, default=4)
    parser.add_argument("--output", type=Path, default=Path("benchmark_batch.json"))
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = measure(arguments.cases, arguments.blocks, Path(folder), arguments.output)
    sys.stdout.write(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
