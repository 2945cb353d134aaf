"""The planning program around a grasp in the form that optimality is examined in: every bound a constraint."""

from __future__ import annotations

import math

import numpy as np

from ..evaluation.state import GraspState, StateEvaluator
from ..grasp.grasp import Grasp
from ..judge.posed_grasp import PosedGrasp
from ..optimisation.lagrangian import NlpPoint
from ..optimisation.nlp import NonlinearProgram
from ..planning.off_stops import kept_reserve
from ..planning.program import GraspProgram, joint_bounds
from ..problem.problem import GraspProblem
from ..problem.term import NEWTON, Constraint, above_zero
from ..spatial import Array
from ..terms.objective import Objective, problem_objective
from ..terms.registry import stacked


class ForceBound(Constraint):
    """F stays within what the search allowed it: without weights a multiple of the least that it found."""

    name, unit, geometric = "most_force", NEWTON, False

    def __init__(self, most: float) -> None:
        self.most = most

    def residual(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return what is left of it."""
        return np.array([self.most - state.force_norm])

    def jacobian(self, problem: GraspProblem, state: GraspState) -> Array:
        """Return its derivatives."""
        return -state.d_force_norm[None]

    def violation(self, grasp: PosedGrasp) -> float:
        """Return by how much F exceeds it."""
        return above_zero(grasp.force_norm - self.most)


class OptimalityProgram:
    """The program of a problem at one palm pose and scaling, joint limits as constraints."""

    def __init__(self, grasp: Grasp) -> None:
        self.base = GraspProgram(grasp.problem, grasp.palm_pose)
        self.z = self.base.pack(grasp.joint_angles, grasp.palm_pose, grasp.delta_sigma, grasp.contact_forces)
        self.objective_scale = self.base.objective_scale(self.z)
        self.objective = self.objective_of(grasp.problem)
        self.most_force = most_force(grasp)
        bounds = [] if math.isinf(self.most_force) else [ForceBound(self.most_force)]
        self.terms = sorted([*self.base.constraints, *bounds], key=lambda term: not term.equality)  # equalities first
        self._sides = tuple([term for term in self.terms if term.equality is equal] for equal in (True, False))
        self.reserve = kept_reserve(grasp)
        self.layout = self.base.evaluator.layout
        self.reference = grasp.palm_pose

    def nlp(self) -> NonlinearProgram:
        """Return the same program as the search solves it."""
        return self.base.build("two", self.objective_scale, self.most_force, reserve=self.reserve)

    def evaluate(self, z: Array) -> NlpPoint:
        """Return the program at scaled variables."""
        return self.point_of(self.base.problem, self.base.state(z), self.objective)

    def at(self, problem: GraspProblem) -> NeighbouringProgram:
        """Return the program of another problem with the same variables."""
        return NeighbouringProgram(self, problem)

    def names(self) -> list[str]:
        """Return the name of every constraint."""
        names = []
        state = self.base.state(self.z)
        for term in self.terms:
            count = term.residual(self.base.problem, state).size
            names += [f"{term.name} {i}" for i in range(count)]
        joints = self.base.problem.hand.joint_names
        return names + [f"lower limit of {name}" for name in joints] + [f"upper limit of {name}" for name in joints]

    def objective_of(self, problem: GraspProblem) -> Objective:
        """Return the scaled objective of a problem."""
        return problem_objective(problem).scaled(self.objective_scale)

    def point_of(self, problem: GraspProblem, state: GraspState, objective: Objective) -> NlpPoint:
        """Return the program at a state, with the scaled objective of its problem."""
        scale, layout = self.base.scale, self.layout
        (zero, d_zero), (spare, d_spare) = (
            stacked(side, problem, state, lambda term: term.scale) for side in self._sides
        )
        q, picks = state.x[layout.joints], np.eye(layout.size)[layout.joints]
        lower, upper = joint_bounds(problem.hand, self.reserve)
        unit = scale[layout.joints]
        return NlpPoint(
            objective=objective.value(problem, state),
            gradient=objective.gradient(problem, state) * scale,
            residuals=np.concatenate([zero, spare, (q - lower) / unit, (upper - q) / unit]),
            jacobian=np.vstack([d_zero * scale, d_spare * scale, picks, -picks]),
            n_equalities=len(zero),
        )


class NeighbouringProgram:
    """The program of a changed problem in the variables of the unchanged one; the last state is kept."""

    def __init__(self, program: OptimalityProgram, problem: GraspProblem) -> None:
        self.problem = problem
        self._program = program
        own = program.base.evaluator
        same = problem is program.base.problem
        self._evaluator = own if same else StateEvaluator(problem, program.reference, own)
        self._objective = program.objective if same else program.objective_of(problem)
        self._last: tuple[bytes, GraspState] | None = None

    def state(self, z: Array) -> GraspState:
        """Return the state at scaled variables."""
        key = z.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self._evaluator.evaluate(z * self._program.base.scale)
        return self._last[1]

    def evaluate(self, z: Array) -> NlpPoint:
        """Return the program at scaled variables."""
        return self._program.point_of(self.problem, self.state(z), self._objective)


def most_force(grasp: Grasp) -> float:
    """Return F that the search allowed a grasp [N]: infinite with weights; its own F where the search is not known."""
    parameters, search = grasp.problem.parameters, grasp.search
    if parameters.weighted:
        return math.inf
    least = search.least_force if search is not None else None
    return grasp.force_norm if least is None else max(grasp.force_norm, parameters.force_factor * least)
