"""One case of a batch: plain values that name a problem, and the problem they name."""

from __future__ import annotations

import contextlib
import hashlib
from functools import cached_property
from typing import Any

from pydantic import BaseModel, ConfigDict, field_validator
from pydantic import Field as ModelField

from ..exceptions import GraspPlannerError, NameNotFoundError
from ..hand.hand import Hand
from ..model.task_direction import parse_task
from ..objects import parse_object
from ..problem.from_settings import (
    PRESETS,
    PROBLEM_SETTINGS,
    clearance_from_settings,
    loads_from_settings,
    options_from_settings,
    problem_from_settings,
)
from ..problem.parameters import GraspParameters, hand_parameters
from ..problem.problem import GraspProblem
from ..problem.search_options import PlannerOptions
from ..problem.settings import Setting, settings_of
from ..problem.synergy_number import default_synergies

DEFAULT_TIME_LIMIT_S = 120.0
"""Wall time after which a case is stopped, unless it says otherwise [s]."""

MAX_SEED = 2**63 - 1
"""Largest seed: what a column of whole numbers holds."""
DEFAULT_MEMORY_LIMIT_MB = 4000.0
"""Memory of its worker above which a case is stopped, unless it says otherwise [MB]."""
MAX_MEMORY_LIMIT_MB = 1e7
"""Largest memory limit of a case [MB]."""
MAX_TIME_LIMIT_S = 30 * 86400.0
"""Longest wall time of a case [s]."""
SEARCH_SETTINGS = {each.key: each for each in settings_of(PlannerOptions) if each.name != "time_limit_s"}
"""Settings of the planner; its own time limit is left out, because rows would depend on the machine's speed."""
SETTINGS: tuple[str, ...] = tuple(
    key for key in (*PROBLEM_SETTINGS, *PRESETS, *SEARCH_SETTINGS) if key != "n_synergies"
)
"""Everything a case may set besides hand, object, task, n_synergies, seed and time_limit_s."""
COLUMNS = {each.column: each for each in (*PROBLEM_SETTINGS.values(), *SEARCH_SETTINGS.values()) if each.kind != "text"}
"""Settings that are single values, by their flat columns."""
TYPES = {"number": float, "whole": int, "truth": bool, "choice": str}
"""Types of flat columns by the kind of setting."""


class GraspCase(BaseModel):
    """One grasp to be planned, as plain values.

    Attributes:
        hand: Name of a hand of the package, or path of a description file.
        object: Text form of the object, such as ``cylinder:radius=0.03``.
        task: Text forms of the task directions, such as ``force:+y``.
        n_synergies: Number of synergies n_s; if None, as in ``GraspProblem``.
        paper: Whether settings start from the paper's plain problem, without clearances and load cases.
        seed: Seed of the random starts.
        time_limit_s: Wall time after which the case is stopped [s].
        memory_limit_mb: Memory of its worker above which the case is stopped [MB].
        settings: Fields of ``GraspParameters``, ``PlannerOptions`` and ``GraspProblem`` that differ from their
            defaults, by name, in the units given there.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    hand: str = "dlr_hit_ii_right"
    object: str = "cylinder"
    task: tuple[str, ...] = ModelField(default=("force:+y",), min_length=1)
    n_synergies: int | None = ModelField(default=None, ge=1, strict=True)
    paper: bool = ModelField(default=False, strict=True)
    seed: int = ModelField(default=0, ge=0, le=MAX_SEED, strict=True)
    time_limit_s: float = ModelField(default=DEFAULT_TIME_LIMIT_S, gt=0.0, le=MAX_TIME_LIMIT_S, allow_inf_nan=False)
    memory_limit_mb: float = ModelField(
        default=DEFAULT_MEMORY_LIMIT_MB, gt=0.0, le=MAX_MEMORY_LIMIT_MB, allow_inf_nan=False
    )
    settings: dict[str, Any] = ModelField(default_factory=dict)

    @field_validator("task", mode="before")
    @classmethod
    def _one_task(cls, value: Any) -> Any:
        """Accept one task without a list around it."""
        return (value,) if isinstance(value, str) else value

    @field_validator("settings")
    @classmethod
    def _known_settings(cls, value: dict[str, Any]) -> dict[str, Any]:
        """Refuse settings that do not exist."""
        for name in value:
            if name not in SETTINGS:
                raise NameNotFoundError("setting", name, SETTINGS)
        return dict(sorted(value.items()))

    @cached_property
    def case_id(self) -> str:
        """Sixteen hexadecimal digits that depend on everything but the limits of time and memory."""
        return hashlib.sha256(self.model_dump_json(exclude={"time_limit_s", "memory_limit_mb"}).encode()).hexdigest()[
            :16
        ]

    def options(self) -> PlannerOptions:
        """Return the options of the planner.

        Raises:
            GraspPlannerError: If one is out of range.
        """
        found: PlannerOptions = options_from_settings(PlannerOptions, self.settings)
        return found

    def check(self) -> None:
        """Check every setting on its own.

        Raises:
            GraspPlannerError: If one is out of range.
        """
        self.options()
        options_from_settings(GraspParameters, self.settings)
        clearance_from_settings(self.settings, paper=self.paper)
        loads_from_settings(self.settings, paper=self.paper)

    def problem(self, hand: Hand) -> GraspProblem:
        """Return the problem.

        Args:
            hand: The hand that :attr:`hand` names.

        Raises:
            GraspPlannerError: If object, task or a setting does not exist or is out of range.
        """
        settings = {key: value for key, value in self.settings.items() if key not in SEARCH_SETTINGS}
        if self.n_synergies is not None:
            settings["n_synergies"] = self.n_synergies
        tasks = tuple(parse_task(task) for task in self.task)
        return problem_from_settings(hand, parse_object(self.object), tasks, settings, paper=self.paper)

    def columns(self, hand: Hand | None) -> dict[str, float | int | bool | str | None]:
        """Return every setting that is a single value as the problem has it, for the flat columns of the results.

        Args:
            hand: The hand, whose own values stand where a case says nothing; None if it can't be loaded.
        """
        values = {column: self.settings.get(each.key, _default(self, each)) for column, each in COLUMNS.items()}
        values["n_synergies"] = self.n_synergies
        with contextlib.suppress(GraspPlannerError):
            for group, options in (
                ("clearance.", clearance_from_settings(self.settings, paper=self.paper)),
                ("loads.", loads_from_settings(self.settings, paper=self.paper)),
            ):
                own = {each.column: getattr(options, each.name) for each in COLUMNS.values() if each.group == group}
                values |= own
            if hand is not None:
                motion = any(parse_task(task).is_motion for task in self.task)
                name = self.settings.get("synergy_set")
                number = default_synergies(hand, name, clear=not self.paper, motion=motion)
                chosen: dict[str, Any] = {key: self.settings.get(key) for key in ("torque_model", "force_law")}
                parameters = GraspParameters(**chosen)
                parameters = (parameters.of_paper() if self.paper else parameters).of_hand(hand)
                values |= {name: getattr(parameters, name) for name in chosen}
                defaults = {"n_synergies": number, **hand_parameters(hand)}
                values |= {name: value for name, value in defaults.items() if name in COLUMNS and values[name] is None}
        return {name: _typed(COLUMNS[name], value) for name, value in values.items()}


def column_types() -> dict[str, type]:
    """Return the type of every setting that is a single value, by the name of its column."""
    return {column: TYPES[each.kind] for column, each in COLUMNS.items()}


def _default(case: GraspCase, each: Setting) -> Any:
    """Return the default of a setting."""
    return each.paper if case.paper else each.default


def _typed(each: Setting, value: Any) -> Any:
    """Return a value in the type of its column; None for a value that is none."""
    plain = each.of_plain(value)
    return TYPES[each.kind](plain) if isinstance(plain, bool | int | float | str) else None
