"""How long and how hard to search."""

from __future__ import annotations

from dataclasses import dataclass

from ..checks import positive, positive_whole


@dataclass(frozen=True)
class PlannerOptions:
    """How long and how hard to search.

    Attributes:
        starts: Most starts; the first is the standard one, the others are random or prepared from random ones.
        enough: Feasible grasps after which the best is taken and the search ends.
        max_iterations: Most iterations of each phase from each start.
        tolerance: Accuracy asked of the solver, in scaled units.
        time_limit_s: Most wall time [s]; None for no limit.
        phase_one: Whether to look for feasibility first, by least squares (by SQP from prepared starts and where
            least squares leaves clearances violated); None decides: with few synergies or clearances it does.
    """

    starts: int = 40
    enough: int = 4
    max_iterations: int = 200
    tolerance: float = 1e-8
    time_limit_s: float | None = None
    phase_one: bool | None = None

    def __post_init__(self) -> None:
        for name in ("starts", "enough", "max_iterations"):
            positive_whole(name, getattr(self, name))
        positive("tolerance", self.tolerance)
        if self.time_limit_s is not None:
            positive("time_limit_s", self.time_limit_s, unit="s")
