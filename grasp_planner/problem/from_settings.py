"""A problem from settings by name, as the command line and a batch give them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ..exceptions import InvalidValueError, NameNotFoundError
from ..hand.hand import Hand
from ..model.task_direction import TaskDirection
from ..objects import GraspObject
from .clearance_options import CLEARANCES, ClearanceOptions
from .load_cases import LoadCases
from .parameters import GraspParameters
from .problem import GraspProblem
from .settings import Setting, settings_of

PROBLEM_SETTINGS: dict[str, Setting] = {
    each.key: each
    for owner in (GraspProblem, GraspParameters, ClearanceOptions, LoadCases)
    for each in settings_of(owner)
}
"""Every setting of a problem by its key."""
PRESETS = ("clearance", "loads")
"""Groups of settings that may start from all or from nothing."""


def options_from_settings(owner: type, settings: Mapping[str, Any], start: Any = None) -> Any:
    """Return a dataclass of settings.

    Args:
        owner: Its class.
        settings: Plain values by key; those of others are passed over.
        start: What the rest is taken from; the defaults if left out.

    Raises:
        GraspPlannerError: If one is out of range.
    """
    given = {each.name: each.of_plain(settings[each.key]) for each in settings_of(owner) if each.key in settings}
    return owner(**given) if start is None else replace(start, **given)


def clearance_from_settings(settings: Mapping[str, Any], *, paper: bool = False) -> ClearanceOptions:
    """Return the clearance options of settings; ``clearance`` says where they start from.

    Args:
        settings: Plain values by key; ``clearance``: true, false or one of :data:`CLEARANCES`.
        paper: Whether nothing keeps clear unless asked for.

    Raises:
        GraspPlannerError: If one is out of range.
    """
    asked = settings.get("clearance")
    asked = not paper if asked is None else asked
    if isinstance(asked, str) and asked in CLEARANCES:
        start = ClearanceOptions.named(asked)
    elif isinstance(asked, bool):
        start = ClearanceOptions() if asked else ClearanceOptions.off()
    else:
        raise InvalidValueError("clearance", asked, f"true, false, {', '.join(CLEARANCES)}; {_single('clearance')}")
    found: ClearanceOptions = options_from_settings(ClearanceOptions, settings, start)
    return found


def loads_from_settings(settings: Mapping[str, Any], *, paper: bool = False) -> LoadCases:
    """Return the load cases of settings; ``loads``, true or false, says where they start from.

    Args:
        settings: Plain values by key.
        paper: Whether nothing has to be withstood unless asked for.

    Raises:
        GraspPlannerError: If one is out of range.
    """
    asked = settings.get("loads")
    asked = not paper if asked is None else asked
    if not isinstance(asked, bool):
        raise InvalidValueError("loads", asked, f"true or false; {_single('loads')}")
    found: LoadCases = options_from_settings(LoadCases, settings, LoadCases() if asked else LoadCases.off())
    return found


def problem_from_settings(
    hand: Hand,
    grasp_object: GraspObject,
    tasks: tuple[TaskDirection, ...],
    settings: Mapping[str, Any],
    *,
    paper: bool = False,
) -> GraspProblem:
    """Return the problem of settings.

    Args:
        hand: The hand.
        grasp_object: The object.
        tasks: Task directions.
        settings: Plain values by key, as ``friction`` or ``loads.force``; what is left out has its default.
        paper: Whether they start from the paper's plain problem.

    Raises:
        GraspPlannerError: If a name does not exist or a value is out of range.
    """
    check_keys(settings)
    own = {each.name: each.of_plain(settings[each.key]) for each in settings_of(GraspProblem) if each.key in settings}
    parameters: GraspParameters = options_from_settings(GraspParameters, settings)
    return GraspProblem(
        hand=hand,
        grasp_object=grasp_object,
        tasks=tasks,
        parameters=parameters.of_paper() if paper else parameters,
        clearance=clearance_from_settings(settings, paper=paper),
        loads=loads_from_settings(settings, paper=paper),
        **own,
    )


def check_keys(settings: Mapping[str, Any]) -> None:
    """Check that every setting exists.

    Raises:
        NameNotFoundError: If one does not.
    """
    for key in settings:
        if key not in PROBLEM_SETTINGS and key not in PRESETS:
            raise NameNotFoundError("setting", key, (*PROBLEM_SETTINGS, *PRESETS))


def _single(group: str) -> str:
    """Say which single settings a group has."""
    return "single settings are " + ", ".join(key for key in PROBLEM_SETTINGS if key.startswith(f"{group}."))
