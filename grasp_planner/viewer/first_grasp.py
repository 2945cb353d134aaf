"""The grasp the page opens with: a known one if it is still feasible, else planned from there."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any

import numpy as np
import pinocchio as pin

from ..grasp import Grasp
from ..hand import load_hand
from ..objects import Cylinder
from ..planner import PlannerOptions, plan_grasp
from ..problem import GraspProblem
from ..starts import GraspStart

TIME_LIMIT_S = 8.0
"""How long the page may take to open in the worst case [s]."""


def first_grasp() -> Grasp:
    """Return a good grasp of the paper's cylinder with few synergies, for a force along y."""
    known = json.loads(resources.files(__package__).joinpath("first_start.json").read_text(encoding="utf-8"))
    problem = GraspProblem(load_hand(), Cylinder(), n_synergies=known["n_synergies"], contact_set=known["contact_set"])
    start = _known_start(problem, known)
    if start is not None:
        grasp = Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma)
        if grasp.feasible:
            return grasp
    return plan_grasp(problem, options=PlannerOptions(enough=1, time_limit_s=TIME_LIMIT_S), start=start)


def _known_start(problem: GraspProblem, known: dict[str, Any]) -> GraspStart | None:
    """Return the start that comes with the package, if it is one for this hand."""
    if tuple(known["joint_names"]) != problem.hand.joint_names:
        return None
    x, y, z, w = known["quaternion_xyzw"]
    rotation = pin.Quaternion(w, x, y, z).normalized().matrix()
    return GraspStart(
        np.array(known["joint_angles"]), pin.SE3(rotation, np.array(known["position"])), np.array(known["delta_sigma"])
    )
