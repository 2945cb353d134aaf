"""One start of a search: the phases that take it to a grasp, and what they learn of how little force will do."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..grasp.grasp import Grasp, IterationRecord, SearchReport
from ..optimisation.newton import solve_newton
from ..optimisation.nlp import NonlinearProgram, solve_nlp
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from ..spatial import Array
from .phase_one import polish, reach_feasibility, settle
from .preparation import FEW_SYNERGIES
from .program import TASK_FLOOR, GraspProgram, Phase
from .starts import GraspStart

PHASE_ONE_GOOD_ENOUGH = 0.1
"""Largest scaled violation after phase one from which phase two is worth trying."""
LEAST_SQUARES_GOOD_ENOUGH = 0.3
"""The same for phase one by least squares, which ends inside most of the constraints."""
WORTH_POLISHING = 0.05
"""Largest scaled violation after phase two that a last least-squares solve may remove."""
FORCE_ITERATIONS, FORCE_TOLERANCE = 60, 1e-3
"""How long, and to what relative accuracy, the least force of a start is sought: only a multiple of it is used."""
COUNTS_AS_LEAST = 1e-2
"""Largest scaled violation with which F counts among the least found."""


@dataclass
class Attempt:
    """One start while and after it is solved.

    Attributes:
        index: Number of the start.
        program: The program around its palm pose.
        z: Where it stands, in scaled variables.
        prepared: Whether the start is nearly feasible.
        iterations: Iterations of phase one and two.
        message: The solver's last words.
        objective_scale: Factor of the objective in phase two.
        history: What the iterations were like.
        settled: Where it stood when phase two began; None before.
    """

    index: int
    program: GraspProgram
    z: Array
    prepared: bool
    iterations: dict[str, int] = field(default_factory=lambda: {"one": 0, "two": 0})
    message: str = ""
    objective_scale: float = 1.0
    history: list[IterationRecord] = field(default_factory=list)
    settled: Array | None = None
    _posed: tuple[Array, Grasp] | None = None

    @classmethod
    def at(cls, index: int, problem: GraspProblem, start: GraspStart, like: GraspProgram | None = None) -> Attempt:
        """Return an attempt that stands at a start; of another program it takes what it may share."""
        program = GraspProgram(problem, start.palm_pose, like)
        z = program.pack(start.joint_angles, start.palm_pose, start.delta_sigma, start.contact_forces)
        program.check_own_terms(z)
        return cls(index, program, z, start.prepared)

    @property
    def merit(self) -> float:
        """Largest scaled violation."""
        return self.program.merit(self.z)

    @property
    def force_norm(self) -> float:
        """F [N]."""
        return self.program.state(self.z).force_norm

    @property
    def posed(self) -> Grasp:
        """The grasp it stands at, without a report; judged once while it stands there."""
        if self._posed is None or self._posed[0] is not self.z:
            self._posed = self.z, self.program.grasp(self.z)
        return self._posed[1]

    def grasp(self, seed: int, options: PlannerOptions) -> Grasp:
        """Return the grasp it stands at."""
        return self.posed.with_search(
            SearchReport(
                seed=seed,
                iterations=self.iterations["two"],
                phase_one_iterations=self.iterations["one"],
                message=self.message,
                history=tuple(self.history),
                options=options,
            )
        )

    def record(self, phase: Phase) -> IterationRecord:
        """Return the record of the iteration that ended where it stands."""
        program = self.program
        state = program.state(self.z)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = state.geometry.rotation, state.geometry.translation
        return IterationRecord(
            start=self.index,
            phase=phase,
            iteration=self.iterations[phase],
            objective=program.objective.value(program.problem, state),
            force_norm=state.force_norm,
            task_index=state.task_index,
            violations=program.violations(self.z),
            joint_angles=np.array(state.x[program.evaluator.layout.joints]),
            palm_pose=pose,
        )


class AttemptSolver:
    """Takes starts to grasps, one after the other.

    Without weights every start first seeks little force, then the best task with at most a multiple of the least
    force that any start found so far: the lexicographic order of the two, to a factor.

    Attributes:
        least_force: Least F found so far [N]; infinite before and with weights.
    """

    def __init__(
        self,
        problem: GraspProblem,
        options: PlannerOptions,
        callback: Callable[[IterationRecord], None] | None,
        check: Callable[[], None],
    ) -> None:
        self.problem, self.options = problem, options
        self.least_force = math.inf
        self._callback, self._check = callback, check

    @property
    def most_force(self) -> float:
        """F that the best task may take [N]."""
        return self.problem.parameters.force_factor * self.least_force

    def solve(self, attempt: Attempt) -> None:
        """Run the phases from one start; the attempt stands where they ended, also if the check stops them."""
        if self.options.solver == "none":
            self._take(attempt)
        elif self.prepare(attempt):
            self._run(attempt, "two")
            self._polish(attempt)

    def prepare(self, attempt: Attempt) -> bool:
        """Run what comes before phase two; return whether phase two is worth trying."""
        weighted = self.problem.parameters.weighted
        phase_one = self.options.phase_one
        if phase_one is None:
            few = self.problem.n_synergies <= FEW_SYNERGIES
            phase_one = self.problem.clearance.needs_geometry or few or not weighted
        if phase_one and not self._reach_feasibility(attempt):
            return False
        attempt.settled = np.array(attempt.z)
        attempt.objective_scale = attempt.program.objective_scale(attempt.z)
        if not weighted:
            self._seek_little_force(attempt)
        return True

    def go_back(self, attempt: Attempt) -> None:
        """Move an attempt back to where phase two began, if it did, and remove what little violation is left there."""
        if attempt.settled is not None:
            attempt.z = np.array(attempt.settled)
            self._polish(attempt)

    def program_of(self, attempt: Attempt, phase: Phase) -> NonlinearProgram:
        """Return the program of a phase from where an attempt stands."""
        program, most_force, task_floor = attempt.program, math.inf, 0.0
        if phase == "force":
            task_floor = TASK_FLOOR * program.state(attempt.z).task_index
        elif phase == "two" and not self.problem.parameters.weighted:
            # A start that takes more force than that keeps what it takes: it can't become the best any more.
            most_force = max(self.most_force, attempt.force_norm)
        return program.build(phase, attempt.objective_scale, most_force, task_floor)

    def _take(self, attempt: Attempt) -> None:
        """Bring the attempt to feasibility, unless it is feasible as it is."""
        if not attempt.posed.feasible:
            if not self._reach_feasibility(attempt):
                return
            self._polish(attempt)
        if attempt.posed.feasible:
            self.least_force = min(self.least_force, attempt.posed.force_norm)

    def _polish(self, attempt: Attempt) -> None:
        """Remove what little violation is left, if any."""
        if attempt.merit < WORTH_POLISHING and not attempt.posed.feasible:
            self._least_squares(attempt, polish)

    def _reach_feasibility(self, attempt: Attempt) -> bool:
        """Run phase one; return whether it came near enough for phase two."""
        clearance = self.problem.clearance.needs_geometry
        springs = self.problem.parameters.force_law == "springs"
        if attempt.prepared and springs:
            self._least_squares(attempt, settle)
        elif clearance or not attempt.prepared:
            self._least_squares(attempt, reach_feasibility)
        good_enough = LEAST_SQUARES_GOOD_ENOUGH
        # SQP helps where clearances are still violated, and from prepared starts; elsewhere it is in vain.
        if attempt.merit > good_enough if clearance or springs else attempt.prepared:
            self._run(attempt, "one")
            good_enough = PHASE_ONE_GOOD_ENOUGH
        return attempt.merit <= good_enough

    def _seek_little_force(self, attempt: Attempt) -> None:
        """Move the attempt to where little force will do, and remember how little."""
        self._run(attempt, "force")
        self._count_as_least(attempt)

    def _count_as_least(self, attempt: Attempt) -> None:
        """Remember the force of an attempt that is nearly feasible, if it is the least."""
        if attempt.merit <= COUNTS_AS_LEAST:
            self.least_force = min(self.least_force, attempt.force_norm)

    def _least_squares(self, attempt: Attempt, solve: Callable[..., Array]) -> None:
        """Move the attempt to the result of a least-squares solve of the violations."""
        before = attempt.program.evaluations
        self._check()
        attempt.z = solve(attempt.program, attempt.z, self._check)
        attempt.iterations["one"] += attempt.program.evaluations - before
        attempt.history.append(attempt.record("one"))
        if self._callback is not None:
            self._callback(attempt.history[-1])

    def _run(self, attempt: Attempt, phase: Phase) -> None:
        """Run one phase and move the attempt to its result."""
        program, options = attempt.program, self.options
        iterations, tolerance = options.max_iterations, options.tolerance
        if phase == "force":
            iterations, tolerance = min(FORCE_ITERATIONS, iterations), max(FORCE_TOLERANCE, tolerance)

        def after_iteration(z: Array) -> None:
            attempt.z = np.array(z)
            counted: Phase = "one" if phase == "one" else "two"
            attempt.iterations[counted] += 1
            attempt.history.append(attempt.record(counted))
            if self._callback is not None:
                self._callback(attempt.history[-1])
            self._check()

        self._check()
        sought = self.program_of(attempt, phase)
        if phase == "two" and options.solver == "newton":
            solution = solve_newton(sought, attempt.z, max_iterations=iterations, callback=after_iteration)
        else:
            solution = solve_nlp(
                sought, attempt.z, max_iterations=iterations, tolerance=tolerance, callback=after_iteration
            )
        attempt.message = solution.message
        # Cut off at the iteration limit, SLSQP may hand back a trial point of its line search.
        better = solution.converged or program.merit(solution.z) <= program.merit(attempt.z)
        if better and not np.array_equal(solution.z, attempt.z):
            after_iteration(solution.z)
