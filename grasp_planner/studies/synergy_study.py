"""Physics against the number of synergies: random problems planned and simulated, row by row."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..checks import positive, positive_whole
from ..exceptions import InvalidValueError
from ..hand.loading import load_hand
from ..planning.planner import plan_grasp
from ..problem.load_cases import LoadCases
from ..problem.parameters import GraspParameters
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from ..processes import Job, JobContext, JobFunction
from ..simulate import Protocol, error_protocol, find_protocol, simulate_grasp, survival
from .benchmark_problems import BenchmarkCase, object_kinds, on_table
from .study_folder import check_same_study
from .study_margins import grasp_as_simulated, static_margins
from .study_rows import COLUMNS, Key, StudyRow, row_values
from .study_rows import load_study as load_study

if TYPE_CHECKING:
    from ..batch import BatchProgress, BatchSummary

SPARE_S = 900.0
"""Wall time a case may take beyond the limit of its search, until its worker is killed [s]."""
CPU_SHARE = 20.0
"""Wall time of a search over its processor time, at most, on a busy machine."""


@dataclass(frozen=True)
class StudySettings:
    """What is studied.

    Attributes:
        hand: Hand by name or description file.
        synergy_sets: Names of synergy sets.
        object_kinds: Kinds of random objects, out of :data:`~grasp_planner.studies.benchmark_problems.OBJECTS`.
        counts: Numbers of synergies.
        problems: Random problems for each set, kind and number; their seeds are 0, 1, ….
        contact_set: Contact set; the hand's default if None.
        clearance: Whether links keep clear; if not, only the fingertips collide in the simulation.
        loads: Whether the plans have to hold the standard load cases.
        friction_safety: s ≥ 1: the plans' forces stay in the cones of μ/s; the standard's 1.2 with load cases and 1
            without if None.
        squeeze: Factor on δσ in the simulation.
        protocol: Name of the protocol.
        firmness: How many times the planned efforts the motors squeeze with where the hand closes; the protocol's if
            None.
        starts: Most starts of a search.
        enough: Feasible grasps after which a search ends with the best of them, one that closes if there is one.
        time_limit_s: Longest search, wall time [s]; None for no limit.
        cpu_limit_s: Longest search, processor time [s]; None for no limit.
        errors: Samples of each row of random errors with which every grasp closes once more
            (:func:`~grasp_planner.simulate.survival`), around an object that is handed over or on a table where that
            is the protocol and around a free one otherwise; 0 for none of this.
        table: Whether objects stand on a table, which plans keep clear of.
        joint_compliance: C_q of every joint [rad/(N m)]; the standard's if None.
        paper: Whether plans are the paper's: forces by (17), weighed against the task.
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
    firmness: float | None = None
    starts: int = 40
    enough: int = 4
    time_limit_s: float | None = 60.0
    cpu_limit_s: float | None = None
    errors: int = 0
    table: bool = False
    joint_compliance: float | None = None
    paper: bool = False

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
        if self.errors != 0:
            positive_whole("errors", self.errors)
        positive("squeeze", self.squeeze)
        if self.cpu_limit_s is not None:
            positive("cpu_limit", self.cpu_limit_s, unit="s")
        _ = self.options
        if self.friction_safety is not None:
            replace(LoadCases.off(), friction_safety=self.friction_safety)
        _ = self.parameters
        _ = self.test
        hand.contact_frames(self.contact_set)

    @property
    def cases(self) -> tuple[Key, ...]:
        """Every case by the number of its row; those of more problems come after those of fewer."""
        groups = tuple(product(self.synergy_sets, self.object_kinds, self.counts))
        return tuple((*group, seed) for seed in range(self.problems) for group in groups)

    @property
    def options(self) -> PlannerOptions:
        """How hard a search tries."""
        return PlannerOptions(starts=self.starts, enough=self.enough, time_limit_s=self.time_limit_s)

    @property
    def parameters(self) -> GraspParameters:
        """Parameters of every problem; what is open in them is the hand's."""
        given = GraspParameters()
        if self.joint_compliance is not None:
            given = replace(given, joint_compliance=self.joint_compliance)
        return given.of_paper() if self.paper else given

    @property
    def case_limit_s(self) -> float | None:
        """Wall time after which the worker of a case is killed [s]; None without limits of the search."""
        cpu = None if self.cpu_limit_s is None else CPU_SHARE * self.cpu_limit_s
        limits = [limit for limit in (self.time_limit_s, cpu) if limit is not None]
        return min(limits) + SPARE_S if limits else None

    @property
    def test(self) -> Protocol:
        """The protocol: forces only, with a ladder."""
        geometry: Any = "links" if self.clearance else "contacts"
        return replace(
            find_protocol(self.protocol, self.firmness), geometry=geometry, torques=False, ladder_accuracy=0.1
        )

    @property
    def error_test(self) -> Protocol:
        """The protocol that is tried with errors."""
        return find_protocol(error_protocol(self.protocol), self.firmness)

    def problem(self, key: Key) -> GraspProblem:
        """Return the problem of a case."""
        synergy_set, kind, count, seed = key
        sets = {"synergy_set": synergy_set, "contact_set": self.contact_set}
        case = BenchmarkCase(seed, count, self.hand, kind, **sets, clearance=self.clearance, loads=self.loads)
        problem = on_table(case.problem()) if self.table else case.problem()
        if self.friction_safety is not None:
            problem = replace(problem, loads=replace(problem.loads, friction_safety=self.friction_safety))
        return replace(problem, parameters=self.parameters)


def study_case(settings: StudySettings, key: Key) -> StudyRow:
    """Plan, measure and simulate one random problem."""
    limit, began = settings.cpu_limit_s, time.process_time()
    grasp = plan_grasp(
        settings.problem(key),
        seed=key[-1],
        options=settings.options,
        cancel=lambda: limit is not None and time.process_time() - began > limit,
    )
    if not grasp.feasible:
        return StudyRow(*key, feasible=False)
    found = simulate_grasp(grasp, settings.test, squeeze=settings.squeeze)
    rest = found.rest
    return StudyRow(
        *key,
        feasible=True,
        refused=found.rest is None,
        passed=found.passed,
        forces_held=found.forces_held,
        weakest_force=found.weakest("force"),
        rest_held=None if rest is None else rest.held,
        rest_displacement=None if rest is None else rest.displacement,
        normal_force_error=None if rest is None else rest.normal_force_error,
        margins=static_margins(grasp_as_simulated(found)),
        survival=survival(grasp, seed=key[-1], samples=settings.errors, protocol=settings.error_test)
        if settings.errors
        else None,
    )


def run_study(
    settings: StudySettings,
    folder: Path,
    workers: int = 1,
    on_progress: Callable[[BatchProgress], None] | None = None,
) -> BatchSummary:
    """Work off the cases of a study as a batch; a second call goes on, also with more problems.

    Args:
        settings: What is studied.
        folder: Folder of the study, laid out as that of any batch (:mod:`grasp_planner.batch.store`).
        workers: Worker processes.
        on_progress: Called several times a second.

    Returns:
        What it came to.

    Raises:
        BatchDependencyError: If the extra ``batch`` is not installed.
        FileFormatError: If the folder can't be written or holds another study.
    """
    from ..batch.run_files import RunInfo
    from ..batch.work import RowWork, work_off_rows

    cases, given = settings.cases, json.loads(json.dumps(asdict(settings)))
    check_same_study(folder, given)
    same = json.dumps({name: value for name, value in given.items() if name != "problems"}, sort_keys=True)
    digest = hashlib.sha256(same.encode()).hexdigest()[:16]
    info = RunInfo(digest, len(cases), "grasp_planner.studies.synergy_study", COLUMNS, json.dumps(given, indent=1))

    def job(row: int) -> Job:
        return Job(row, {"row": row, "key": cases[row]}, settings.case_limit_s)

    def failed(row: int, status: str, reason: str, message: str) -> dict[str, Any]:
        text = message if status == "error" else f"{reason}: {message}"
        return row_values(row, StudyRow(*cases[row], feasible=False, message=text), status)

    function = JobFunction(f"{__name__}:case_answer", {"settings": settings})
    return work_off_rows(RowWork(info, function, job, failed), folder, workers=workers, on_progress=on_progress)


def case_answer(settings: StudySettings) -> Callable[[dict[str, Any], JobContext], dict[str, Any]]:
    """Return what answers a job of a study, in the worker process."""
    return lambda job, _: row_values(job["row"], study_case(settings, job["key"]), "done")
