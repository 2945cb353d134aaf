"""The batched springs problem on JAX's arrays, on the processor: the second library that carries it.

``rows`` compares all rows of a compiled batch with NumPy's; ``search`` runs phase one and lets NumPy judge what it
finds; ``times`` measures batches. Each prints a Markdown table. Compiled is a proof: a function of NumPy's that is
called on the way raises there, where JAX by itself would quietly hand it a copy.

Usage: python scripts/other_namespace.py rows [--single] | search | times
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

import jax
import numpy as np

import grasp_planner as gp
from grasp_planner.multistart.pool import Pool
from grasp_planner.multistart.problem_rows import UNITS, BatchedProblem
from grasp_planner.multistart.rows import Rows
from grasp_planner.multistart.states import States
from grasp_planner.planning.pooled_starts import random_states
from grasp_planner.spatial import Array
from grasp_planner.studies.benchmark import fastest

jax.tree_util.register_dataclass(States, ["joints", "rotation", "translation", "forces", "most_force"], [])
jax.tree_util.register_dataclass(Rows, ["value", "derivative"], ["name", "equality"])

OBJECTS = ("sphere:radius=0.03", "cylinder:radius=0.03", "box:x=0.05,y=0.06,z=0.08")
WIDTHS = (64, 256, 1024)
REPEATS = 5
"""Evaluations of a batch; the fastest counts."""
COMPARED, WIDTH, WANTED = 6, 12, 3
"""States whose rows are compared, states at a time of phase one, and feasible ones after which it ends."""


def problem_of(text: str) -> gp.GraspProblem:
    """Return a problem with load cases and every clearance of links, also from the ground."""
    clearance = gp.ClearanceOptions(ground=-0.05)
    return gp.GraspProblem(gp.load_hand("dlr_hit_ii_right"), gp.parse_object(text), clearance=clearance)


def on_jax(states: States) -> States:
    """Return states as arrays of JAX."""
    return jax.tree_util.tree_map(jax.numpy.asarray, states)


class CompiledProblem(BatchedProblem):
    """Evaluates up to a number of states by one compiled function, which repeats states to fill up shorter batches."""

    def __init__(self, problem: gp.GraspProblem, width: int) -> None:
        super().__init__(problem)
        self.width = width
        self._compiled = jax.jit(super().rows)

    def rows(self, states: States) -> list[Rows]:
        """Return the rows of states."""
        count = len(states)
        found = self._compiled(states.take(np.arange(self.width) % count))
        return jax.tree_util.tree_map(lambda each: each[:count], found)


def print_rows() -> None:
    """Print how far compiled rows are from NumPy's, against the largest of a requirement or 1."""
    print("| object | requirement | library | values | derivatives |\n|---|---|---|---|---|")
    for text in OBJECTS:
        batched, rng = BatchedProblem(problem_of(text)), np.random.default_rng(0)
        states = random_states(batched, COMPARED, rng)
        states = replace(states, forces=rng.normal(0.0, 2.0, states.forces.shape), most_force=np.full(COMPARED, 5.0))
        pairs = zip(batched.rows(states), jax.jit(batched.rows)(on_jax(states)), strict=True)
        for ours, theirs in pairs:
            value, slope = off(ours.value, theirs.value), off(ours.derivative, theirs.derivative)
            kind, library = text.split(":")[0], type(theirs.derivative).__module__.split(".")[0]
            print(f"| {kind} | {ours.name} | {library} {theirs.derivative.dtype} | {value:.1e} | {slope:.1e} |")


def off(expected: Array, found: jax.Array) -> float:
    """Return the largest difference against the largest number expected, or against 1."""
    largest = max(1.0, float(np.abs(expected).max(initial=0.0)))
    return float(np.abs(expected - np.asarray(found)).max(initial=0.0)) / largest


def print_search() -> None:
    """Print the largest weighted violation, by NumPy's rows, of feasible states that phase one finds."""
    print("| feasible state | library | largest violation by NumPy | of |\n|---|---|---|---|")
    problem, rng = problem_of(OBJECTS[0]), np.random.default_rng(0)
    numpy, pool = BatchedProblem(problem), Pool(CompiledProblem(problem, WIDTH), WIDTH)
    search = pool.search(lambda number: on_jax(random_states(numpy, number, rng)), 10 * WIDTH, lambda: None)
    for number, states in zip(range(WANTED), search, strict=False):
        worst, name = max(violations(numpy.rows(jax.tree_util.tree_map(np.asarray, states))))
        print(f"| {number + 1} | {type(states.joints).__module__.split('.')[0]} | {worst:.1e} | {name} |")


def violations(found: list[Rows]) -> list[tuple[float, str]]:
    """Return the largest weighted violation of every requirement, as the pool weights it."""
    result = []
    for rows in found:
        unit = UNITS[rows.name]
        value = unit.weight * rows.value
        short = np.abs(value) if rows.equality else unit.weight * unit.margin - value
        result.append((float(short.max(initial=0.0)), rows.name))
    return result


def print_times() -> None:
    """Print the processor time of a batch, per state, and of compiling it."""
    batched = BatchedProblem(problem_of(OBJECTS[1]))
    print("| states | NumPy [µs a state] | JAX, compiled | JAX, call by call | compiling [s] |\n|---|---|---|---|---|")
    for width in WIDTHS:
        states = random_states(batched, width, np.random.default_rng(0))
        compiled, moved = jax.jit(batched.rows), on_jax(states)
        began = time.process_time()
        jax.block_until_ready(compiled(moved))
        compiling = time.process_time() - began
        jax.block_until_ready(batched.rows(moved))  # every operation is compiled the first time
        runs = ((batched.rows, states), (compiled, moved), (batched.rows, moved))
        numbers = [cost(rows, given) for rows, given in runs]
        print(f"| {width} | " + " | ".join(f"{number:.0f}" for number in numbers) + f" | {compiling:.1f} |")


def cost(rows: Callable[[States], list[Rows]], states: States) -> float:
    """Return the processor time of evaluating a batch, per state [µs]."""
    batches = [states] * REPEATS
    return 1e6 * fastest(lambda each: jax.block_until_ready(rows(each)), batches, time.process_time) / len(states)


def main() -> None:
    """Compare, search or measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("rows", "search", "times"))
    parser.add_argument("--single", action="store_true", help="in single precision")
    given = parser.parse_args()
    jax.config.update("jax_enable_x64", not given.single)
    {"rows": print_rows, "search": print_search, "times": print_times}[given.what]()


if __name__ == "__main__":
    main()
