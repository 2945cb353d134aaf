"""Fuzz the doors of the package with seeded damage to good inputs: every answer is a value or one typed error.

``python scripts/fuzz.py --inputs 5000 --seed 0`` prints what broke: tracebacks, inputs above 60 s. Each door gets a
good input of its own kind with bytes, words or numbers replaced; the same seed gives the same inputs.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import grasp_planner as gp
from grasp_planner.batch import read_spec
from grasp_planner.batch.expand import CaseTable
from grasp_planner.cli.batch import parse_rows
from grasp_planner.exceptions import GraspPlannerError
from grasp_planner.model.task_direction import parse_task
from grasp_planner.objects import parse_object
from grasp_planner.objects.mesh_file import read_solid
from grasp_planner.synergies.space import load_synergies

ROOT = Path(__file__).parents[1]
LIMIT_S = 60.0
"""Processor time of one input above which it counts as broken [s]."""
WORDS = (
    b"1e308",
    b"-1",
    b"0",
    b"nan",
    b"inf",
    b"1e-300",
    b"99999999999999999999",
    b"null",
    b"[]",
    b"{}",
    b'""',
    b"true",
    b"&a [*a]",
    b"!!int ''",
    b"\xff",
    b"\x00",
    b"<!DOCTYPE a>",
    b"../../x",
    b"-",
    b",,",
    b"\n",
    b"'",
    b"mesh:/dev/zero.stl",
)
"""What good parts are replaced by."""

SPEC = b"""seed: 1
defaults: {hand: dlr_hit_ii_right, object: "cylinder:radius=0.03", paper: true}
blocks:
  - product: {seed: {from: 0, to: 5}, friction: {uniform: [0.5, 0.9], count: 3}}
  - zip: {object.radius: [0.02, 0.03], task: ["force:+x", "torque:+z"]}
overrides: [{where: {seed: 3}, set: {n_synergies: 4}}]
"""
TETRAHEDRON = b"""v 0 0 0
v 0.05 0 0
v 0 0.05 0
v 0 0 0.05
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
"""


def damaged(rng: np.random.Generator, data: bytes) -> bytes:
    """Return a good input with one to four parts replaced, removed or doubled."""
    for _ in range(rng.integers(1, 5)):
        start = int(rng.integers(0, len(data) + 1))
        end = min(len(data), start + int(rng.integers(0, 12)))
        kind = rng.integers(0, 4)
        if kind == 0:
            data = data[:start] + rng.bytes(int(rng.integers(1, 5))) + data[end:]
        elif kind == 1:
            data = data[:start] + WORDS[rng.integers(0, len(WORDS))] + data[end:]
        elif kind == 2:
            data = data[:start] + data[end:]
        else:
            data = data[:end] + data[start:end] * int(rng.integers(1, 4)) + data[end:]
    return data


def as_file(read: Callable[[Path], Any], suffix: str) -> Callable[[bytes, Path], Any]:
    """Return a door that takes a file."""

    def door(data: bytes, folder: Path) -> Any:
        path = folder / f"input{suffix}"
        path.write_bytes(data)
        return read(path)

    return door


def as_text(read: Callable[[str], Any]) -> Callable[[bytes, Path], Any]:
    """Return a door that takes a text."""
    return lambda data, _: read(data.decode(errors="replace"))


def doors() -> dict[str, tuple[Callable[[bytes, Path], Any], bytes]]:
    """Return every door with a good input, by name."""
    grasp = min((ROOT / "tests" / "data").glob("*.json")).read_bytes()
    synergies = min((ROOT / "urdf").rglob("*.csv")).read_bytes()
    hand = min((ROOT / "urdf").glob("*/*.toml")).read_bytes()
    return {
        "grasp": (as_file(lambda path: gp.grasp_from_record(gp.read_grasp_record(path)), ".json"), grasp),
        "spec": (as_file(lambda path: CaseTable(read_spec(path))[0], ".yaml"), SPEC),
        "hand": (as_file(gp.load_hand, ".toml"), hand),
        "synergies": (as_file(load_synergies, ".csv"), synergies),
        "mesh": (as_file(read_solid, ".obj"), TETRAHEDRON),
        "object": (as_text(parse_object), b"cylinder:radius=0.03,height=0.15,mass=0.2,edge=0.002"),
        "task": (as_text(parse_task), b"twist:+0.1,0.2,0.3,0,0,1*0.5"),
        "rows": (as_text(parse_rows), b"0,4,10-19,30"),
    }


def fuzz(inputs: int, seed: int) -> dict[str, Any]:
    """Try damaged inputs at all doors in turn.

    Args:
        inputs: How many.
        seed: Seed of the damage.

    Returns:
        How many were tried and refused, and what broke: door, number of the input, what was raised.
    """
    rng, found = np.random.default_rng(seed), list(doors().items())
    refused, broken, slowest = 0, [], 0.0
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for number in range(inputs):
            name, (door, good) = found[number % len(found)]
            data, began = damaged(rng, good), time.process_time()
            try:
                door(data, Path(folder))
            except GraspPlannerError:
                refused += 1
            except Exception as error:  # what this script looks for
                broken.append((name, number, f"{type(error).__name__}: {error}"[:200]))
            took = time.process_time() - began
            slowest = max(slowest, took)
            if took > LIMIT_S:
                broken.append((name, number, f"took {took:.0f} s"))
    return {"inputs": inputs, "seed": seed, "refused": refused, "slowest_s": round(slowest, 2), "broken": broken}


def main() -> None:
    """Run from the command line; exit code 1 if anything broke."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    report = fuzz(options.inputs, options.seed)
    sys.stdout.write(json.dumps(report, indent=1) + "\n")
    sys.exit(bool(report["broken"]))


if __name__ == "__main__":
    main()
