"""The state of the page as the query of a link: problem, search and posture. Plain text; no display code here."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlencode

import numpy as np
import pinocchio as pin

from ..exceptions import InvalidValueError, NameNotFoundError
from ..grasp.grasp import Grasp
from ..hand.description import hand_library
from ..hand.loading import load_hand
from ..model.task_direction import parse_task
from ..objects import parse_object
from ..planning.planner import MOST_GRASPS
from ..planning.starts import standard_start
from ..problem.from_settings import PROBLEM_SETTINGS, options_from_settings, problem_from_settings
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from ..problem.settings import Setting, settings_of
from ..spatial import Array, Pose
from .equivalent import differences, search_differences

LONGEST = 6000
"""Most characters of a link's query; browsers and servers take twice as many."""
MAX_SEED = 10**6
"""Largest seed of the page."""
SEARCH_SETTINGS = {each.key: each for each in settings_of(PlannerOptions)}
FIXED = ("hand", "object", "task", "paper", "seed", "grasps", "posture")
"""Keys besides those of the settings."""
OF_THE_PAGE = (
    "darkMode",
    "fixedDpr",
    "hideViserLogo",
    "initialCamera",
    "logCamera",
    "playbackPath",
    "showStats",
    "websocket",
)
"""What the keys begin with that the page's library reads itself."""
ELSEWHERE = "what needs no file; save the grasp (JSON) and send that"


@dataclass(frozen=True)
class LinkedState:
    """What a link opens.

    Attributes:
        grasp: The grasp, of the link's problem; where its search starts if the link has no posture.
        options: How it is searched.
        seed: Seed of the random starts.
        count: How many grasps that differ.
        posed: Whether the link has a posture.
    """

    grasp: Grasp
    options: PlannerOptions
    seed: int = 0
    count: int = 1
    posed: bool = True


def state_query(grasp: Grasp, options: PlannerOptions | None = None, seed: int = 0, count: int = 1) -> str:
    """Return the query of a link that opens a grasp with its problem.

    Args:
        grasp: The grasp shown.
        options: How it is searched; the defaults if left out.
        seed: Seed of the random starts.
        count: How many grasps that differ.

    Raises:
        InvalidValueError: If a link can't hold it: a mesh, a hand from outside, costs of one's own.
    """
    problem, options = grasp.problem, options or PlannerOptions()
    if problem.hand.name not in hand_library():
        raise InvalidValueError("the hand of a link", problem.hand.name, ELSEWHERE)
    if problem.grasp_object.kind == "mesh":
        raise InvalidValueError("the object of a link", "mesh", ELSEWHERE)
    paper, found = differences(problem)
    pairs = {
        "hand": problem.hand.name,
        "object": problem.grasp_object.text,
        "task": " ".join(task.text for task in problem.tasks),
    }
    pairs |= {"paper": "yes"} if paper else {}
    pairs |= {each.key: _text(each, value) for each, value in (*found, *search_differences(options))}
    pairs |= {"seed": str(seed)} if seed else {}
    pairs |= {"grasps": str(count)} if count > 1 else {}
    pairs["posture"] = base64.urlsafe_b64encode(_numbers(grasp).tobytes()).decode()
    query = urlencode(pairs)
    if len(query) > LONGEST:
        raise InvalidValueError("a link", f"{len(query)} characters", f"at most {LONGEST}; {ELSEWHERE}")
    if parse_state(pairs).grasp.problem != problem:
        raise InvalidValueError("a link", "synergies, costs, constraints or locked joints of its own", ELSEWHERE)
    return query


def is_state(query: Mapping[str, str]) -> bool:
    """Return whether a query means a state: whether it has keys besides those of the page's library."""
    return any(not key.startswith(OF_THE_PAGE) for key in query)


def parse_state(query: Mapping[str, str]) -> LinkedState:
    """Return what a link opens.

    Args:
        query: Keys and values of its query; those of the page's library are passed over.

    Raises:
        GraspPlannerError: If a key does not exist, a value does not fit, or a file would be needed.
    """
    known = (*FIXED, *PROBLEM_SETTINGS, *SEARCH_SETTINGS)
    given = {key: value for key, value in query.items() if not key.startswith(OF_THE_PAGE)}
    for key in given:
        if key not in known:
            raise NameNotFoundError("key of the link", key, known)
    problem = _problem(given)
    search = {key: _value(SEARCH_SETTINGS[key], given[key]) for key in SEARCH_SETTINGS if key in given}
    start = standard_start(problem)
    grasp = Grasp(problem, start.joint_angles, start.palm_pose, start.delta_sigma)
    return LinkedState(
        grasp=_posed(grasp, given["posture"]) if "posture" in given else grasp,
        options=options_from_settings(PlannerOptions, search),
        seed=_whole("seed", given.get("seed", "0"), 0, MAX_SEED),
        count=_whole("grasps", given.get("grasps", "1"), 1, MOST_GRASPS),
        posed="posture" in given,
    )


def _problem(given: Mapping[str, str]) -> GraspProblem:
    """Return the problem of a link."""
    name, thing = given.get("hand", "dlr_hit_ii_right"), given.get("object", "cylinder")
    if name not in hand_library():
        raise NameNotFoundError("hand of the link", name, tuple(hand_library()))
    if thing.partition(":")[0].strip() == "mesh":
        raise InvalidValueError("the object of a link", thing, ELSEWHERE)
    tasks = tuple(parse_task(part) for part in given.get("task", "force:+y").split())
    settings = {key: _value(PROBLEM_SETTINGS[key], given[key]) for key in PROBLEM_SETTINGS if key in given}
    paper = _truth("paper", given.get("paper", "no"))
    return problem_from_settings(load_hand(name), parse_object(thing), tasks, settings, paper=paper)


def _numbers(grasp: Grasp) -> Array:
    """Return posture, palm pose, δσ and contact forces of a grasp one after the other."""
    turn = np.array(pin.Quaternion(np.array(grasp.palm_pose.rotation)).coeffs())
    forces = np.zeros(0) if grasp.contact_forces is None else np.ravel(grasp.contact_forces)
    return np.concatenate([grasp.joint_angles, grasp.palm_pose.translation, turn, grasp.delta_sigma, forces])


def _posed(start: Grasp, text: str) -> Grasp:
    """Return a grasp of the problem of another one from the numbers of a link."""
    allowed = "the posture of a link as it was copied, for this hand and number of synergies"
    problem, size = start.problem, len(_numbers(start))
    try:
        numbers = np.frombuffer(base64.b64decode(text.encode("ascii"), altchars=b"-_", validate=True))
    except (binascii.Error, ValueError):
        raise InvalidValueError("posture", text, allowed) from None
    if len(numbers) != size or not (np.abs(numbers) < 1e6).all():
        raise InvalidValueError("posture", text, allowed)
    n_q = problem.hand.n_joints
    q, place, turn, rest = np.split(numbers, [n_q, n_q + 3, n_q + 7])
    length = float(np.linalg.norm(turn))
    if not 0.99 < length < 1.01:
        raise InvalidValueError("posture", text, allowed)
    x, y, z, w = turn / length
    pose = Pose.of(pin.SE3(pin.Quaternion(w, x, y, z).normalized().matrix(), np.array(place)))
    delta_sigma, forces = np.split(rest, [problem.n_synergies])
    shape = None if start.contact_forces is None else np.shape(start.contact_forces)
    return Grasp(problem, q, pose, delta_sigma, None if shape is None else forces.reshape(shape))


def _text(each: Setting, value: Any) -> str:
    """Return the text of a value, of a single number with all its digits."""
    return repr(value) if isinstance(value, float) else each.text(value)


def _value(each: Setting, text: str) -> Any:
    """Return the value of a text."""
    if each.kind == "truth" and (text or not each.none):
        return _truth(each.key, text)
    return each.of_text(text)


def _truth(key: str, text: str) -> bool:
    """Return a truth value."""
    if text not in ("yes", "no"):
        raise InvalidValueError(key, text, "yes or no")
    return text == "yes"


def _whole(key: str, text: str, low: int, high: int) -> int:
    """Return a whole number in a range."""
    if not (text.isascii() and text.isdecimal() and len(text) < 12 and low <= int(text) <= high):
        raise InvalidValueError(key, text, f"a whole number from {low} to {high}")
    return int(text)
