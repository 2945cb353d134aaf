"""How a grasp was found: the iterations of the search and its summary."""

from __future__ import annotations

from dataclasses import dataclass

from ..problem.search_options import PlannerOptions
from ..spatial import Array
from ..values import Value


@dataclass(frozen=True, eq=False, repr=False)
class IterationRecord(Value):
    """One iteration of the search.

    Attributes:
        start: Number of the start, from 0.
        phase: ``one`` (feasibility) or ``two`` (the full problem).
        iteration: Number within the phase, from 1.
        objective: The objective, see :attr:`Grasp.objective`.
        force_norm: F [N].
        task_index: C.
        violations: Largest violation of every constraint, in its unit.
        joint_angles: q [rad].
        palm_pose: Pose of the palm in O, as a 4 x 4 matrix.
    """

    start: int
    phase: str
    iteration: int
    objective: float
    force_norm: float
    task_index: float
    violations: dict[str, float]
    joint_angles: Array
    palm_pose: Array


@dataclass(frozen=True, eq=False, repr=False)
class SearchReport(Value):
    """How a grasp was found.

    Attributes:
        seed: Seed of the random starts.
        iterations: Iterations of the full problem (phase two) from the start that gave the grasp.
        phase_one_iterations: Iterations of its phase one.
        evaluations: States evaluated over all starts.
        starts_tried: Number of starts tried.
        starts_feasible: Number of starts that ended feasible.
        least_force: Least F that any start found [N], to a part in a thousand; None where weights decide.
        time_s: Wall time [s].
        message: The solver's last words.
        cancelled: Whether the search was stopped from outside.
        history: Iterations of the start that gave the grasp.
        options: How long and how hard was searched; None if that is not known.
    """

    seed: int
    iterations: int = 0
    phase_one_iterations: int = 0
    evaluations: int = 0
    starts_tried: int = 0
    starts_feasible: int = 0
    least_force: float | None = None
    time_s: float = 0.0
    message: str = ""
    cancelled: bool = False
    history: tuple[IterationRecord, ...] = ()
    options: PlannerOptions | None = None
