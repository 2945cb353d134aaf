"""A synergy set from scratch: grasps of random objects are planned, moved together, planned again with few synergies.

Several grasps of every object are planned with all joints free, then moved towards each other within their
constraints (:mod:`.compact`). Then every object is planned with synergies of the set so far, what is found joins the
candidates, and grasps are moved again. No object is ever dropped: one that few synergies do not grasp keeps pulling
at the set.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..exceptions import InvalidValueError
from ..hand.loading import load_hand
from ..processes.jobs import JobFunction
from ..processes.queueing import answers_in_order
from ..synergies.space import SynergySpace
from . import compact
from .training import MoveJob, PlanJob, Trainer, Training, fully_actuated

FIRST_SEED = 20000
"""Far from the seeds of the benchmark, so that no set is fitted to its problems."""
CANDIDATES, FREE_STARTS, STARTS = 3, 25, 15
"""Grasps of every object to choose from; most starts with all joints free and with few synergies."""
FIRST_ROUNDS = (0.15, 0.12, 0.09, 0.07, 0.05, 0.035, 0.025)
NEXT_ROUNDS = (0.05, 0.03, 0.02, 0.01)
"""ε of the rounds [rad], at first and after planning anew."""
LAPS = 3
"""How often a set for a number of motors is planned with and moved again."""


@dataclass(frozen=True)
class Progress:
    """How far a design is.

    Attributes:
        stage: What is done, in words.
        done: Jobs of the stage that are done.
        total: All jobs of the stage.
    """

    stage: str
    done: int
    total: int


class Design:
    """The objects, their candidates, and the scatter of the best of each.

    Args:
        training: What grasps are planned of.
        seeds: Seeds of the objects.
        workers: Worker processes; with one, everything runs here.
        report: Called with how far it is, and with a line of text at the end of every stage.
    """

    def __init__(
        self,
        training: Training,
        seeds: Sequence[int],
        workers: int = 1,
        report: Callable[[Progress | str], None] = lambda _: None,
    ) -> None:
        self.training, self.report = training, report
        self._workers, self._here = workers, Trainer(training) if workers == 1 else None
        self.hand = load_hand(training.hand) if self._here is None else self._here.hand
        free = fully_actuated(self.hand)
        springs = training.force_law == "springs"
        self.scale = 0.0 if springs else compact.displacement_scale(training.problem(seeds[0], free, self.hand))
        found = self._plan(seeds, free, FREE_STARTS, CANDIDATES, "all joints free")
        self.candidates = {seed: grasps for seed, grasps in found.items() if grasps}
        if len(self.candidates) < 2:
            raise InvalidValueError(
                "objects", f"{len(self.candidates)} grasped of {len(seeds)}", "at least 2 that the free hand grasps"
            )
        self.postures = np.array([grasps[0].reference for grasps in self.candidates.values()])
        # Displacements of least force are far apart in directions that press on nothing: at first postures alone.
        self.scatter = self._scatter(0.0)

    def rounds(self, epsilons: Iterable[float], motors: int | None = None) -> None:
        """Move all candidates, keep the closest of each object, fewer every second round, and take the scatter anew.

        Args:
            epsilons: ε of each round [rad].
            motors: Number of directions that are given for nothing, all others being given up; None for the log-det
                heuristic, in which a direction costs the less the more grasps need it.
        """
        for k, epsilon in enumerate(epsilons):
            scatter = self.scatter if motors is None else self.scatter.flattened(motors)
            jobs = [
                MoveJob(seed, each, scatter, epsilon) for seed, grasps in self.candidates.items() for each in grasps
            ]
            moved: dict[int, list[compact.FreeGrasp]] = defaultdict(list)
            answers = self._answers(jobs, f"moving together, ε = {epsilon:g} rad")
            for job, (grasp,) in zip(jobs, answers, strict=True):
                moved[job.seed].append(grasp)
            kept = max(1, CANDIDATES - k // 2)
            for seed, grasps in moved.items():
                self.candidates[seed] = sorted(grasps, key=lambda grasp: grasp.distance)[:kept]
            self.scatter = self._scatter(self.scale)
        spreads = np.sqrt(np.maximum(np.linalg.eigvalsh(self.scatter.covariance)[::-1], 0.0))
        self.report(f"moved together: spreads [rad] {', '.join(f'{each:.3f}' for each in spreads[:6])}")

    def plan_again(self, space: SynergySpace) -> int:
        """Plan every object with a set, add what is found to its candidates, and return how many were grasped."""
        found = self._plan(list(self.candidates), space, STARTS, 1, f"n_s = {space.n_synergies}")
        for seed, grasps in found.items():
            self.candidates[seed] = [*self.candidates[seed], *grasps]
        return sum(map(bool, found.values()))

    def full_space(self, least: float) -> SynergySpace:
        """Return the set so far, completed to all joints.

        Args:
            least: Spread from which a direction that the grasps share counts [rad].
        """
        return compact.spanning_synergies(self.hand.joint_names, self.scatter, self.postures, least)

    def space(self, motors: int) -> SynergySpace:
        """Return the set so far for exactly as many motors."""
        return SynergySpace(self.hand.joint_names, self.scatter.mean, self.scatter.directions(motors))

    def _plan(
        self, seeds: Sequence[int], space: SynergySpace, starts: int, enough: int, title: str
    ) -> dict[int, list[compact.FreeGrasp]]:
        jobs = [PlanJob(seed, space, starts, enough) for seed in seeds]
        found = dict(zip(seeds, self._answers(jobs, f"planning, {title}"), strict=True))
        counts: dict[str, list[bool]] = defaultdict(list)
        for seed, grasps in found.items():
            counts[self.training.kind(seed)].append(bool(grasps))
        self.report(f"{title}: " + ", ".join(f"{kind} {sum(c)}/{len(c)}" for kind, c in counts.items()))
        return found

    def _answers(self, jobs: Sequence[PlanJob | MoveJob], stage: str) -> list[list[compact.FreeGrasp]]:
        answers: Iterable[Any] = map(self._here, jobs) if self._here is not None else self._by_workers(jobs)
        found = []
        self.report(Progress(stage, 0, len(jobs)))
        for answer in answers:
            found.append(answer)
            self.report(Progress(stage, len(found), len(jobs)))
        return found

    def _by_workers(self, jobs: Sequence[PlanJob | MoveJob]) -> Iterable[Any]:
        settings: Mapping[str, Any] = {"training": self.training}
        return answers_in_order(JobFunction(f"{Trainer.__module__}:Trainer", settings), jobs, self._workers)

    def _scatter(self, displacement_scale: float) -> compact.Scatter:
        return compact.scatter_of([grasps[0] for grasps in self.candidates.values()], displacement_scale)


def synergies_for_motors(
    training: Training,
    motors: int,
    *,
    objects: int = 42,
    first_seed: int = FIRST_SEED,
    workers: int = 1,
    report: Callable[[Progress | str], None] = lambda _: None,
) -> tuple[SynergySpace, int]:
    """Make a set for exactly as many motors: references of all grasps on one line, in one plane or one volume.

    Args:
        training: What grasps are planned of.
        motors: Number of motors.
        objects: Number of training objects.
        first_seed: Seed of the first one.
        workers: Worker processes.
        report: Called with how far it is, and with a line of text at the end of every stage.

    Returns:
        The best set of all laps, of n columns, and how many of the training objects were grasped with it.

    Raises:
        InvalidValueError: If a number is out of range, or the free hand grasps next to none of the objects.
    """
    hand = load_hand(training.hand)
    if isinstance(motors, bool) or not 1 <= motors <= hand.n_joints:
        raise InvalidValueError("motors", motors, f"a whole number from 1 to {hand.n_joints}")
    if isinstance(objects, bool) or objects < 2:
        raise InvalidValueError("objects", objects, "a whole number of at least 2")
    design = Design(training, range(first_seed, first_seed + objects), workers, report)
    design.rounds(FIRST_ROUNDS)
    design.rounds(NEXT_ROUNDS, motors)
    best, most = design.space(motors), -1
    for lap in range(LAPS):
        space = design.space(motors)
        grasped = design.plan_again(space)
        if grasped > most:
            best, most = space, grasped
        if lap < LAPS - 1 and grasped < len(design.candidates):
            design.rounds(NEXT_ROUNDS, motors)
        else:
            break
    return best, most
