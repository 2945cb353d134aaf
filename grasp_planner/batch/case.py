"""One case of a batch: plain values that name a problem, and the problem they name."""

from __future__ import annotations

import hashlib
from dataclasses import MISSING, Field, fields, is_dataclass, replace
from functools import cached_property
from typing import Any

from pydantic import BaseModel, ConfigDict, field_validator
from pydantic import Field as ModelField

from ..exceptions import InvalidValueError, NameNotFoundError
from ..hand.hand import Hand
from ..model.task_direction import parse_task
from ..objects import parse_object
from ..planning.options import PlannerOptions
from ..problem.parameters import GraspParameters
from ..problem.problem import GraspProblem

DEFAULT_TIME_LIMIT_S = 120.0
"""Wall time after which a case is stopped, unless it says otherwise [s]."""

_OWN_PROBLEM_FIELDS = ("hand", "grasp_object", "tasks", "n_synergies", "parameters", "synergy_space")


def _named(owner: Any, excluded: tuple[str, ...] = ()) -> dict[str, Field[Any]]:
    """Return the fields of a dataclass by name."""
    return {field.name: field for field in fields(owner) if field.name not in excluded and field.init}


PARAMETER_FIELDS = _named(GraspParameters)
"""Settings that are parameters of the model."""
OPTION_FIELDS = _named(PlannerOptions, ("time_limit_s",))
"""Settings of the planner; its own time limit is left out, because rows would depend on the machine's speed."""
PROBLEM_FIELDS = _named(GraspProblem, _OWN_PROBLEM_FIELDS)
"""Settings of the problem itself, such as the synergy set."""
GROUPS: dict[str, Any] = {
    name: field.default_factory()
    for name, field in PROBLEM_FIELDS.items()
    if field.default_factory is not MISSING and is_dataclass(field.default_factory())
}
"""Fields of the problem that are groups of options themselves, with their defaults; ``true`` asks for these, ``false``
for none of them, and ``<group>.<option>`` sets one."""
GROUP_SETTINGS = tuple(f"{name}.{field.name}" for name, group in GROUPS.items() for field in fields(group))
SETTINGS = (*PARAMETER_FIELDS, *OPTION_FIELDS, *PROBLEM_FIELDS, *GROUP_SETTINGS)
"""Everything a case may set besides hand, object, task, n_synergies, seed and time_limit_s."""


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
        settings: Fields of ``GraspParameters``, ``PlannerOptions`` and ``GraspProblem`` that differ from their
            defaults, by name, in the units given there.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    hand: str = "dlr_hit_ii_right"
    object: str = "cylinder"
    task: tuple[str, ...] = ModelField(default=("force:+y",), min_length=1)
    n_synergies: int | None = ModelField(default=None, ge=1, strict=True)
    paper: bool = ModelField(default=False, strict=True)
    seed: int = ModelField(default=0, ge=0, strict=True)
    time_limit_s: float = ModelField(default=DEFAULT_TIME_LIMIT_S, gt=0.0, allow_inf_nan=False)
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
        """Sixteen hexadecimal digits that depend on everything but the time limit."""
        return hashlib.sha256(self.model_dump_json(exclude={"time_limit_s"}).encode()).hexdigest()[:16]

    def _chosen(self, known: dict[str, Field[Any]]) -> dict[str, Any]:
        """Return the settings that belong to one dataclass, lists as tuples."""
        chosen = {name: value for name, value in self.settings.items() if name in known}
        return {name: tuple(value) if isinstance(value, list) else value for name, value in chosen.items()}

    def parameters(self) -> GraspParameters:
        """Return the parameters of the model.

        Raises:
            GraspPlannerError: If one is out of range.
        """
        return GraspParameters(**self._chosen(PARAMETER_FIELDS))

    def options(self) -> PlannerOptions:
        """Return the options of the planner.

        Raises:
            GraspPlannerError: If one is out of range.
        """
        return PlannerOptions(**self._chosen(OPTION_FIELDS))

    def problem_settings(self) -> dict[str, Any]:
        """Return the settings of the problem itself, groups of options put together.

        Raises:
            GraspPlannerError: If one is out of range.
        """
        chosen = {name: value for name, value in self._chosen(PROBLEM_FIELDS).items() if name not in GROUPS}
        if self.n_synergies is not None:
            chosen["n_synergies"] = self.n_synergies
        for name in GROUPS:
            own = {key.partition(".")[2]: self.settings[key] for key in self.settings if key.startswith(f"{name}.")}
            if own or name in self.settings:
                chosen[name] = replace(self._group(name), **own)
        return chosen

    def _group(self, name: str) -> Any:
        """Return the options that a group starts from."""
        asked = self.settings.get(name, not self.paper)
        if not isinstance(asked, bool):
            raise InvalidValueError(name, asked, f"true or false; single options are {', '.join(GROUP_SETTINGS)}")
        return GROUPS[name] if asked else type(GROUPS[name]).off()

    def problem(self, hand: Hand) -> GraspProblem:
        """Return the problem.

        Args:
            hand: The hand that :attr:`hand` names.

        Raises:
            GraspPlannerError: If object, task or a setting does not exist or is out of range.
        """
        make = GraspProblem.paper if self.paper else GraspProblem
        return make(
            hand=hand,
            grasp_object=parse_object(self.object),
            tasks=tuple(parse_task(task) for task in self.task),
            parameters=self.parameters(),
            **self.problem_settings(),
        )

    def scalar_settings(self) -> dict[str, float | int | bool | str]:
        """Return every scalar setting with its value or default, for the flat columns of the results."""
        known = {**PARAMETER_FIELDS, **OPTION_FIELDS}
        values = {name: self.settings.get(name, field.default) for name, field in known.items()}
        for name, group in GROUPS.items():
            base = self._group(name)
            for field in fields(group):
                values[f"{name}_{field.name}"] = self.settings.get(f"{name}.{field.name}", getattr(base, field.name))
        return {name: values[name] for name in scalar_setting_types()}


def scalar_setting_types() -> dict[str, type]:
    """Return the type of every setting whose default is a number, truth value or text, by the name of its column."""
    known = {**PARAMETER_FIELDS, **OPTION_FIELDS}
    defaults = {name: field.default for name, field in known.items() if field.default is not MISSING}
    for name, group in GROUPS.items():
        defaults.update({f"{name}_{field.name}": getattr(group, field.name) for field in fields(group)})
    return {name: type(value) for name, value in defaults.items() if isinstance(value, bool | int | float | str)}
