"""The grasp the page opens with: a known one if it is still feasible, else planned from there."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any

import numpy as np
import pinocchio as pin

from ..grasp.grasp import Grasp
from ..hand.loading import load_hand
from ..objects import Cylinder
from ..planning.planner import plan_grasp
from ..planning.starts import GraspStart
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions

TIME_LIMIT_S = 8.0
"""How long the page may take to open in the worst case [s]."""


def first_grasp() -> Grasp:
    """Return a good grasp for the default problem on the default object: the first known one that is feasible."""
    problem = GraspProblem(load_hand(), Cylinder())
    known = json.loads(resources.files(__package__).joinpath("first_starts.json").read_text(encoding="utf-8"))
    starts = [_start(problem, entry) for entry in known if tuple(entry["joint_names"]) == problem.hand.joint_names]
    for start in starts:
        grasp = Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma, start.contact_forces)
        if grasp.feasible:
            return grasp
    options = PlannerOptions(starts=1, enough=1, time_limit_s=TIME_LIMIT_S / max(len(starts), 1))
    for start in starts:
        grasp = plan_grasp(problem, options=options, start=start)
        if grasp.feasible:
            return grasp
    return plan_grasp(problem, options=PlannerOptions(enough=1, time_limit_s=TIME_LIMIT_S))


def _start(problem: GraspProblem, entry: dict[str, Any]) -> GraspStart:
    """Return a start from its numbers."""
    x, y, z, w = entry["quaternion_xyzw"]
    rotation = pin.Quaternion(w, x, y, z).normalized().matrix()
    pose = pin.SE3(rotation, np.array(entry["position"]))
    forces = np.array(entry["contact_forces"])
    return GraspStart(np.array(entry["joint_angles"]), pose, np.zeros(problem.n_synergies), forces)


def start_entry(grasp: Grasp) -> dict[str, Any]:
    """Return a grasp as an entry of ``first_starts.json``."""
    problem = grasp.problem
    return {
        "joint_names": list(problem.hand.joint_names),
        "joint_angles": grasp.joint_angles.tolist(),
        "position": np.array(grasp.palm_pose.translation).tolist(),
        "quaternion_xyzw": np.array(pin.Quaternion(np.array(grasp.palm_pose.rotation)).coeffs()).tolist(),
        "contact_forces": grasp.intensities.tolist(),
    }
