"""What synergy sets are made from: random objects, and the jobs of planning them and of moving their grasps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from ..checks import positive, positive_whole
from ..grasp.grasp import Grasp
from ..hand.closing_synergies import CLOSING
from ..hand.configuration import HandConfiguration
from ..hand.hand import Hand
from ..hand.loading import load_hand
from ..model.task_direction import force_task
from ..objects.random_objects import random_object
from ..planning.planner import plan_grasp
from ..problem.parameters import GraspParameters
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from ..processes.serving import JobContext
from ..synergies.space import SynergySpace
from . import compact

KINDS = ("sphere", "cylinder", "box", "hull", "capsule", "turned", "ellipsoid")
"""Kinds of training objects in turn, convex and not."""
FORCE_WEIGHT = 1e-4
USUAL_WIDTH = 0.085
"""How wide a hand is, at the mean posture of its closing set, that random objects suit as they are [m]: DLR/HIT II."""
PATIENCE, MOST_PATIENCE = 6, 1000
"""Starts after which an object is given up if none was feasible, and most of them that may be asked for."""
SCALES = (0.4, 1.25)
"""Least and largest factor on the sizes of the training objects: for a large hand things do not grow."""


@dataclass(frozen=True)
class Training:
    """What grasps are planned of: random objects, random force tasks, links clear, the standard load cases.

    Attributes:
        hand: Hand by name, or its description file or URDF.
        folder: Where meshes of training objects are written.
        contact_set: Contact set; the hand's default if None.
        kinds: Kinds of objects in turn.
        scale: Factor on their sizes.
        force_law: What makes forces.
        patience: Starts after which an object is given up if none of them was feasible.
    """

    hand: str
    folder: Path
    contact_set: str | None = None
    kinds: tuple[str, ...] = KINDS
    scale: float = 1.0
    force_law: Literal["springs", "controllable"] = "springs"
    patience: int = PATIENCE

    def __post_init__(self) -> None:
        object.__setattr__(self, "scale", positive("scale", self.scale))
        positive_whole("patience", self.patience, MOST_PATIENCE)

    def problem(self, seed: int, space: SynergySpace, hand: Hand | None = None) -> GraspProblem:
        """Return the problem of a seed with all synergies of a set."""
        rng = np.random.default_rng(seed)
        thing = random_object(self.kind(seed), rng, self.folder).resized(self.scale)
        return GraspProblem(
            load_hand(self.hand) if hand is None else hand,
            thing,
            (force_task(rng.normal(size=3)),),
            space.n_synergies,
            GraspParameters(force_weight=FORCE_WEIGHT, force_law=self.force_law),
            synergy_space=space,
            contact_set=self.contact_set,
        )

    def kind(self, seed: int) -> str:
        """Return the kind of object of a seed."""
        return self.kinds[seed % len(self.kinds)]


@dataclass(frozen=True)
class PlanJob:
    """Plan an object with a set until there are enough feasible grasps."""

    seed: int
    space: SynergySpace
    starts: int
    enough: int


@dataclass(frozen=True)
class MoveJob:
    """Move one grasp of an object towards the others."""

    seed: int
    grasp: compact.FreeGrasp
    scatter: compact.Scatter
    epsilon: float


class Trainer:
    """Answers jobs; makes every object once."""

    def __init__(self, training: Training) -> None:
        self.training = training
        self.hand = load_hand(training.hand)
        self._free = fully_actuated(self.hand)
        self._problems: dict[int, GraspProblem] = {}

    def __call__(self, job: PlanJob | MoveJob, context: JobContext | None = None) -> list[compact.FreeGrasp]:
        """Return the grasps that were found, or the one that was moved."""
        if isinstance(job, MoveJob):
            return [compact.moved_closer(self._problem(job.seed), job.grasp, job.scatter, job.epsilon)]
        found: list[compact.FreeGrasp] = []
        failed = 0

        def keep(grasp: Grasp) -> None:
            nonlocal failed
            if grasp.feasible:
                found.append(compact.free_grasp(grasp))
            else:
                failed += 1

        def hopeless() -> bool:
            return not found and failed >= self.training.patience

        problem = replace(self._problem(job.seed), n_synergies=job.space.n_synergies, synergy_space=job.space)
        options = PlannerOptions(starts=job.starts, enough=job.enough)
        plan_grasp(problem, seed=job.seed, options=options, result_callback=keep, cancel=hopeless)
        return found

    def _problem(self, seed: int) -> GraspProblem:
        if seed not in self._problems:
            self._problems[seed] = self.training.problem(seed, self._free, self.hand)
        return self._problems[seed]


def fully_actuated(hand: Hand) -> SynergySpace:
    """Return a space in which every joint is a synergy, around a half-closed posture."""
    mean = hand.lower + 0.35 * (hand.upper - hand.lower)
    # Joints that open as far as they close, abductions, start in the middle.
    mean[np.isclose(hand.lower, -hand.upper)] = 0.0
    return SynergySpace(hand.joint_names, mean, np.eye(hand.n_joints), name="fully actuated")


def object_scale(hand: Hand, contact_set: str | None = None) -> float:
    """Return the factor on the sizes of random objects at which they suit a hand.

    Args:
        hand: The hand; at the mean posture of its closing set it is about as wide as what it holds.
        contact_set: Contact set; the hand's first if left out.
    """
    frames = hand.contact_frames(contact_set)
    first, *others = HandConfiguration(hand, hand.synergies(CLOSING).mean).contact_centres(frames)
    width = np.linalg.norm(first - np.mean(others, axis=0)) - frames[0].radius - np.mean([f.radius for f in frames[1:]])
    return float(np.clip(width / USUAL_WIDTH, *SCALES))
