"""Options shared by the commands that plan, and how they become a problem."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from ..exceptions import InvalidValueError
from ..hand.loading import loaded_hand, locked_joints
from ..model.task_direction import parse_task
from ..objects import GraspObject, parse_object
from ..objects.resting import resting_pose
from ..problem.clearance_options import CLEARANCES
from ..problem.from_settings import PROBLEM_SETTINGS, options_from_settings, problem_from_settings
from ..problem.parameters import GraspParameters
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from ..problem.settings import settings_of
from .output import say_findings
from .settings import given_settings, setting_options

Command = TypeVar("Command", bound=Callable[..., Any])

MAX_SEED = 2**63 - 1
"""Largest seed."""
MAX_DIGITS = 4
"""Most digits of a number in a list."""
DEFAULT_OBJECT = "cylinder:radius=0.03,height=0.15,mass=0.2"

GRASP_OPTIONS = (
    click.option(
        "--hand",
        default="dlr_hit_ii_right",
        show_default=True,
        help="Hand by name, or a description file (TOML) or a URDF.",
    ),
    click.option(
        "--lock",
        "locks",
        multiple=True,
        help="Fix a joint of the hand's URDF: NAME=VALUE in rad or m. Repeatable.",
    ),
    click.option(
        "--object",
        "object_text",
        default=None,
        help=f"Object as shape:key=value,… in SI units [default: {DEFAULT_OBJECT}; of a plain URDF a cylinder in size "
        "for the hand].",
    ),
    click.option(
        "--table",
        is_flag=True,
        help="The object stands on a table, z up if it can, otherwise as low as it can: gravity and ground follow.",
    ),
    click.option(
        "--task",
        "tasks",
        multiple=True,
        default=("force:+y",),
        show_default=True,
        help="Direction to transmit: force|torque|twist, a signed axis or x,y,z, optionally *weight. Repeatable.",
    ),
    click.option(
        "--paper",
        is_flag=True,
        help="The paper's plain problem: nominal load only, no limits of forces, nothing keeps clear. Other options "
        "add to it.",
    ),
    click.option(
        "--clearance",
        type=click.Choice(CLEARANCES),
        default=None,
        help="What keeps clear: links of the object and of each other; joint centres of the object "
        "with Remark 1, the paper's own; nothing, the paper's plain problem [default: links; none with --paper].",
    ),
    click.option(
        "--loads/--no-loads",
        default=None,
        help="Whether the standard load cases are withstood [default: yes; no with --paper].",
    ),
)
"""What is grasped, by what, for what, and what the settings start from."""


def problem_options(command: Command) -> Command:
    """Add the options that describe a problem to a command."""
    options: list[Any] = [*GRASP_OPTIONS, *setting_options(PROBLEM_SETTINGS.values())]
    for option in reversed(options):
        command = option(command)
    return command


def search_options(command: Command) -> Command:
    """Add the options of the search to a command."""
    seed = click.option(
        "--seed", type=click.IntRange(0, MAX_SEED), default=0, show_default=True, help="Seed of the random starts."
    )
    options: list[Any] = [*setting_options(settings_of(PlannerOptions)), seed]
    for option in reversed(options):
        command = option(command)
    return command


def problem_from_options(
    *,
    hand: str,
    locks: tuple[str, ...] = (),
    object_text: str | None,
    table: bool = False,
    tasks: tuple[str, ...],
    paper: bool,
    clearance: str | None,
    loads: bool | None,
    **settings: Any,
) -> GraspProblem:
    """Return the problem of command-line options; what was repaired or derived of a hand goes to standard error.

    Raises:
        GraspPlannerError: If a value is out of range or a name does not exist.
    """
    given = given_settings(settings, PROBLEM_SETTINGS.values())
    given |= {name: value for name, value in (("clearance", clearance), ("loads", loads)) if value is not None}
    loaded = loaded_hand(hand, locked_joints(locks))
    say_findings(loaded.hand)
    if object_text is None and loaded.first_object:
        click.echo(f"derived: object in size for the hand: {loaded.first_object}", err=True)
    thing = parse_object(object_text or loaded.first_object or DEFAULT_OBJECT)
    if table:
        given |= _on_table(thing, given)
    return problem_from_settings(loaded.hand, thing, tuple(parse_task(text) for text in tasks), given, paper=paper)


def _on_table(thing: GraspObject, given: dict[str, Any]) -> dict[str, Any]:
    """Return gravity and ground of an object that stands on a table, and say how it stands.

    Args:
        thing: The object.
        given: Settings by key; of gravity its size is kept.
    """
    if "clearance.ground" in given:
        raise InvalidValueError(
            "clearance.ground", given["clearance.ground"], "no height beside --table, which finds it"
        )
    pose = resting_pose(thing)
    gravity = GraspParameters().gravity
    if "gravity" in given:
        gravity = PROBLEM_SETTINGS["gravity"].of_plain(given["gravity"])
    up = ", ".join(f"{x:.3g}" for x in pose.up + 0.0)
    click.echo(f"derived: stands with ({up}) up, its centre of mass {pose.height:.3g} m above the table", err=True)
    return {"gravity": pose.gravity(gravity).tolist(), "clearance.ground": -pose.height}


def planner_options(arguments: dict[str, Any]) -> PlannerOptions:
    """Return planner options of command-line options.

    Raises:
        GraspPlannerError: If a value is out of range.
    """
    settings = settings_of(PlannerOptions)
    found: PlannerOptions = options_from_settings(PlannerOptions, given_settings(arguments, settings))
    return found


def parse_counts(name: str, text: str) -> tuple[int, ...]:
    """Return the numbers of a list such as ``1-5,15``; ``name`` is the option's.

    Raises:
        InvalidValueError: If it is malformed.
    """
    counts: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        ends = [first, last if dash else first]
        if not all(end.isascii() and end.isdecimal() and len(end) <= MAX_DIGITS for end in ends):
            raise InvalidValueError(name, text, "numbers and ranges, such as 1-5,15")
        counts += range(int(ends[0]), int(ends[1]) + 1)
    return tuple(dict.fromkeys(counts))


def parse_names(text: str) -> tuple[str, ...]:
    """Return the entries of a comma-separated list, each once."""
    return tuple(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))
