"""Measure the viewer: opening, drag to redraw, alone, while planning, with many pages, to pixels; cancelling; memory.

Usage: python scripts/benchmark_viewer.py [--plans 20] [--clients 20] [--drags 1000] [--changes 200] [--pixels]

A drag is timed from the new value of a slider until the hand is drawn and sent: by the clock, and in processor time of
the thread that does it, which other work on the machine does not lengthen. The pages are connections in a process of
their own that read all they are sent. The plans are short ones, from a feasible grasp. Opening is the processor time of
the viewer until its first picture is drawn; with --pixels also what the viewer and Chromium take until a page shows it.
Pixels are those of headless Chromium with software rendering (GRASP_PLANNER_CHROMIUM or /usr/bin/chromium), which a
graphics card outdoes.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.sharedctypes import Synchronized
from multiprocessing.synchronize import Event
from pathlib import Path

import psutil
import viser
from websockets.sync.client import ClientConnection, connect

import grasp_planner as gp
from grasp_planner.viewer import GraspViewer

DRAGS = 60
"""Slider values of one measurement."""
SMALL = 2e-5
"""Steps of a slider with which all fingers keep touching [rad]."""
STARTING_S = 6.0
"""How long the planning process may take to load its libraries, which would disturb the first measurement [s]."""
FLAGS = (
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
JOINT = "/hand/joint_1/joint_2/joint_3"
SEEN = f"""() => {{
  const joint = window.__viserMutable.nodeRefFromName['{JOINT}'], before = joint.quaternion.toArray().join();
  window.seenFrame = false;
  const look = () => {{
    if (joint.quaternion.toArray().join() === before) return requestAnimationFrame(look);
    requestAnimationFrame(() => requestAnimationFrame(() => {{ window.seenFrame = true; }}));
  }};
  look();
}}"""
"""Notes the frame after that in which a joint has turned."""
SHOWN = f"""() => window.__viserMutable?.nodeRefFromName['{JOINT}'] && !window.__viserMutable.messageQueue.length
  && window.__viserTestpoints.rendererInfo.render.frame > 0"""
"""Whether the page has drawn the hand."""
SAMPLES = 10
"""How often the memory is printed."""


@dataclass(frozen=True)
class Times:
    """Times of drags [ms].

    Attributes:
        clock: By the clock.
        processor: In processor time of the viewer's thread; empty where that is not what is measured.
    """

    clock: list[float]
    processor: list[float]


def until(condition: Callable[[], bool], limit_s: float = 120.0) -> None:
    """Wait for a condition."""
    end = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > end:
            raise TimeoutError("the condition did not come true")
        time.sleep(0.0005)


def drags(viewer: GraspViewer, start: float = 0.2, step: float = 0.002) -> Times:
    """Return the time from each slider value to the drawn hand."""
    times, efforts = [], []
    clock = time.pthread_getcpuclockid(viewer.worker._thread.ident or 0)
    for count in range(DRAGS):
        value = start + count * step
        began, before = time.perf_counter(), time.clock_gettime(clock)
        viewer.synergies.sliders[0].value = value
        until(lambda value=value: viewer.session.live.sigma[0] == value)
        viewer.worker.drain()
        times.append(1e3 * (time.perf_counter() - began))
        efforts.append(1e3 * (time.clock_gettime(clock) - before))
        time.sleep(1.0 / 30.0)
    return Times(times, efforts)


def show(title: str, times: Times) -> None:
    """Print medians and 95th percentiles."""
    told = (
        f"{name} median {statistics.median(values):.1f} ms, 95 % below {statistics.quantiles(values, n=20)[-1]:.1f} ms"
        for name, values in (("clock", times.clock), ("processor", times.processor))
        if values
    )
    print(f"{title}: {'; '.join(told)}", flush=True)


def listen(port: int, count: int, connected: Event, stop: Event, received: Synchronized[int]) -> None:
    """Be as many pages, in a process of its own: read and count all they are sent."""
    pages: list[ClientConnection] = []
    for _ in range(count):
        address = f"ws://127.0.0.1:{port}/"
        pages.append(connect(address, subprotocols=[f"viser-v{viser.__version__}"], max_size=None))  # type: ignore[list-item]
    connected.set()
    while not stop.is_set():
        for page in pages:
            try:
                while page.recv(timeout=0.0):
                    received.value += 1
            except TimeoutError:
                continue
        time.sleep(0.01)


def drags_with_pages(viewer: GraspViewer, count: int) -> Times:
    """Return the times of drags while as many pages are connected."""
    context = multiprocessing.get_context("spawn")
    connected, stop, received = context.Event(), context.Event(), context.Value("Q")
    arguments = (viewer.server.get_port(), count, connected, stop, received)
    process = context.Process(target=listen, args=arguments, daemon=True)
    process.start()
    connected.wait(60.0)
    time.sleep(3.0)
    before = received.value
    times = drags(viewer)
    print(f"the {count} pages were sent {(received.value - before) / count:.0f} batches of messages each", flush=True)
    stop.set()
    process.join(10.0)
    return times


def drags_to_pixels(viewer: GraspViewer) -> Times:
    """Print what opening a page costs; return the times from each slider value to a frame of a real browser."""
    from playwright.sync_api import sync_playwright

    browser_path = os.environ.get("GRASP_PLANNER_CHROMIUM", "/usr/bin/chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, headless=True, args=list(FLAGS))
        page = browser.new_page(viewport={"width": 1100, "height": 760})
        began, own, theirs = time.perf_counter(), time.process_time(), chromium_seconds()
        page.goto(f"{viewer.url}/?fixedDpr=1")
        page.wait_for_function(SHOWN, timeout=90_000)
        own, theirs = time.process_time() - own, chromium_seconds() - theirs
        clock = time.perf_counter() - began
        print(f"a page opens: viewer {own:.1f} s, Chromium {theirs:.1f} s of processor time; clock {clock:.1f} s")
        page.wait_for_timeout(3000)
        times = []
        for step in range(DRAGS // 3):
            page.evaluate(SEEN)
            began = time.perf_counter()
            viewer.synergies.sliders[0].value = 0.3 + 0.01 * step
            page.wait_for_function("() => window.seenFrame", polling=5, timeout=30_000)
            times.append(1e3 * (time.perf_counter() - began))
        browser.close()
    return Times(times, [])


def watch_changes(viewer: GraspViewer, changes: int) -> None:
    """Print the memory of the viewer over many changes of hand, object, task and number of synergies."""
    shapes, counts = ("cylinder", "sphere", "box"), (1, 3, 15)
    began = time.process_time()
    for done in range(1, changes + 1):
        viewer.problem.kind.value = shapes[done % len(shapes)]
        viewer.worker.drain(60.0)
        viewer.synergies.count.value = counts[done % len(counts)]
        viewer.worker.drain(60.0)
        if done in (1, changes // 4, changes // 2, changes):
            spent = (time.process_time() - began) / done
            print(
                f"after {done} changes ({spent:.2f} s of processor time each): {resident_mb(os.getpid()):.0f} MB",
                flush=True,
            )


def watch_drags(viewer: GraspViewer, count: int) -> None:
    """Print the memory of the viewer over many drags."""
    for done in range(0, count + 1, max(1, count // SAMPLES)):
        if done:
            for step in range(max(1, count // SAMPLES)):
                viewer.synergies.sliders[0].value = 0.2 + 0.001 * (step % DRAGS)
                viewer.worker.drain()
        print(f"after {done} drags: {resident_mb(os.getpid()):.0f} MB", flush=True)


def chromium_seconds() -> float:
    """Return the processor time that all processes below this one whose name says Chromium have taken so far [s]."""
    own = psutil.Process()
    return sum(sum(each.cpu_times()[:2]) for each in own.children(recursive=True) if each.name().startswith("chrom"))


def resident_mb(pid: int) -> float:
    """Return the resident memory of a process [MB]."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def plan(viewer: GraspViewer) -> None:
    """Plan and wait for the end."""
    viewer.plan.plan.value = True
    until(lambda: viewer.planning.busy)
    until(lambda: not viewer.planning.busy)
    try:  # what was found comes in a moment after the end
        until(lambda: bool(viewer.session.results) and viewer.session.results[0].feasible, 10.0)
    except TimeoutError:
        raise SystemExit(f"a plan found no grasp: {viewer.plan.status.content}") from None
    viewer.worker.drain()


def watch_memory(viewer: GraspViewer, plans: int) -> None:
    """Print the memory of the viewer and of its planning process over many short plans."""
    viewer.plan.enough.value, viewer.plan.starts.value, viewer.plan.from_here.value = 1, 1, True
    pid = viewer.planning.pid
    assert pid is not None
    began, tenth = time.perf_counter(), max(1, plans // SAMPLES)
    for done in range(1, plans + 1):
        plan(viewer)
        if done % tenth == 0 or done == 1:
            here, there = resident_mb(os.getpid()), resident_mb(pid)
            spent = (time.perf_counter() - began) / done
            print(f"after {done} plans ({spent:.2f} s each): viewer {here:.0f} MB, planning {there:.0f} MB", flush=True)


def main() -> None:
    """Print the medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--plans", type=int, default=20, help="plans over which memory is watched")
    parser.add_argument("--clients", type=int, default=20, help="pages connected at once")
    parser.add_argument("--drags", type=int, default=1000, help="drags over which memory is watched")
    parser.add_argument("--changes", type=int, default=200, help="changes of the problem over which memory is watched")
    parser.add_argument("--pixels", action="store_true", help="also measure a drag to new pixels of Chromium")
    arguments = parser.parse_args()
    viewer = GraspViewer(None, port=0)
    viewer.worker.drain()
    print(f"the viewer opens: {time.process_time():.1f} s of processor time, its imports included", flush=True)
    time.sleep(STARTING_S)
    print(f"load average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores", flush=True)
    show("drag to redraw, fingers touching", drags(viewer, viewer.session.live.sigma[0] + SMALL, SMALL))
    show("drag to redraw, fingers apart", drags(viewer))
    show(f"drag to redraw, {arguments.clients} pages connected", drags_with_pages(viewer, arguments.clients))
    if arguments.pixels:
        show("drag to new pixels", drags_to_pixels(viewer))
    easy = gp.GraspProblem.paper(gp.load_hand(), gp.Cylinder(), n_synergies=15)
    viewer.worker.submit(lambda: viewer.session.set_problem(easy))
    viewer.plan.enough.value, viewer.plan.starts.value = 50, 500
    viewer.worker.drain()
    cancels = []
    for round_ in range(5):
        viewer.plan.plan.value = True
        until(lambda: viewer.planning.busy)
        if round_ == 0:
            show("drag to redraw, while planning", drags(viewer))
        time.sleep(0.5)
        began = time.perf_counter()
        viewer.plan.cancel.value = True
        until(lambda: not viewer.planning.busy)
        cancels.append(1e3 * (time.perf_counter() - began))
    if arguments.drags:
        watch_drags(viewer, arguments.drags)
    print(f"cancel: {', '.join(f'{time_ms:.0f}' for time_ms in cancels)} ms", flush=True)
    if arguments.changes:
        watch_changes(viewer, arguments.changes)
    viewer.worker.submit(lambda: viewer.session.set_problem(easy))
    viewer.plan.enough.value, viewer.plan.starts.value = 1, 20
    if arguments.plans:
        plan(viewer)
        watch_memory(viewer, arguments.plans)
    viewer.stop()


if __name__ == "__main__":
    main()
