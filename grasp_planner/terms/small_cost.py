"""A preference among grasps that are equally good otherwise: a share of the task index, so no units are weighed."""

from __future__ import annotations

from abc import abstractmethod

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..problem.problem import GraspProblem
from ..problem.term import Cost
from ..spatial import Array


class SmallCost(Cost):
    """C times a measure m without unit: with the weight w the objective C becomes C (1 + w m).

    Attributes:
        setting: The field of :class:`~grasp_planner.problem.parameters.GraspParameters` that has its weight, 0: off.
    """

    setting: str

    @abstractmethod
    def measure(self, problem: GraspProblem, state: GraspState) -> tuple[float, Array]:
        """Return m ≥ 0 at a state, of order one where it is bad, and its gradient by x, of shape (n_x,)."""

    @abstractmethod
    def clear_measure(self, grasp: PosedGrasp) -> float:
        """Return m of a grasp, by the plain formulas."""

    def value(self, problem: GraspProblem, state: GraspState) -> float:
        """Return C m."""
        return state.task_index * self.measure(problem, state)[0]

    def gradient(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return ∂(C m)/∂x."""
        value, slope = self.measure(problem, state)
        return value * state.d_task_index + state.task_index * slope

    def clear_value(self, grasp: PosedGrasp) -> float:
        """Return C m."""
        return grasp.task_index * self.clear_measure(grasp)

    def weight(self, problem: GraspProblem) -> float:
        """Return its weight in a problem."""
        return float(getattr(problem.parameters, self.setting))
