"""From a grasp problem to a scaled nonlinear program: which terms play which role, and in which units."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import pinocchio as pin

from ..evaluation.state import GraspState, StateEvaluator
from ..grasp.grasp import Grasp, SearchReport
from ..hand.hand import Hand
from ..optimisation.nlp import NonlinearProgram
from ..problem.problem import GraspProblem
from ..problem.term import Constraint
from ..spatial import Array
from ..terms.costs import ForceNorm
from ..terms.objective import Objective, problem_objective
from ..terms.registry import check_shapes, problem_constraints, stacked

JOINT_SCALE = 0.3
"""A unit step of a scaled joint angle [rad]."""
TRANSLATION_SCALE = 0.1
"""A unit step of the scaled palm translation [m]."""
ROTATION_SCALE = 1.0
"""A unit step of the scaled palm rotation [rad]."""
FORCE_SCALE = 2.0
"""A unit step of a scaled contact force [N]."""
UNIT_FORCE_ARM = 0.08
"""A unit step of scaled δσ presses with about 1 N through this length: δσ = 1/(0.08 m · K) [m]."""
TRANSLATION_REACH = 0.2
"""How far the palm may move from its start in one solve, per axis [m]."""
ROTATION_REACH = 2.0
"""How far the palm may turn from its start in one solve, per axis [rad]."""
MOST_RESERVE = 0.1
"""Share of a joint's range that may be held as a reserve at either end."""
PHASE_ONE_FORCE_WEIGHT = 0.1
"""Weight of F [1/N] while phase one looks for feasibility."""

TASK_SHARE, TASK_FLOOR = 0.2, 1e-2
"""While the least force is sought, a logarithm of C counts like this much of F's; C as above this part of that at the
start. So the search for little force already turns to where the task is served: ln F alone ends where it is not."""

Phase = Literal["one", "force", "two"]


class GraspProgram:
    """The scaled program of a problem around one palm pose; evaluates each point once.

    Attributes:
        problem: The problem.
        evaluator: Evaluates states.
        scale: x = scale · z, of shape (n_x,).
        constraints: The constraints of the problem.
        objective: Its objective.
        evaluations: States evaluated so far.
    """

    def __init__(self, problem: GraspProblem, reference_pose: pin.SE3, like: GraspProgram | None = None) -> None:
        """Make a program; what it may share with another one it takes from there."""
        self.problem = problem
        evaluator: StateEvaluator | None = None if like is None else like.evaluator
        self.evaluator: StateEvaluator = StateEvaluator(problem, reference_pose, evaluator)
        self.scale = self._variable_scale()
        self.evaluations = 0
        self._key: bytes | None = None
        self._state: GraspState | None = None
        self.constraints = problem_constraints(problem)
        self.objective = problem_objective(problem)
        self._equalities = [term for term in self.constraints if term.equality]
        self._inequalities = [term for term in self.constraints if not term.equality]

    def state(self, z: Array) -> GraspState:
        """Return the state at scaled variables; the last one is remembered."""
        key = z.tobytes()
        if self._state is None or key != self._key:
            self._state, self._key = self.evaluator.evaluate(z * self.scale), key
            self.evaluations += 1
        return self._state

    def pack(self, q: Array, pose: pin.SE3, delta_sigma: Array, contact_forces: Array | None = None) -> Array:
        """Return scaled variables of a posture [rad], a palm pose in O, and δσ [rad] or contact forces in O [N]."""
        return self.evaluator.pack(q, pose, delta_sigma, contact_forces) / self.scale

    def grasp(self, z: Array, search: SearchReport | None = None) -> Grasp:
        """Return the grasp at scaled variables, its joint angles within their limits."""
        problem, layout, x = self.problem, self.evaluator.layout, z * self.scale
        return Grasp(
            problem=problem,
            joint_angles=np.clip(x[layout.joints], problem.hand.lower, problem.hand.upper),
            palm_pose=pin.SE3(self.evaluator.palm_pose(x)),
            delta_sigma=x[layout.displacement] if layout.n_displacements else np.zeros(problem.n_synergies),
            contact_forces=self.evaluator.forces_in_object(x),
            search=search,
        )

    def check_own_terms(self, z: Array) -> None:
        """Check, where the problem has own terms of the user's, that they give arrays of the right shape.

        Raises:
            InvalidValueError: If one does not.
        """
        if self.problem.costs or self.problem.constraints:
            check_shapes(self.problem, self.state(z))

    def objective_scale(self, z: Array) -> float:
        """Return the factor that makes the objective of phase two of order one, from the state at a start."""
        typical = self.objective.typical(self.problem, self.state(z))
        return 1.0 / max(typical, 1e-300)

    def build(
        self,
        phase: Phase,
        objective_scale: float = 1.0,
        most_force: float = math.inf,
        task_floor: float = 0.0,
        reserve: float = 0.0,
    ) -> NonlinearProgram:
        """Return the program of a phase.

        Args:
            phase: ``one`` minimises F alone, to reach feasibility; ``force`` ln F + 0.2 ln C, to learn how little
                force will do; ``two`` the objective.
            objective_scale: Factor of the objective in phase two.
            most_force: Bound of F [N].
            task_floor: Added to C in its logarithm.
            reserve: How far from their stops joints stay [rad].

        Returns:
            The program in scaled variables.
        """
        sought = self.objective.scaled(objective_scale)
        if phase == "one":
            sought = Objective((ForceNorm().weighted(PHASE_ONE_FORCE_WEIGHT),))

        def objective(z: Array) -> tuple[float, Array]:
            state = self.state(z)
            if phase == "force":
                value, slope = _little_force(state, task_floor)
            else:
                value, slope = sought.value(self.problem, state), sought.gradient(self.problem, state)
            return value, slope * self.scale

        def inequality(z: Array) -> tuple[Array, Array]:
            value, slope = self._stack(self._inequalities, z)
            if math.isinf(most_force):
                return value, slope
            state = self.state(z)
            return np.append(value, most_force - state.force_norm), np.vstack([slope, -state.d_force_norm * self.scale])

        lower, upper = self.bounds(reserve)
        return NonlinearProgram(objective, lambda z: self._stack(self._equalities, z), inequality, lower, upper)

    def violations(self, z: Array) -> dict[str, float]:
        """Return the largest violation of every constraint, in its unit."""
        state = self.state(z)
        return {term.name: term.shortfall(self.problem, state) for term in self.constraints}

    def merit(self, z: Array) -> float:
        """Return the largest scaled violation: how far from feasible a point is."""
        found = self.violations(z)
        return max(term.scale * found[term.name] for term in self.constraints)

    def _stack(self, terms: list[Constraint], z: Array) -> tuple[Array, Array]:
        """Return scaled residuals and Jacobian of some terms."""
        residual, jacobian = stacked(terms, self.problem, self.state(z), lambda term: term.scale)
        return residual, jacobian * self.scale

    def _variable_scale(self) -> Array:
        """Return the size of a unit step of every variable."""
        layout = self.evaluator.layout
        scale = np.empty(layout.size)
        scale[layout.joints] = JOINT_SCALE
        scale[layout.translation] = TRANSLATION_SCALE
        scale[layout.rotation] = ROTATION_SCALE
        scale[layout.displacement] = displacement_step(self.problem)
        scale[layout.forces] = FORCE_SCALE
        return scale

    def bounds(self, reserve: float = 0.0) -> tuple[Array, Array]:
        """Return bounds of the scaled variables: joint limits (31), the reach of the palm; δσ and forces are free.

        Args:
            reserve: How far from their stops joints stay [rad].
        """
        layout = self.evaluator.layout
        upper = np.full(layout.size, np.inf)
        upper[layout.translation] = TRANSLATION_REACH
        upper[layout.rotation] = ROTATION_REACH
        lower = -upper
        lower[layout.joints], upper[layout.joints] = joint_bounds(self.problem.hand, reserve)
        return lower / self.scale, upper / self.scale


def joint_bounds(hand: Hand, reserve: float) -> tuple[Array, Array]:
    """Return the limits of the joints, each range shorter by a reserve at both ends [rad].

    Args:
        hand: The hand.
        reserve: How far from their stops joints stay [rad]; at most a tenth of a joint's range.
    """
    kept = np.minimum(reserve, MOST_RESERVE * (hand.upper - hand.lower))
    return hand.lower + kept, hand.upper - kept


def _little_force(state: GraspState, task_floor: float) -> tuple[float, Array]:
    """Return ln F + 0.2 ln(C + floor), which has no units to weigh, and its gradient by x."""
    force, task = state.force_norm, state.task_index + task_floor
    value = math.log(force) + TASK_SHARE * math.log(task)
    return value, state.d_force_norm / force + (TASK_SHARE / task) * state.d_task_index


def displacement_step(problem: GraspProblem) -> float:
    """Return a unit step of scaled δσ [rad]."""
    parameters = problem.parameters
    stiffness = parameters.contact_stiffness + 1.0 / parameters.structural_compliance
    return 1.0 / (UNIT_FORCE_ARM * stiffness)
