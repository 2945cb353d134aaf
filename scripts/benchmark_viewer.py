"""Measure the viewer without a browser: drag to redraw, the same while planning, cancelling, memory over plans.

Usage: python scripts/benchmark_viewer.py [--plans N]
"""

from __future__ import annotations

import argparse
import resource
import statistics
import time
from collections.abc import Callable

import grasp_planner as gp
from grasp_planner.viewer import GraspViewer


def until(condition: Callable[[], bool], limit_s: float = 120.0) -> None:
    """Wait for a condition."""
    end = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("the condition did not come true")
        time.sleep(0.0005)


def drags(viewer: GraspViewer, steps: int) -> list[float]:
    """Return the time from each slider value to the drawn hand [ms]."""
    times = []
    for step in range(steps):
        value = 0.2 + 0.002 * step
        began = time.perf_counter()
        viewer.synergies.sliders[0].value = value
        until(lambda value=value: viewer.session.live.sigma[0] == value)
        viewer.worker.drain()
        times.append(1e3 * (time.perf_counter() - began))
        time.sleep(1.0 / 30.0)
    return times


def main() -> None:
    """Print the medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plans", type=int, default=20, help="plans over which memory is watched")
    arguments = parser.parse_args()
    easy = gp.GraspProblem(gp.load_hand(), gp.Cylinder(), n_synergies=15)
    viewer = GraspViewer(None, port=0)
    viewer.worker.drain()
    print(f"drag to redraw, idle: median {statistics.median(drags(viewer, 60)):.1f} ms")
    viewer.worker.submit(lambda: viewer.session.set_problem(easy))
    viewer.plan.enough.value, viewer.plan.starts.value = 50, 500
    viewer.worker.drain()
    viewer.plan.plan.value = True
    until(lambda: viewer.planning.busy)
    print(f"drag to redraw, while planning: median {statistics.median(drags(viewer, 60)):.1f} ms")
    began = time.perf_counter()
    viewer.plan.cancel.value = True
    until(lambda: not viewer.planning.busy)
    print(f"cancel: {1e3 * (time.perf_counter() - began):.1f} ms")
    viewer.plan.enough.value, viewer.plan.starts.value = 1, 3
    memory = []
    for _ in range(arguments.plans):
        viewer.plan.plan.value = True
        until(lambda: viewer.planning.busy)
        until(lambda: not viewer.planning.busy)
        viewer.worker.drain()
        memory.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    print(
        f"peak memory over {arguments.plans} plans: {memory[0]:.0f} MB after the first, {memory[-1]:.0f} MB at the end"
    )
    viewer.stop()


if __name__ == "__main__":
    main()
