"""Options shared by the commands that plan, and how they become a problem."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

import click
import numpy as np

from ..exceptions import InvalidValueError
from ..hand.loading import load_hand
from ..model.task_direction import parse_task
from ..objects import parse_object
from ..planning.options import PlannerOptions
from ..problem.clearance_options import ClearanceOptions
from ..problem.parameters import STANDARD_GRAVITY, GraspParameters
from ..problem.problem import PAPER_SYNERGIES, PRACTICAL_SYNERGIES, GraspProblem
from ..spatial import Array, readonly
from .loads import LOAD_OPTIONS, loads_from_options

Command = TypeVar("Command", bound=Callable[..., Any])

CLEARANCES = ("links", "joint-centres", "none")
"""Values of ``--clearance``."""

DEFAULT_OBJECT = "cylinder:radius=0.03,height=0.15,mass=0.2"

GRASP_OPTIONS = (
    click.option(
        "--hand", default="dlr_hit_ii_right", show_default=True, help="Hand by name, or a description file (TOML)."
    ),
    click.option(
        "--object",
        "object_text",
        default=DEFAULT_OBJECT,
        show_default=True,
        help="Object as shape:key=value,… in SI units.",
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
        "--synergies",
        "n_synergies",
        type=int,
        default=None,
        help=f"Number of synergies [default: {PRACTICAL_SYNERGIES}; {PAPER_SYNERGIES} with --paper].",
    ),
    click.option("--synergy-set", default=None, help="Synergy set of the hand [default: the hand's]."),
    click.option(
        "--contact-set",
        default=None,
        help="Contact set of the hand, for instance point or sphere [default: the hand's first].",
    ),
    click.option("--contacts", default=None, help="Contacts of the set that touch, as name,name,… [default: all]."),
    click.option(
        "--clearance",
        type=click.Choice(CLEARANCES),
        default=None,
        help="What keeps clear: links of the object and of each other with Remark 1; joint centres of the object "
        "with Remark 1, the paper's own; nothing, the paper's plain problem [default: links; none with --paper].",
    ),
    click.option("--ground", type=float, default=None, help="Height of a table no link may enter [m] [default: none]."),
)
"""What is grasped, by what, for what, and what keeps clear."""

MODEL_OPTIONS = (
    click.option(
        "--w-force", type=float, default=1e-6, show_default=True, help="Weight w_F of the grasping force F [1/N]."
    ),
    click.option("--w-task", type=float, default=1.0, show_default=True, help="Weight w_C of the task index C."),
    click.option("--friction", type=float, default=0.8, show_default=True, help="Coefficient of friction μ."),
    click.option("--structural-compliance", type=float, default=None, help="C_s [m/N] [default: the hand's]."),
    click.option("--joint-compliance", type=float, default=None, help="C_q [rad/(N m)] [default: the hand's]."),
    click.option("--contact-stiffness", type=float, default=None, help="K_c [N/m] [default: the hand's]."),
    click.option(
        "--gravity",
        default=f"0,0,-{STANDARD_GRAVITY}",
        show_default=True,
        help="Gravity x,y,z in the object frame [m/s²].",
    ),
    click.option(
        "--torque-model",
        type=click.Choice(["total", "internal"]),
        default="total",
        show_default=True,
        help="Torque that bends the soft joints: of the total contact force, or the internal one (eq. 33).",
    ),
)
"""Weights and parameters of the model."""


def problem_options(command: Command) -> Command:
    """Add the options that describe a problem to a command."""
    for option in reversed((*GRASP_OPTIONS, *MODEL_OPTIONS, *LOAD_OPTIONS)):
        command = option(command)
    return command


def search_options(command: Command) -> Command:
    """Add the options of the search to a command."""
    options = [
        click.option("--starts", type=int, default=40, show_default=True, help="Most starts."),
        click.option(
            "--enough", type=int, default=2, show_default=True, help="Feasible grasps after which the best is taken."
        ),
        click.option(
            "--max-iterations", type=int, default=200, show_default=True, help="Most iterations of each phase."
        ),
        click.option("--tolerance", type=float, default=1e-8, show_default=True, help="Accuracy asked of the solver."),
        click.option("--time-limit", type=float, default=None, help="Most wall time [s]."),
        click.option("--seed", type=int, default=0, show_default=True, help="Seed of the random starts."),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def problem_from_options(
    *,
    hand: str,
    object_text: str,
    tasks: tuple[str, ...],
    n_synergies: int | None,
    synergy_set: str | None,
    contact_set: str | None,
    contacts: str | None,
    clearance: str | None,
    ground: float | None,
    w_force: float,
    w_task: float,
    friction: float,
    structural_compliance: float | None,
    joint_compliance: float | None,
    contact_stiffness: float | None,
    gravity: str,
    torque_model: str,
    paper: bool,
    **load_options: Any,
) -> GraspProblem:
    """Return the problem of command-line options.

    Raises:
        GraspPlannerError: If a value is out of range or a name does not exist.
    """
    loaded = load_hand(hand)
    defaults = loaded.description.compliance
    if n_synergies is None:
        n_synergies = min(PAPER_SYNERGIES if paper else PRACTICAL_SYNERGIES, loaded.n_joints)
    clearance = clearance or ("none" if paper else "links")
    if clearance == "none":
        avoided = replace(ClearanceOptions.off(), ground=ground)
    else:
        avoided = ClearanceOptions(ground=ground, link_object="geometry" if clearance == "links" else "joint_centres")
    parameters = GraspParameters(
        friction=friction,
        structural_compliance=_given(structural_compliance, defaults.structural),
        joint_compliance=joint_compliance,
        contact_stiffness=_given(contact_stiffness, defaults.contact_stiffness),
        force_weight=w_force,
        task_weight=w_task,
        gravity=_vector("gravity", gravity),
        torque_model=torque_model,  # type: ignore[arg-type]  # click has checked the choice
    )
    return GraspProblem(
        hand=loaded,
        grasp_object=parse_object(object_text),
        tasks=tuple(parse_task(text) for text in tasks),
        n_synergies=n_synergies,
        parameters=parameters,
        synergy_set=synergy_set,
        contact_set=contact_set,
        contacts=None if contacts is None else tuple(name.strip() for name in contacts.split(",")),
        clearance=avoided,
        loads=loads_from_options(paper=paper, **load_options),
    )


def planner_options(
    *, starts: int, enough: int, max_iterations: int, tolerance: float, time_limit: float | None
) -> PlannerOptions:
    """Return planner options of command-line options."""
    return PlannerOptions(
        starts=starts,
        enough=enough,
        max_iterations=max_iterations,
        tolerance=tolerance,
        time_limit_s=time_limit,
    )


def parse_counts(name: str, text: str) -> tuple[int, ...]:
    """Return the numbers of a list such as ``1-5,15``; ``name`` is the option's.

    Raises:
        InvalidValueError: If it is malformed.
    """
    counts: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not first.isdigit() or (dash and not last.isdigit()):
            raise InvalidValueError(name, text, "numbers and ranges, such as 1-5,15")
        counts += range(int(first), int(last if dash else first) + 1)
    return tuple(dict.fromkeys(counts))


def parse_names(text: str) -> tuple[str, ...]:
    """Return the entries of a comma-separated list, each once."""
    return tuple(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))


def _given(value: float | None, default: float) -> float:
    """Return an option's value, or the default where it was left out."""
    return default if value is None else value


def _vector(field: str, text: str) -> Array:
    """Return three numbers of a comma-separated text."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3 or not np.isfinite(values).all():
        raise InvalidValueError(field, text, "three finite numbers x,y,z")
    return readonly(values)
