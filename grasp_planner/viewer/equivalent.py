"""The command and the Python that plan what the page shows, to copy. Plain text; no display code here."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..hand.description import hand_library
from ..problem.clearance_options import ClearanceOptions
from ..problem.load_cases import LoadCases
from ..problem.parameters import GraspParameters
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from ..problem.settings import Setting, settings_of

OWNERS: tuple[tuple[str, type], ...] = (
    ("", GraspProblem),
    ("parameters", GraspParameters),
    ("clearance", ClearanceOptions),
    ("loads", LoadCases),
)
"""Fields of a problem that hold settings, and their classes; the problem itself first."""
Changed = tuple[Setting, Any]


def command_text(problem: GraspProblem, options: PlannerOptions | None = None, seed: int = 0, count: int = 1) -> str:
    """Return the command line that plans a problem.

    Args:
        problem: The problem.
        options: How it is searched.
        seed: Seed of the random starts.
        count: How many grasps that differ.
    """
    paper, found = differences(problem)
    words = ["grasp-planner", "plan", "--hand", problem.hand.name, "--object", problem.grasp_object.text]
    for task in problem.tasks:
        words += ["--task", task.text]
    words += ["--paper"] * paper
    if options is not None:
        found += search_differences(options)
    for each, value in found:
        words += _option(each, value)
    words += ["--seed", str(seed)] * bool(seed)
    words += ["--grasps", str(count)] * (count > 1)
    return shlex.join(words)


def python_text(problem: GraspProblem, seed: int = 0, count: int = 1) -> str:
    """Return the lines of Python that plan a problem."""
    paper = _is_paper(problem)
    base = _base(problem, paper)
    tasks = "".join(f"gp.parse_task({task.text!r}), " for task in problem.tasks).rstrip()
    lines = [
        "import grasp_planner as gp",
        "",
        f"problem = gp.GraspProblem{'.paper' * paper}(",
        f"    hand=gp.load_hand({problem.hand.name!r}),",
        f"    grasp_object=gp.parse_object({problem.grasp_object.text!r}),",
        f"    tasks=({tasks}),",
    ]
    for name, owner in OWNERS:
        changed = {each.name: value for each, value in _changed(_part(problem, name), _part(base, name), owner)}
        arguments = [f"{key}={_literal(value)}" for key, value in changed.items()]
        if name and arguments:
            start = ".off" if paper and name != "parameters" else ""
            made = f"gp.{owner.__name__}({', '.join(arguments)})"
            if start:
                made = f"replace(gp.{owner.__name__}.off(), {', '.join(arguments)})"
                lines[0] = "from dataclasses import replace\n\nimport grasp_planner as gp"
            lines.append(f"    {name}={made},")
        else:
            lines += [f"    {argument}," for argument in arguments]
    call = f"grasp = gp.plan_grasp(problem, seed={seed})"
    if count > 1:
        call = f"grasp, *others = gp.plan_grasps(problem, {count}, seed={seed})"
    return "\n".join([*lines, ")", call, "print(grasp.verdict)"])


def what_is_lost(problem: GraspProblem) -> str:
    """Return what neither text can say, in words; empty if nothing."""
    parts = []
    if problem.hand.name not in hand_library():
        parts.append("the file of the hand, to be given to --hand")
    if problem.synergy_space is not None:
        parts.append("synergies that belong to no set of the hand")
    if problem.costs or problem.constraints:
        parts.append("costs and constraints of your own")
    if problem.grasp_object.kind == "mesh":
        parts.append("the file of the mesh, which has to be there")
    return ", ".join(parts)


def differences(problem: GraspProblem) -> tuple[bool, list[Changed]]:
    """Return whether a problem is nearer to the paper's than to the usual one, and its settings that differ from it."""
    paper = _is_paper(problem)
    base = _base(problem, paper)
    parts = [(_part(problem, name), _part(base, name), owner) for name, owner in OWNERS]
    return paper, [entry for part in parts for entry in _changed(*part)]


def search_differences(options: PlannerOptions) -> list[Changed]:
    """Return the settings of a search that are not the defaults."""
    return list(_changed(options, PlannerOptions(), PlannerOptions))


def _base(problem: GraspProblem, paper: bool) -> GraspProblem:
    """Return the problem with everything but hand, object and tasks as it is by default."""
    make = GraspProblem.paper if paper else GraspProblem
    return make(problem.hand, problem.grasp_object, problem.tasks)


def _is_paper(problem: GraspProblem) -> bool:
    """Return whether a problem is nearer to the paper's than to the usual one."""
    counts = []
    for paper in (False, True):
        base = _base(problem, paper)
        parts = [(_part(problem, name), _part(base, name), owner) for name, owner in OWNERS]
        counts.append(sum(1 for part in parts for _ in _changed(*part)))
    return counts[1] < counts[0]


def _part(problem: GraspProblem, name: str) -> Any:
    """Return the dataclass that a field of the problem holds; parameters without what the hand itself gives."""
    if name == "parameters":
        return problem.parameters.without_hand(problem.hand)
    return getattr(problem, name) if name else problem


def _changed(values: Any, base: Any, owner: type) -> Iterator[Changed]:
    """Give the settings of a dataclass that are not those of another one, with their values."""
    for each in settings_of(owner):
        value = getattr(values, each.name)
        if not np.array_equal(value, getattr(base, each.name)):
            yield each, value


def _option(each: Setting, value: Any) -> list[str]:
    """Return a setting as words of the command line."""
    if each.kind == "truth" and value is not None:
        return [each.flag if value else f"--no-{each.flag.removeprefix('--')}"]
    if each.many:
        return [word for part in value for word in (each.flag, each.write(part))]
    return [each.flag, repr(value) if isinstance(value, float) else each.text(value)]


def _literal(value: Any) -> str:
    """Return a value as Python."""
    return f"[{', '.join(map(repr, value.tolist()))}]" if hasattr(value, "tolist") else repr(value)
