"""Fuzz every door of the package with seeded damage to good inputs: each answer is a value or one typed error.

``python scripts/fuzz.py --inputs 5000 --seed 1`` prints what broke: tracebacks, processes that died, inputs above 60 s
or 2 GB, files that were lost. Each door gets good inputs of its own kind with bytes, words, numbers or lines replaced;
input NUMBER of a seed is always the same (``--only NUMBER`` tries it alone). The inputs run in a process that is
watched: its memory is the kernel's peak, set back before each input.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from typing import Any

import numpy as np
from fuzz_doors import Door, doors

from grasp_planner.exceptions import GraspPlannerError

LIMIT_S = 60.0
"""Processor time of one input above which it counts as broken [s]."""
LIMIT_MB = 2000.0
"""Memory of the process above which an input counts as broken."""
PATIENCE_S = 240.0
"""Time after which the process is taken to hang [s]."""
ADDRESSES = 12 * 2**30
"""Address space that the process gets, so that the machine survives what it looks for [bytes]."""
WORDS = (
    *(b"1e308", b"-1", b"0", b"nan", b"inf", b"-inf", b"1e-300", b"99999999999999999999", b"1e400", b"0x10", b"1_0"),
    *(b"null", b"[]", b"{}", b'""', b"true", b"[[[[[[[[", b"&a [*a]", b"!!int ''", b"*a", b"<!DOCTYPE a>", b"#2"),
    *(b"\xff", b"\x00", b"\x1b[2J", b"../../x", b"-", b",,", b"\n", b"'", b"%s%n", b"\xe2\x80\xae", b"x" * 5000),
    *(b"mesh:/dev/zero.stl", b"/dev/zero", b"file:///etc/passwd", b"package://a/b.stl", b"\xef\xbb\xbf"),
)
"""What good parts are replaced by."""
_TOKEN = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?|[A-Za-z_]\w*")


def damaged(rng: np.random.Generator, data: bytes) -> bytes:
    """Return a good input with one to three parts replaced, removed, swapped or doubled."""
    for _ in range(rng.integers(1, 4)):
        start = int(rng.integers(0, len(data) + 1))
        end = min(len(data), start + int(rng.integers(0, 12)))
        kind = int(rng.integers(0, 8))
        if kind <= 3:  # a whole number or word, so that what follows is still understood
            tokens = list(_TOKEN.finditer(data, max(0, start - 4000), start + 4000))
            if tokens:
                chosen = tokens[int(rng.integers(0, len(tokens)))]
                data = data[: chosen.start()] + _word(rng, tokens) + data[chosen.end() :]
        elif kind == 4:
            data = data[:start] + rng.bytes(int(rng.integers(1, 5))) + data[end:]
        elif kind == 5:
            data = data[:start] + WORDS[rng.integers(0, len(WORDS))] + data[end:]
        elif kind == 6:
            lines = data.split(b"\n")
            place, other = rng.integers(0, len(lines), 2)
            lines[place : place + 1] = [[], [lines[other]], [lines[place]] * 3][rng.integers(0, 3)]
            data = b"\n".join(lines)
        else:
            data = data[:start] + data[end:]
    return data


def _word(rng: np.random.Generator, tokens: list[re.Match[bytes]]) -> bytes:
    """Return what stands for a token: a word of the list, or another token of the same input."""
    if rng.integers(0, 3):
        return WORDS[rng.integers(0, len(WORDS))]
    return tokens[rng.integers(0, len(tokens))][0]


def case(number: int, seed: int, known: list[Door]) -> tuple[Door, bytes]:
    """Return one input: its door and its bytes."""
    rng = np.random.default_rng([seed, number])
    door = known[number % len(known)]
    return door, damaged(rng, door.good[int(rng.integers(0, len(door.good)))])


def try_input(door: Door, data: bytes) -> dict[str, Any]:
    """Try an input in this process: what came of it, its processor time and the peak of memory."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    with tempfile.TemporaryDirectory() as name, _standard_error() as said:
        folder = Path(name)
        door.prepare(data, folder)
        before, began = _contents(folder, door), time.process_time()
        kind, detail = "taken", ""
        try:
            door.enter(folder)
        except GraspPlannerError as error:
            kind = "refused"
            if "\n" in str(error):
                kind, detail = "broken", f"more than one line: {error!r}"[:300]
        except BaseException as error:  # what this script looks for
            kind, detail = "broken", f"{type(error).__name__}: {error}"[:300]
        took = time.process_time() - began
        lost = before - _contents(folder, door)
        said.seek(0)
        text = said.read().decode(errors="replace")
    status = Path("/proc/self/status").read_text(encoding="ascii")
    peak = int(re.findall(r"VmHWM:\s*(\d+) kB", status)[0]) / 1000.0
    if "Traceback" in text:
        kind, detail = "broken", f"a traceback: {text.strip().splitlines()[-1]}"[:300]
    if lost:
        kind, detail = "broken", f"{len(lost)} files lost"
    return {"kind": kind, "detail": detail, "cpu_s": took, "peak_mb": peak}


def _contents(folder: Path, door: Door) -> Counter[bytes]:
    """Return what files hold that may move but not go."""
    files = (path for path in folder.rglob("*") if path.is_file() and not door.rewritten(path.name))
    return Counter(path.read_bytes() for path in files)


@contextlib.contextmanager
def _standard_error() -> Iterator[Any]:
    """Catch what the process writes to standard error, whoever writes it."""
    with tempfile.TemporaryFile() as file:
        kept = os.dup(2)
        os.dup2(file.fileno(), 2)
        try:
            yield file
        finally:
            sys.stderr.flush()
            os.dup2(kept, 2)
            os.close(kept)


def serve(handle: int) -> None:
    """Try the inputs that come through a pipe until it ends."""
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES, ADDRESSES))
    warnings.simplefilter("ignore")
    known = doors()
    with Connection(handle) as pipe, contextlib.suppress(EOFError):
        while True:
            number, seed = pipe.recv()
            pipe.send(try_input(*case(number, seed, known)))


class Watched:
    """The process that tries inputs, made anew when it dies or hangs."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def tried(self, number: int, seed: int) -> dict[str, Any]:
        """Return what came of an input."""
        if self._process is None:
            self._pipe, theirs = Pipe()
            words = [sys.executable, __file__, "--serve", str(theirs.fileno())]
            self._process = subprocess.Popen(words, pass_fds=[theirs.fileno()])
            theirs.close()
        self._pipe.send((number, seed))
        detail = "hangs"
        if self._pipe.poll(PATIENCE_S):
            try:
                return self._pipe.recv()
            except (EOFError, OSError):
                detail = "the process died"
        self.end()
        return {"kind": "broken", "detail": detail, "cpu_s": 0.0, "peak_mb": 0.0}

    def end(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None


def fuzz(numbers: range, seed: int) -> dict[str, Any]:
    """Try damaged inputs at all doors in turn.

    Args:
        numbers: Which.
        seed: Seed of the damage.

    Returns:
        How many were tried, taken and refused at each door, the longest and the largest, and what broke.
    """
    known, watched = doors(), Watched()
    counts: dict[str, Counter[str]] = {door.name: Counter() for door in known}
    broken, slowest, largest = [], 0.0, 0.0
    for number in numbers:
        name, found = known[number % len(known)].name, watched.tried(number, seed)
        counts[name][found["kind"]] += 1
        slowest, largest = max(slowest, found["cpu_s"]), max(largest, found["peak_mb"])
        if found["cpu_s"] > LIMIT_S or found["peak_mb"] > LIMIT_MB:
            found |= {"kind": "broken", "detail": f"{found['cpu_s']:.0f} s, {found['peak_mb']:.0f} MB"}
        if found["kind"] == "broken":
            broken.append({"door": name, "number": number, "what": found["detail"]})
            sys.stderr.write(json.dumps(broken[-1]) + "\n")
    watched.end()
    total = Counter[str]()
    for count in counts.values():
        total.update(count)
    tried = {"inputs": len(numbers), "seed": seed, "doors": len(known), **total}
    return {
        **tried,
        "slowest_s": round(slowest, 1),
        "largest_mb": round(largest),
        "broken": broken,
        "by door": {name: dict(count) for name, count in counts.items()},
    }


def main() -> None:
    """Run from the command line; exit code 1 if anything broke."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="try this input alone")
    parser.add_argument("--show", action="store_true", help="with --only: write the input to standard output instead")
    parser.add_argument("--serve", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve is not None:
        serve(options.serve)
        return
    numbers = range(options.inputs) if options.only is None else range(options.only, options.only + 1)
    with tempfile.TemporaryDirectory(prefix="fuzz-") as place:
        # Nothing is left behind, and the user's cache is not touched.
        tempfile.tempdir = os.environ["TMPDIR"] = os.environ["XDG_CACHE_HOME"] = place
        if options.show:
            sys.stdout.buffer.write(case(options.only, options.seed, doors())[1])
            return
        report = fuzz(numbers, options.seed)
    sys.stdout.write(json.dumps(report, indent=1) + "\n")
    sys.exit(bool(report["broken"]))


if __name__ == "__main__":
    main()
