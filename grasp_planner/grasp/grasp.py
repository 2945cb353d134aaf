"""The result: a grasp that computes every number about itself and judges itself by what its problem requires."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from ..closing.closing import close_grasp, close_grasps
from ..closing.report import ClosingReport
from ..judge.posed_grasp import PosedGrasp
from ..terms.objective import problem_objective
from .search_report import IterationRecord as IterationRecord
from .search_report import SearchReport as SearchReport
from .verdict import Violation, all_violations, not_asked, verdict

FEASIBILITY_TOLERANCE = 1e-6
"""Largest violation of a feasible grasp, in SI units (m, rad, N, N m)."""

Status = Literal["feasible", "infeasible", "cancelled"]


@dataclass(frozen=True, eq=False, repr=False)
class Grasp(PosedGrasp):
    """A posture, a palm pose and synergy displacements, with everything that follows, judged by its problem.

    Every quantity comes from the plain formulas of :class:`~grasp_planner.judge.posed_grasp.PosedGrasp`; the
    requirements, the user's own among them, read only these. Frame O throughout.

    Attributes:
        search: How it was found; None for a grasp that was given.
    """

    search: SearchReport | None = field(default=None, compare=False)

    def with_search(self, search: SearchReport | None) -> Grasp:
        """Return it with another report, without computing again what is known of it."""
        found = replace(self, search=search)
        found.__dict__.update({name: value for name, value in self.__dict__.items() if name != "search"})
        return found

    @cached_property
    def objective(self) -> float:
        """Z = w_F F + w_C C, eq. (29), with the user's own costs; without weights C takes the place of the sum."""
        return problem_objective(self.problem).clear_value(self)

    @cached_property
    def violations(self) -> dict[str, Violation]:
        """Violation of every requirement of the problem, by its name."""
        return {found.name: found for found in all_violations(self)}

    @property
    def max_violation(self) -> float:
        """The largest of all violations, in SI units."""
        return float(np.max([found.value for found in self.violations.values()]))

    def failures(self, tolerance: float = FEASIBILITY_TOLERANCE) -> dict[str, Violation]:
        """Return the violations above a tolerance, largest first."""
        failed = [found for found in self.violations.values() if not found.value <= tolerance]
        failed.sort(key=lambda found: -found.value if found.value == found.value else -np.inf)
        return {found.name: found for found in failed}

    def is_feasible(self, tolerance: float = FEASIBILITY_TOLERANCE) -> bool:
        """Return whether every violation is within a tolerance (SI units) and the contacts are force-closed."""
        return all(found.value <= tolerance for found in self.violations.values()) and self.force_closed

    @property
    def feasible(self) -> bool:
        """Whether it is feasible at the standard tolerance."""
        return self.is_feasible()

    @property
    def status(self) -> Status:
        """``feasible``, ``infeasible``, or ``cancelled`` (stopped before a feasible one was found)."""
        if self.feasible:
            return "feasible"
        return "cancelled" if self.search is not None and self.search.cancelled else "infeasible"

    @cached_property
    def not_asked(self) -> tuple[str, ...]:
        """What the problem did not ask for and the grasp does not have, in words."""
        return not_asked(self)

    @cached_property
    def closing(self) -> ClosingReport:
        """How it closes from an open hand, and whether it then holds; not asked for by any requirement."""
        return close_grasp(self)

    @property
    def verdict(self) -> str:
        """One sentence: feasible, with what was not asked for; or what could not be met and by how much."""
        return verdict(self, self.status, tuple(self.failures().values()), self.not_asked)


def find_closings(grasps: Sequence[Grasp]) -> None:
    """Compute together how grasps close, which is quicker than one by one; those that know it keep it."""
    missing = [grasp for grasp in grasps if "closing" not in grasp.__dict__]
    for grasp, report in zip(missing, close_grasps(missing), strict=True):
        grasp.__dict__["closing"] = report
