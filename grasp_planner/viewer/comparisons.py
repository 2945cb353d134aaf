"""Series of problems that differ in one thing, planned one after the other and laid side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ..grasp.grasp import Grasp
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from .choices import usable_synergy_sets
from .panels.compare import ComparePanel
from .panels.plan import PlanPanel
from .panels.synergies import most_synergies
from .planning import PlanEvents, PlanningProcess, PlanRequest, SearchEnd
from .presets import paper_presets
from .session import Session
from .worker import Worker

COUNTS = (1, 2, 3, 5, 8, 15)
"""Numbers of synergies that are compared, as far as the set has so many."""
HUMAN_SETS = ("santello", "uji", "santello_clear")
"""Synergy sets that come from human hands; the others come from grasps that were planned."""
RECENTRED = "_recentred"
"""How the names of sets end whose synergies are human and whose mean posture is not."""
TIME_LIMIT_S = 20.0
"""Most time for each problem of a series [s]."""


@dataclass(frozen=True)
class Case:
    """One problem of a series.

    Attributes:
        label: What is particular about it.
        problem: The problem.
    """

    label: str
    problem: GraspProblem


def synergy_cases(problem: GraspProblem) -> tuple[Case, ...]:
    """Return a problem with 1 to 15 synergies."""
    most = most_synergies(problem)
    return tuple(Case(f"n_s = {n}", replace(problem, n_synergies=n)) for n in COUNTS if n <= most)


def set_cases(problem: GraspProblem) -> tuple[Case, ...]:
    """Return a problem with every synergy set of its hand, human ones and made ones."""
    cases = []
    for name in usable_synergy_sets(problem.hand):
        count = min(problem.n_synergies, problem.hand.synergies(name).n_synergies)
        mixed = "human about a made mean" if name.endswith(RECENTRED) else "made"
        kind = "human" if name in HUMAN_SETS else mixed
        changed = replace(problem, synergy_set=name, synergy_space=None, n_synergies=count)
        cases.append(Case(f"{name} ({kind})", changed))
    return tuple(cases)


def paper_cases(_: GraspProblem) -> tuple[Case, ...]:
    """Return the problems of the paper's Table I, whatever is shown."""
    table = [preset for preset in paper_presets().values() if preset.cell.table == 1]
    return tuple(Case(f"{preset.cell.n_synergies}, {preset.cell.direction}", preset.problem()) for preset in table)


SERIES: dict[str, Callable[[GraspProblem], tuple[Case, ...]]] = {
    "1 to 15 synergies": synergy_cases,
    "synergy sets, human and made": set_cases,
    "Table I of the paper": paper_cases,
}
"""All series by their name."""


class Comparison:
    """Plans a series; its methods are for the worker's thread.

    Attributes:
        cases: The problems.
        found: What was found for each so far: a grasp, or the attempt nearest to one.
    """

    def __init__(
        self,
        session: Session,
        panel: ComparePanel,
        plan: PlanPanel,
        planning: PlanningProcess,
        worker: Worker,
    ) -> None:
        self._session, self._panel, self._plan, self._planning = session, panel, plan, planning
        self._worker = worker
        self.cases: tuple[Case, ...] = ()
        self.found: list[Grasp | None] = []

    def start(self) -> None:
        """Plan the series that is chosen for the problem shown, each problem for a short time at most."""
        if self._planning.busy:
            return
        self.cases = SERIES[self._panel.series.value](self._session.problem)
        self.found = [None] * len(self.cases)
        options: PlannerOptions = self._plan.search.options(PlannerOptions())
        limit = min(TIME_LIMIT_S, options.time_limit_s or TIME_LIMIT_S)
        self._begin(0, replace(options, enough=1, time_limit_s=limit), int(self._plan.seed.value))

    def entries(self) -> list[tuple[str, Grasp | None]]:
        """Return what the cards of the series tell of."""
        return [(case.label, grasp) for case, grasp in zip(self.cases, self.found, strict=True)]

    def shown(self) -> int | None:
        """Return which grasp of the series is drawn; None if none is."""
        places = [index for index, grasp in enumerate(self.found) if grasp is self._session.grasp]
        return places[0] if places else None

    def choose(self, index: int) -> None:
        """Show a grasp of the series."""
        grasp = self.found[index]
        if grasp is not None:
            self._session.show(grasp, f"compared: {self.cases[index].label}")
            self._session.moves += 1

    def _begin(self, index: int, options: PlannerOptions, seed: int) -> None:
        """Plan one problem and then those that follow."""

        def take(grasps: Sequence[Grasp]) -> None:
            self.found[index] = grasps[0]
            self._session.dirty = True

        def end(outcome: SearchEnd, message: str) -> None:
            if outcome == "done" and index + 1 < len(self.cases):
                self._begin(index + 1, options, seed)
                return
            self._plan.set_running(False)
            self._panel.status.content = outcome if outcome != "failed" else message
            self._session.dirty = True

        events = PlanEvents(
            progress=lambda _: None,
            result=lambda _: None,
            best=lambda grasps: self._worker.submit(lambda: take(grasps)),
            end=lambda outcome, message: self._worker.submit(lambda: end(outcome, message)),
        )
        if self._planning.start(PlanRequest(self.cases[index].problem, seed, options), events):
            self._plan.set_running(True)
            self._panel.status.content = f"planning {index + 1} of {len(self.cases)}: {self.cases[index].label} …"
            self._session.dirty = True
