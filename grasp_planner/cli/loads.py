"""Options of load cases, shared by the commands that plan, and how they become load cases."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

from ..problem.load_cases import LoadCases, wrench_of_text

STANDARD = LoadCases()

LOAD_OPTIONS = (
    click.option(
        "--paper",
        is_flag=True,
        help="The paper's plain problem: nominal load only, no limits of forces, nothing keeps clear. Other options "
        "add to it.",
    ),
    click.option(
        "--load-force",
        type=float,
        default=None,
        help=f"Disturbing force to withstand, any direction [N] [default: {STANDARD.force:g}; 0 with --paper].",
    ),
    click.option(
        "--load-torque",
        type=float,
        default=None,
        help="Disturbing torque to withstand, about any axis [N m] [default: 0].",
    ),
    click.option(
        "--load-acceleration",
        type=float,
        default=None,
        help="Acceleration of the object to withstand, any direction [m/s²] [default: 0].",
    ),
    click.option(
        "--load-wrench",
        "load_wrenches",
        multiple=True,
        help="A further disturbance fx,fy,fz or fx,fy,fz,mx,my,mz in the object frame [N, N m]. Repeatable.",
    ),
    click.option(
        "--friction-safety",
        type=float,
        default=None,
        help=f"s: forces stay in the cones of μ/s [default: {STANDARD.friction_safety:g}; 1 with --paper].",
    ),
    click.option(
        "--min-normal",
        type=float,
        default=None,
        help=f"Least normal force of every contact [N] [default: {STANDARD.min_normal_force:g}; 0 with --paper].",
    ),
    click.option(
        "--max-normal",
        type=float,
        default=None,
        help="Largest normal force of every contact [N] [default: the hand's].",
    ),
    click.option("--max-force", type=float, default=None, help="Largest grasping force F [N] [default: none]."),
    click.option(
        "--hand-limits/--no-hand-limits",
        default=None,
        help="Whether the hand's limits of normal forces and joint torques count [default: yes; no with --paper].",
    ),
)
"""What the grasp has to withstand."""


def loads_from_options(
    *,
    paper: bool,
    load_force: float | None,
    load_torque: float | None,
    load_acceleration: float | None,
    load_wrenches: tuple[str, ...],
    friction_safety: float | None,
    min_normal: float | None,
    max_normal: float | None,
    max_force: float | None,
    hand_limits: bool | None,
) -> LoadCases:
    """Return the load cases of command-line options: the practical ones, or with ``paper`` none, changed as given.

    Raises:
        GraspPlannerError: If a value is out of range.
    """
    given: dict[str, Any] = {
        "force": load_force,
        "torque": load_torque,
        "acceleration": load_acceleration,
        "friction_safety": friction_safety,
        "min_normal_force": min_normal,
        "max_normal_force": max_normal,
        "max_force_norm": max_force,
        "hand_limits": hand_limits,
    }
    chosen = {name: value for name, value in given.items() if value is not None}
    if load_wrenches:
        chosen["wrenches"] = tuple(wrench_of_text(text) for text in load_wrenches)
    return replace(LoadCases.off() if paper else LoadCases(), **chosen)
