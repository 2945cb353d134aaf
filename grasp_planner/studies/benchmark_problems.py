"""The random problems that the benchmark plans: seeded objects and task directions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from ..checks import known_names
from ..exceptions import NameNotFoundError
from ..hand.loading import load_hand
from ..hand.urdf_file import ROBOT_DATA, find_robot_file
from ..model.task_direction import force_task
from ..objects import GraspObject, MeshObject
from ..objects.random_objects import CLOSED_FORMS, MASS
from ..objects.resting import resting_pose
from ..problem.clearance_options import ClearanceOptions
from ..problem.load_cases import LoadCases
from ..problem.parameters import GraspParameters
from ..problem.problem import GraspProblem

MESHES = {
    "wrist": ("talos_data/meshes/arm/arm_6_collision.STL", 1.0),
    "flange": ("z1_description/meshes/collision/z1_Link06.STL", 1.0),
    "palm": ("tiago_description/meshes/hey5/palm_collision.stl", 0.8),
}
"""Meshes of robot parts as graspable things: file below the robots of example-robot-data, and scale."""


def _mesh(name: str, rng: np.random.Generator) -> GraspObject:
    file, scale = MESHES[name]
    path = find_robot_file(f"{ROBOT_DATA}:robots/{file}", Path())
    return MeshObject.load(path, scale=scale * float(rng.uniform(0.85, 1.1)), mass=MASS)


OBJECTS: dict[str, Callable[[np.random.Generator], GraspObject]] = {
    **CLOSED_FORMS,
    **{f"mesh-{name}": partial(_mesh, name) for name in MESHES},
}
"""Random objects by kind: those of closed form, and three meshes of random scale."""


def object_kinds(names: Sequence[str]) -> tuple[str, ...]:
    """Return kinds of objects by name; ``all`` alone stands for all of them.

    Raises:
        NameNotFoundError: If there is no such kind.
    """
    return known_names("kind of object", names, OBJECTS)


def on_table(problem: GraspProblem) -> GraspProblem:
    """Return a problem whose object stands on a table, z up if it can: gravity and ground follow.

    Raises:
        InvalidValueError: If the object stands on no side of its hull.
    """
    pose = resting_pose(problem.grasp_object)
    gravity = pose.gravity(problem.parameters.gravity)
    return replace(
        problem,
        parameters=replace(problem.parameters, gravity=gravity),
        clearance=replace(problem.clearance, ground=-pose.height),
    )


@dataclass(frozen=True)
class BenchmarkCase:
    """One random problem, as text and numbers.

    Attributes:
        seed: Seed of the problem and of the planner.
        n_synergies: n_s.
        hand: Hand by name or description file.
        object_kind: Kind of object, out of :data:`OBJECTS`.
        synergy_set: Synergy set; the hand's default if None.
        contact_set: Contact set; the hand's default if None.
        clearance: Whether links keep clear of object and fingers, and fingers in order (Remarks 1 and 2).
        loads: Whether the grasp has to hold the standard load cases.
    """

    seed: int
    n_synergies: int
    hand: str = "dlr_hit_ii_right"
    object_kind: str = "cylinder"
    synergy_set: str | None = None
    contact_set: str | None = None
    clearance: bool = False
    loads: bool = False

    def problem(self) -> GraspProblem:
        """Return the problem: a random object of the kind, a random force direction, the paper's parameters.

        Raises:
            NameNotFoundError: If there is no such kind of object, hand or set.
        """
        if self.object_kind not in OBJECTS:
            raise NameNotFoundError("kind of object", self.object_kind, OBJECTS)
        rng = np.random.default_rng(self.seed)
        thing = OBJECTS[self.object_kind](rng)
        return GraspProblem(
            load_hand(self.hand),
            thing,
            (force_task(rng.normal(size=3)),),
            self.n_synergies,
            GraspParameters(),
            synergy_set=self.synergy_set,
            contact_set=self.contact_set,
            clearance=ClearanceOptions() if self.clearance else ClearanceOptions.off(),
            loads=LoadCases() if self.loads else LoadCases.off(),
        )
