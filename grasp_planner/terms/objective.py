"""The objective z = w_F F + w_C C of eq. (29), with the user's own costs: the one place where it is summed.

Without weights it is C alone, and F is bounded: by a factor times the least F that the search finds. Small costs that a
problem asks for are shares of C.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from ..checks import LARGEST
from ..evaluation.state import GraspState
from ..exceptions import InvalidValueError
from ..judge.posed_grasp import PosedGrasp
from ..problem.problem import GraspProblem
from ..problem.term import Weighted, own_costs
from ..spatial import Array
from .closing_normals import ClosingNormals
from .costs import ForceNorm, TaskIndex
from .mean_posture import MeanPosture
from .sharing import ForceSharing
from .small_cost import SmallCost
from .stops import JointStops

SMALL_COSTS: tuple[SmallCost, ...] = (ForceSharing(), JointStops(), MeanPosture(), ClosingNormals())
"""What experience prefers among grasps that are equally good otherwise; but for the last, off without a weight."""


@dataclass(frozen=True)
class Objective:
    """A weighted sum of costs.

    Attributes:
        terms: The costs with their weights.
    """

    terms: tuple[Weighted, ...]

    def __post_init__(self) -> None:
        if not self.terms:
            raise InvalidValueError("costs", (), "at least one")

    def value(self, problem: GraspProblem, state: GraspState) -> float:
        """Return the sum at a state."""
        return self.total(each.cost.value(problem, state) for each in self.terms)

    def gradient(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its gradient by x, of shape (n_x,)."""
        parts = [each.weight * each.cost.gradient(problem, state) for each in self.terms]
        return sum(parts[1:], start=parts[0])

    def clear_value(self, grasp: PosedGrasp) -> float:
        """Return the sum for a grasp, by the plain formulas."""
        return self.total(each.cost.clear_value(grasp) for each in self.terms)

    def total(self, values: Iterable[float]) -> float:
        """Return the weighted sum of values, one for each cost: of the costs, or of their derivatives."""
        return float(sum(each.weight * value for each, value in zip(self.terms, values, strict=True)))

    def scaled(self, factor: float) -> Objective:
        """Return the objective times a factor."""
        # Next to zero at an optimum the factor would have no end.
        factor = min(factor, LARGEST / max([1.0, *(each.weight for each in self.terms)]))
        return Objective(tuple(Weighted(each.cost, factor * each.weight) for each in self.terms))

    def typical(self, problem: GraspProblem, state: GraspState) -> float:
        """Return a value that counts as usual, from the state at a start."""
        return self.total(each.cost.typical(problem, state) for each in self.terms)


def problem_objective(problem: GraspProblem) -> Objective:
    """Return the objective of a problem."""
    parameters = problem.parameters
    force, task = (parameters.force_weight or 0.0, parameters.task_weight or 0.0) if parameters.weighted else (0.0, 1.0)
    built_in = (Weighted(ForceNorm(), force), Weighted(TaskIndex(), task))
    small = (Weighted(cost, task * cost.weight(problem)) for cost in SMALL_COSTS if cost.weight(problem) > 0.0)
    return Objective((*built_in, *small, *own_costs(problem.costs)))
