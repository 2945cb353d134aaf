"""The costs of the paper: how hard the hand presses, and how badly the task is transmitted."""

from __future__ import annotations

from ..evaluation.state import GraspState
from ..judge.posed_grasp import PosedGrasp
from ..problem.problem import GraspProblem
from ..problem.term import NEWTON, Cost
from ..spatial import Array

TYPICAL_FORCE = 5.0
"""F that sets the scale of the objective [N]."""


class ForceNorm(Cost):
    """F, the size of the normal forces [N]; eq. (18)."""

    name, unit = "force_norm", NEWTON

    def value(self, problem: GraspProblem, state: GraspState) -> float:
        """Return F."""
        return state.force_norm

    def gradient(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return ∂F/∂x."""
        return state.d_force_norm

    def clear_value(self, grasp: PosedGrasp) -> float:
        """Return F."""
        return grasp.force_norm

    def typical(self, problem: GraspProblem, state: GraspState) -> float:
        """Return a usual F: starts without contact have none."""
        return TYPICAL_FORCE


class TaskIndex(Cost):
    """C, how badly the task is transmitted; eq. (28). Its unit follows from the tasks."""

    name = "task_index"

    def value(self, problem: GraspProblem, state: GraspState) -> float:
        """Return C."""
        return state.task_index

    def gradient(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return ∂C/∂x."""
        return state.d_task_index

    def clear_value(self, grasp: PosedGrasp) -> float:
        """Return C."""
        return grasp.task_index
