"""How long and how hard to search."""

from __future__ import annotations

from dataclasses import dataclass

from ..problem.settings import check_settings, setting

SOLVERS = ("slsqp", "newton", "none")
"""What may solve phase two."""


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
        closing: Whether grasps that close from an open hand go before all others, and up to twice as many are looked
            for until one does; None: where forces come from springs and a solver works on them.
        solver: What solves phase two: ``slsqp``, or ``newton``, which goes on from there with second derivatives
            until the first-order conditions hold to 1e-7, at several times the time, or ``none``: feasible grasps are
            taken as they are found, where forces come from springs most of them near earlier ones and with less force,
            a hundred a second where nothing has to keep clear.
    """

    starts: int = setting(40, "Most starts.", low=1, high=1e6, step=1)
    enough: int = setting(4, "Feasible grasps after which the best is taken.", low=1, high=1e6, step=1)
    max_iterations: int = setting(200, "Most iterations of each phase.", low=1, high=1e6, step=1)
    tolerance: float = setting(1e-8, "Accuracy asked of the solver, in scaled units.", low=0.0, high=0.1, above=True)
    time_limit_s: float | None = setting(
        None,
        "Most wall time.",
        kind="number",
        unit="s",
        low=0.0,
        high=1e7,
        above=True,
        none="no limit",
        option="--time-limit",
    )
    phase_one: bool | None = setting(
        None, "Whether to look for feasibility first.", kind="truth", none="yes with few synergies or clearances"
    )
    closing: bool | None = setting(
        None,
        "Whether grasps that close from an open hand go first.",
        kind="truth",
        none="yes where forces come from springs and a solver works on them",
    )
    solver: str = setting("slsqp", "What solves phase two.", choices=SOLVERS)

    def __post_init__(self) -> None:
        check_settings(self)
