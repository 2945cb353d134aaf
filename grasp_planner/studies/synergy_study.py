"""Physics against the number of synergies: random problems planned and simulated, row by row."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from ..checks import positive, positive_whole
from ..exceptions import FileFormatError, InvalidValueError
from ..hand.loading import load_hand
from ..planning.options import PlannerOptions
from ..planning.planner import plan_grasp
from ..problem.load_cases import LoadCases
from ..problem.problem import GraspProblem
from ..simulate import Protocol, find_protocol, simulate_grasp
from .benchmark_problems import BenchmarkCase, object_kinds
from .study_margins import grasp_as_simulated, static_margins

ROWS_FILE = "rows.jsonl"
Key = tuple[str, str, int, int]
"""Synergy set, kind of object, number of synergies, seed."""


@dataclass(frozen=True)
class StudySettings:
    """What is studied.

    Attributes:
        hand: Hand by name or description file.
        synergy_sets: Names of synergy sets.
        object_kinds: Kinds of random objects, out of :data:`~grasp_planner.studies.benchmark_problems.OBJECTS`.
        counts: Numbers of synergies.
        problems: Random problems for each set, kind and number; their seeds are 0, 1, ….
        contact_set: Contact set; the hand's first if None.
        clearance: Whether links keep clear; if not, only the fingertips collide in the simulation.
        loads: Whether the plans have to hold the standard load cases.
        friction_safety: s ≥ 1: the plans' forces stay in the cones of μ/s; the standard's 1.2 with load cases and 1
            without if None.
        squeeze: Factor on δσ in the simulation.
        protocol: Name of the protocol.
        starts: Most starts of a search; the first feasible one is taken.
        time_limit_s: Longest search, wall time [s]; None for no limit.
        cpu_limit_s: Longest search, processor time [s]; None for no limit.
    """

    hand: str = "dlr_hit_ii_right"
    synergy_sets: tuple[str, ...] = ("native",)
    object_kinds: tuple[str, ...] = ("cylinder",)
    counts: tuple[int, ...] = tuple(range(1, 16))
    problems: int = 20
    contact_set: str | None = None
    clearance: bool = False
    loads: bool = False
    friction_safety: float | None = None
    squeeze: float = 1.0
    protocol: str = "plan"
    starts: int = 40
    time_limit_s: float | None = 60.0
    cpu_limit_s: float | None = None

    def __post_init__(self) -> None:
        hand = load_hand(self.hand)
        for name in self.synergy_sets:
            available = hand.synergies(name).n_synergies
            for count in self.counts:
                if not 1 <= count <= available:
                    raise InvalidValueError("counts", count, f"from 1 to {available} for synergy set {name}")
        object.__setattr__(self, "object_kinds", object_kinds(self.object_kinds))
        for name, given in (
            ("sets", self.synergy_sets),
            ("objects", self.object_kinds),
            ("counts", self.counts),
        ):
            if not given:
                raise InvalidValueError(name, "none", "at least one")
        positive_whole("problems", self.problems)
        positive("squeeze", self.squeeze)
        if self.cpu_limit_s is not None:
            positive("cpu_limit", self.cpu_limit_s, unit="s")
        PlannerOptions(starts=self.starts, time_limit_s=self.time_limit_s)
        if self.friction_safety is not None:
            replace(LoadCases.off(), friction_safety=self.friction_safety)
        find_protocol(self.protocol)
        hand.contact_frames(self.contact_set)

    @property
    def cases(self) -> tuple[Key, ...]:
        """Every case."""
        return tuple(product(self.synergy_sets, self.object_kinds, self.counts, range(self.problems)))

    @property
    def test(self) -> Protocol:
        """The protocol: forces only, with a ladder."""
        geometry: Any = "links" if self.clearance else "contacts"
        return replace(find_protocol(self.protocol), geometry=geometry, torques=False, ladder_accuracy=0.1)

    def problem(self, key: Key) -> GraspProblem:
        """Return the problem of a case."""
        synergy_set, kind, count, seed = key
        sets = {"synergy_set": synergy_set, "contact_set": self.contact_set}
        case = BenchmarkCase(seed, count, self.hand, kind, **sets, clearance=self.clearance, loads=self.loads)
        problem = case.problem()
        if self.friction_safety is None:
            return problem
        return replace(problem, loads=replace(problem.loads, friction_safety=self.friction_safety))


@dataclass(frozen=True)
class StudyRow:
    """One planned and simulated problem.

    Attributes:
        synergy_set: Name of the set.
        object_kind: Kind of object.
        n_synergies: n_s.
        seed: Seed of the problem and of its starts.
        feasible: Whether a feasible grasp was found; if not, the rest is None.
        refused: Whether the penetration gate refused it; if so, nothing was simulated.
        passed: Whether all six forces were held.
        forces_held: How many of them were.
        weakest_force: Load held in the weakest direction [N].
        rest_held: Whether the object was still within the limits at rest.
        rest_displacement: Of the object at rest [m].
        normal_force_error: Of the simulated normal forces at rest, relative to F.
        margins: Static margins by name, of the grasp as simulated; None where undefined.
    """

    synergy_set: str
    object_kind: str
    n_synergies: int
    seed: int
    feasible: bool
    refused: bool | None = None
    passed: bool | None = None
    forces_held: int | None = None
    weakest_force: float | None = None
    rest_held: bool | None = None
    rest_displacement: float | None = None
    normal_force_error: float | None = None
    margins: dict[str, float | None] | None = None

    @property
    def key(self) -> Key:
        """Which case it is."""
        return self.synergy_set, self.object_kind, self.n_synergies, self.seed


def study_case(settings: StudySettings, key: Key) -> StudyRow:
    """Plan, measure and simulate one random problem."""
    limit, began = settings.cpu_limit_s, time.process_time()
    grasp = plan_grasp(
        settings.problem(key),
        seed=key[-1],
        options=PlannerOptions(starts=settings.starts, enough=1, time_limit_s=settings.time_limit_s),
        cancel=lambda: limit is not None and time.process_time() - began > limit,
    )
    if not grasp.feasible:
        return StudyRow(*key, feasible=False)
    found = simulate_grasp(grasp, settings.test, squeeze=settings.squeeze)
    rest = found.rest
    return StudyRow(
        *key,
        feasible=True,
        refused=not found.gate_passed,
        passed=found.passed,
        forces_held=found.forces_held,
        weakest_force=found.weakest("force"),
        rest_held=None if rest is None else rest.held,
        rest_displacement=None if rest is None else rest.displacement,
        normal_force_error=None if rest is None else rest.normal_force_error,
        margins=static_margins(grasp_as_simulated(found)),
    )


def run_study(settings: StudySettings, folder: Path, workers: int = 1) -> Iterator[StudyRow]:
    """Work off the cases of a study; rows are written as they come, and a second call goes on.

    Args:
        settings: What is studied.
        folder: Folder of the study.
        workers: Worker processes.

    Yields:
        All rows, those of an earlier call first.

    Raises:
        FileFormatError: If the folder can't be written or holds another study.
    """
    done = _open(settings, folder)
    yield from done.values()
    left = [case for case in settings.cases if case not in done]
    with (folder / ROWS_FILE).open("a", encoding="utf-8") as file:
        for row in _run(settings, left, workers):
            file.write(json.dumps(asdict(row), allow_nan=False) + "\n")
            file.flush()
            yield row


def _run(settings: StudySettings, cases: Sequence[Key], workers: int) -> Iterator[StudyRow]:
    """Yield the rows of cases, in their order."""
    if workers <= 1 or not cases:
        for case in cases:
            yield study_case(settings, case)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(study_case, [settings] * len(cases), cases)


def _open(settings: StudySettings, folder: Path) -> dict[Key, StudyRow]:
    """Make the folder, or check that it holds this study, and return its rows."""
    about, path = folder / "study.json", folder / ROWS_FILE
    given = json.loads(json.dumps(asdict(settings)))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        held = json.loads(about.read_text(encoding="utf-8")) if about.exists() else given
        _check_same(folder, held, given)
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        rows = [StudyRow(**json.loads(line)) for line in lines]
        about.write_text(json.dumps(given, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise FileFormatError(folder, f"can't be written: {error.strerror}") from None
    except (ValueError, TypeError) as error:
        raise FileFormatError(folder, f"holds a damaged study: {error}") from None
    return {row.key: row for row in rows}


def _check_same(folder: Path, held: Any, given: dict[str, Any]) -> None:
    """Refuse the folder of another study; more problems are the same one, and its rows stay."""
    if not isinstance(held, dict):
        raise FileFormatError(folder, "holds a damaged study: study.json is no object")
    differ = [name for name in {**held, **given} if name != "problems" and held.get(name) != given.get(name)]
    if differ:
        name = differ[0]
        text = f"holds a study of other settings ({name}: {held.get(name)} there, {given.get(name)} asked for)"
        raise FileFormatError(folder, f"{text}; choose another folder")
    if held.get("problems", 0) > given["problems"]:
        raise FileFormatError(folder, f"holds a study of {held['problems']} problems; ask for at least as many")
