"""The grasp the page opens with: a known one if it is still feasible, else planned from there."""

from __future__ import annotations

import json
from importlib import resources
from typing import Any

import numpy as np
import pinocchio as pin

from ..grasp.grasp import Grasp
from ..hand.hand import Hand
from ..hand.loading import load_hand
from ..objects import Cylinder
from ..planning.options import PlannerOptions
from ..planning.planner import plan_grasp
from ..planning.starts import GraspStart
from ..problem.clearance_options import ClearanceOptions
from ..problem.parameters import GraspParameters
from ..problem.problem import GraspProblem

TIME_LIMIT_S = 8.0
"""How long the page may take to open in the worst case [s]."""


def first_grasp() -> Grasp:
    """Return a good grasp of the paper's cylinder for a force along y: the first known one that is feasible."""
    hand = load_hand()
    known = json.loads(resources.files(__package__).joinpath("first_starts.json").read_text(encoding="utf-8"))
    attempts = []
    for entry in known:
        if tuple(entry["joint_names"]) == hand.joint_names:
            problem = _problem(hand, entry)
            start = _start(problem, entry)
            grasp = Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma)
            if grasp.feasible:
                return grasp
            attempts.append((problem, start))
    options = PlannerOptions(starts=1, enough=1, time_limit_s=TIME_LIMIT_S / max(len(attempts), 1))
    for problem, start in attempts:
        grasp = plan_grasp(problem, options=options, start=start)
        if grasp.feasible:
            return grasp
    problem = GraspProblem(hand, Cylinder(), n_synergies=hand.n_joints)
    return plan_grasp(problem, options=PlannerOptions(enough=1, time_limit_s=TIME_LIMIT_S))


def _problem(hand: Hand, entry: dict[str, Any]) -> GraspProblem:
    """Return the problem of an entry."""
    return GraspProblem(
        hand,
        Cylinder(),
        n_synergies=entry["n_synergies"],
        contact_set=entry["contact_set"],
        synergy_set=entry["synergy_set"],
        parameters=GraspParameters(force_weight=entry["force_weight"]),
        clearance=ClearanceOptions(),
    )


def _start(problem: GraspProblem, entry: dict[str, Any]) -> GraspStart:
    """Return a start from its numbers."""
    x, y, z, w = entry["quaternion_xyzw"]
    rotation = pin.Quaternion(w, x, y, z).normalized().matrix()
    pose = pin.SE3(rotation, np.array(entry["position"]))
    # Kept as S δσ, so that with as many synergies as joints it holds for any synergy set.
    displacement = np.array(entry["joint_displacement"])
    delta_sigma = np.linalg.lstsq(problem.synergies.basis, displacement, rcond=None)[0]
    return GraspStart(np.array(entry["joint_angles"]), pose, delta_sigma)


def start_entry(grasp: Grasp) -> dict[str, Any]:
    """Return a grasp as an entry of ``first_starts.json``."""
    problem = grasp.problem
    return {
        "n_synergies": problem.n_synergies,
        "contact_set": problem.contact_set or problem.hand.contact_set_names[0],
        "synergy_set": problem.synergy_set,
        "force_weight": problem.parameters.force_weight,
        "joint_names": list(problem.hand.joint_names),
        "joint_angles": grasp.joint_angles.tolist(),
        "position": np.array(grasp.palm_pose.translation).tolist(),
        "quaternion_xyzw": np.array(pin.Quaternion(np.array(grasp.palm_pose.rotation)).coeffs()).tolist(),
        "joint_displacement": (problem.synergies.basis @ grasp.delta_sigma).tolist(),
    }
