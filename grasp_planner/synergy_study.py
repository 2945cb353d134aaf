"""Physics against the number of synergies: random problems planned and simulated, and what predicts holding."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from .benchmark_problems import BenchmarkCase
from .exceptions import FileFormatError, GraspPlannerError, InvalidValueError
from .grasp import Grasp
from .hand import load_hand
from .planner import PlannerOptions, plan_grasp
from .simulate import Protocol, find_protocol, simulate_grasp

Margin = Callable[[Grasp], float]
ROWS_FILE = "rows.jsonl"


def least_friction_share(grasp: Grasp) -> float:
    """Return the least share of friction that is left at a contact, 1 − |f_t| / (μ f_n)."""
    usable = grasp.problem.parameters.friction * np.maximum(grasp.normal_forces, 1e-12)
    return float((grasp.friction_margins / usable).min())


def joint_spring_stiffness(grasp: Grasp) -> float:
    """Return the least stiffness [N/m] of the held object against translation by the joint springs alone.

    The least eigenvalue of G_t (J C_q Jᵀ)⁺ G_tᵀ, without the geometric terms of the preload.
    """
    jacobian, compliance = grasp.hand_jacobian, grasp.problem.joint_compliance
    springs = np.linalg.pinv((jacobian * compliance) @ jacobian.T, rcond=1e-9, hermitian=True)
    linear = grasp.grasp_matrix[:3]
    return float(np.linalg.eigvalsh(linear @ springs @ linear.T).min())


MARGINS: dict[str, Margin] = {
    "F": lambda grasp: grasp.force_norm,
    "F / floor": lambda grasp: grasp.force_norm / grasp.force_norm_floor,
    "force-closure margin": lambda grasp: grasp.force_closure_margin,
    "least friction share": least_friction_share,
    "least normal force": lambda grasp: float(grasp.normal_forces.min()),
    "least spring stiffness": joint_spring_stiffness,
}
"""Static margins of a grasp that are compared with the simulated load at failure; add yours here."""


@dataclass(frozen=True)
class StudySettings:
    """What is studied.

    Attributes:
        hand: Hand by name or description file.
        synergy_sets: Names of synergy sets.
        counts: Numbers of synergies.
        problems: Random problems for each set and number; their seeds are 0, 1, ….
        contact_set: Contact set; the hand's first if None.
        clearance: Whether links keep clear; if not, only the fingertips collide in the simulation.
        loads: Whether the plans have to hold the standard load cases.
        squeeze: Factor on δσ in the simulation.
        protocol: Name of the protocol.
        starts: Most starts of a search; the first feasible one is taken.
        time_limit_s: Longest search [s].
    """

    hand: str = "dlr_hit_ii_right"
    synergy_sets: tuple[str, ...] = ("native",)
    counts: tuple[int, ...] = tuple(range(1, 16))
    problems: int = 20
    contact_set: str | None = None
    clearance: bool = False
    loads: bool = False
    squeeze: float = 1.0
    protocol: str = "plan"
    starts: int = 40
    time_limit_s: float = 60.0

    def __post_init__(self) -> None:
        hand = load_hand(self.hand)
        for name in self.synergy_sets:
            available = hand.synergies(name).n_synergies
            for count in self.counts:
                if not 1 <= count <= available:
                    raise InvalidValueError("counts", count, f"from 1 to {available} for synergy set {name}")
        if not self.synergy_sets or not self.counts or self.problems < 1:
            raise InvalidValueError("synergy_sets, counts, problems", "none", "at least one of each")
        if not self.squeeze > 0.0:
            raise InvalidValueError("squeeze", self.squeeze, "a number > 0")
        find_protocol(self.protocol)
        hand.contact_frames(self.contact_set)

    @property
    def cases(self) -> tuple[tuple[str, int, int], ...]:
        """Synergy set, number of synergies and seed of every case."""
        seeds = range(self.problems)
        return tuple((name, count, seed) for name in self.synergy_sets for count in self.counts for seed in seeds)

    @property
    def test(self) -> Protocol:
        """The protocol: forces only, with a ladder."""
        geometry: Any = "links" if self.clearance else "contacts"
        return replace(find_protocol(self.protocol), geometry=geometry, torques=False, ladder_accuracy=0.1)


@dataclass(frozen=True)
class StudyRow:
    """One planned and simulated problem.

    Attributes:
        synergy_set: Name of the set.
        n_synergies: n_s.
        seed: Seed of the problem and of its starts.
        feasible: Whether a feasible grasp was found; if not, the rest is None.
        refused: Whether the penetration gate refused it.
        passed: Whether all six forces were held.
        forces_held: How many of them were.
        weakest_force: Load held in the weakest direction [N].
        rest_displacement: Of the object at rest [m].
        normal_force_error: Of the simulated normal forces, relative to F.
        margins: Static margins by name; None where not finite.
    """

    synergy_set: str
    n_synergies: int
    seed: int
    feasible: bool
    refused: bool | None = None
    passed: bool | None = None
    forces_held: int | None = None
    weakest_force: float | None = None
    rest_displacement: float | None = None
    normal_force_error: float | None = None
    margins: dict[str, float | None] | None = None

    @property
    def key(self) -> tuple[str, int, int]:
        """Which case it is."""
        return self.synergy_set, self.n_synergies, self.seed


def study_case(settings: StudySettings, synergy_set: str, n_synergies: int, seed: int) -> StudyRow:
    """Plan, measure and simulate one random problem."""
    problem = BenchmarkCase(
        seed,
        n_synergies,
        settings.hand,
        synergy_set=synergy_set,
        contact_set=settings.contact_set,
        clearance=settings.clearance,
        loads=settings.loads,
    ).problem()
    options = PlannerOptions(starts=settings.starts, enough=1, time_limit_s=settings.time_limit_s)
    grasp = plan_grasp(problem, seed=seed, options=options)
    if not grasp.feasible:
        return StudyRow(synergy_set, n_synergies, seed, feasible=False)
    found = simulate_grasp(grasp, settings.test, squeeze=settings.squeeze)
    rest = found.rest
    return StudyRow(
        synergy_set=synergy_set,
        n_synergies=n_synergies,
        seed=seed,
        feasible=True,
        refused=not found.gate_passed,
        passed=found.passed,
        forces_held=found.forces_held,
        weakest_force=found.weakest("force"),
        rest_displacement=None if rest is None else rest.displacement,
        normal_force_error=None if rest is None else rest.normal_force_error,
        margins={name: _margin(margin, found.grasp) for name, margin in MARGINS.items()},
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


def rank_correlation(rows: Sequence[StudyRow], name: str) -> tuple[float, float, int]:
    """Return Spearman's ρ of a margin against the weakest force, its p-value and the number of grasps.

    Grasps that were refused count not at all; grasps lost before any push count with 0 N.
    """
    pairs = simulated_pairs(rows, name)
    if len(pairs) < 3 or len({pair[0] for pair in pairs}) < 2 or len({pair[1] for pair in pairs}) < 2:
        return math.nan, math.nan, len(pairs)
    result = spearmanr(*np.array(pairs)[:, :2].T)
    return float(result.statistic), float(result.pvalue), len(pairs)


def area_under_roc(rows: Sequence[StudyRow], name: str) -> float:
    """Return the chance that a margin is larger for a grasp that passed than for one that failed; nan if undefined."""
    pairs = simulated_pairs(rows, name)
    good = np.array([value for value, _, passed in pairs if passed])
    bad = np.array([value for value, _, passed in pairs if not passed])
    if not len(good) or not len(bad):
        return math.nan
    difference = good[:, None] - bad[None, :]
    return float((difference > 0.0).mean() + (difference == 0.0).mean() / 2)


def simulated_pairs(rows: Sequence[StudyRow], name: str) -> list[tuple[float, float, bool]]:
    """Return margin, weakest force and whether it passed, of the grasps that were simulated."""
    found = []
    for row in rows:
        value = (row.margins or {}).get(name)
        if row.weakest_force is not None and value is not None:
            found.append((value, row.weakest_force, bool(row.passed)))
    return found


def _margin(margin: Margin, grasp: Grasp) -> float | None:
    """Return a margin, None where it is not finite or undefined."""
    try:
        value = float(margin(grasp))
    except (GraspPlannerError, np.linalg.LinAlgError, ZeroDivisionError):
        return None
    return value if math.isfinite(value) else None


def _run(settings: StudySettings, cases: Sequence[tuple[str, int, int]], workers: int) -> Iterator[StudyRow]:
    """Yield the rows of cases, in their order."""
    if workers <= 1 or not cases:
        for case in cases:
            yield study_case(settings, *case)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        names, counts, seeds = zip(*cases, strict=True)
        yield from pool.map(study_case, [settings] * len(cases), names, counts, seeds)


def _open(settings: StudySettings, folder: Path) -> dict[tuple[str, int, int], StudyRow]:
    """Make the folder, or return the rows it holds."""
    about, text = folder / "study.json", json.dumps(asdict(settings), indent=1) + "\n"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not about.exists():
            about.write_text(text, encoding="utf-8")
        if about.read_text(encoding="utf-8") != text:
            raise FileFormatError(folder, "holds a study of other settings; choose another folder")
        path = folder / ROWS_FILE
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
        rows = [StudyRow(**json.loads(line)) for line in lines]
    except OSError as error:
        raise FileFormatError(folder, f"can't be written: {error.strerror}") from None
    except (ValueError, TypeError) as error:
        raise FileFormatError(folder / ROWS_FILE, f"is damaged: {error}") from None
    return {row.key: row for row in rows}
