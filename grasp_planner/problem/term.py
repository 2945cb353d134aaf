"""The forms of a term: what a problem asks of a grasp, and what it makes small. The user's own terms have them too.

A term has two sides that share no formula. The search reads the fused state: residual and Jacobian, or value and
gradient. The judge reads the finished grasp, whose quantities come from the plain formulas: a violation, or a value.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import positive
from ..exceptions import InvalidValueError
from ..spatial import Array
from ..values import number_text


@dataclass(frozen=True, repr=False)
class Unit:
    """The unit of a term, and how much of it counts: an amount 1/scale of one unit weighs like that of another.

    Attributes:
        symbol: Its symbol, ``1`` where there is none.
        scale: Factor that brings residuals to order one for the solver and makes violations comparable.
        weight: Weight in the least-squares solves: millimetres, newtons and a few degrees count alike.
        margin: How far inside inequalities phase one ends.
        polish_margin: How far inside inequalities the last polish of a solution ends.
        shown_as: The unit people read it in.
        shown_times: Factor from this unit to that one.
    """

    symbol: str
    scale: float = 1.0
    weight: float = 1.0
    margin: float = 0.0
    polish_margin: float = 0.0
    shown_as: str = ""
    shown_times: float = 1.0

    def __repr__(self) -> str:
        return f"Unit({self.symbol!r})"

    def text(self, value: float) -> str:
        """Return a value with the symbol."""
        if math.isnan(value):
            return "not a number"
        return f"{number_text(value)} {self.symbol.removeprefix('1')}".rstrip()


METRE = Unit("m", 100.0, 1000.0, 1e-4, 1e-8, "mm", 1e3)
RADIAN = Unit("rad", 10.0, 30.0, 1e-3, 1e-8, "°", 180.0 / np.pi)
NEWTON = Unit("N", 1.0, 1.0, 0.05, 1e-6, "N")
NEWTON_METRE = Unit("N m", 10.0, 10.0, 1e-3, 1e-8, "N m")
ONE = Unit("1", 1.0, 3.0, 0.02, 1e-8)


def above_zero(value: Any) -> float:
    """Return a number, or 0 if it is less; what is not a number stays so: it is a violation."""
    return float(np.maximum(0.0, value))


BUILT_IN_COSTS = ("force_norm", "task_index", "force_sharing", "joint_stops", "mean_posture", "closing_normals")
BUILT_IN_CONSTRAINTS = (
    "surface",
    "compliance",
    "friction",
    "finger_share",
    "region",
    "joint_limit",
    "equilibrium_force",
    "equilibrium_moment",
    "link_object",
    "joint_centre",
    "self_collision",
    "ground",
    "tip_patch",
    "contact_off_link",
    "tangency",
    "edge",
    "abduction_order",
    "tension",
    "load_friction",
    "load_min_normal",
    "load_max_normal",
    "load_torque",
    "load_force_norm",
)
"""Names that the user's own terms can't have; a test compares them with the registry."""


class Requirement(ABC):
    """Something that a grasp has to meet, as the judge sees it.

    Attributes:
        name: Name in violations, histories and reports.
        unit: Unit of the violation.
        judged: Whether it counts in a grasp's violations; a constraint that only helps the search does not.
    """

    name: str
    unit: Unit
    judged: bool = True

    def wanted(self, problem: Any) -> bool:
        """Return whether a :class:`~grasp_planner.problem.problem.GraspProblem` asks for it."""
        return True

    @abstractmethod
    def violation(self, grasp: Any) -> float:
        """Return by how much a grasp violates it, in its unit; 0 if it does not.

        Args:
            grasp: A :class:`~grasp_planner.judge.posed_grasp.PosedGrasp`; its quantities, never a state.
        """


class Constraint(Requirement):
    """A requirement that the search holds: ``residual = 0`` (equality) or ``residual ≥ 0`` on a state.

    Attributes:
        equality: Whether it is an equality.
        geometric: Whether it depends on posture and palm pose only, not on forces.
    """

    equality: bool = False
    geometric: bool = True

    @property
    def scale(self) -> float:
        """Factor that brings residuals to order one for the solver."""
        return self.unit.scale

    @abstractmethod
    def residual(self, problem: Any, state: Any) -> Array:
        """Return the residuals at a :class:`~grasp_planner.evaluation.state.GraspState`, of shape (m,)."""

    @abstractmethod
    def jacobian(self, problem: Any, state: Any) -> Array:
        """Return ∂residual/∂x, of shape (m, n_x)."""

    def shortfall(self, problem: Any, state: Any) -> float:
        """Return the largest violation as the search sees it, in the constraint's unit; 0 if none."""
        residual = self.residual(problem, state)
        if residual.size == 0:
            return 0.0
        return float(np.abs(residual).max() if self.equality else above_zero(-residual.min()))


class Cost(ABC):
    """A scalar to be made small.

    Attributes:
        name: Name in histories and reports.
        unit: Its unit.
    """

    name: str
    unit: Unit = ONE

    @abstractmethod
    def value(self, problem: Any, state: Any) -> float:
        """Return the value at a :class:`~grasp_planner.evaluation.state.GraspState`."""

    @abstractmethod
    def gradient(self, problem: Any, state: Any) -> Array:
        """Return the gradient by x, of shape (n_x,)."""

    @abstractmethod
    def clear_value(self, grasp: Any) -> float:
        """Return the value of a :class:`~grasp_planner.judge.posed_grasp.PosedGrasp`, by the plain formulas."""

    def typical(self, problem: Any, state: Any) -> float:
        """Return what the value may come down to from a start: it sets the scale of the objective."""
        return 0.1 * abs(self.value(problem, state))

    def weighted(self, weight: float) -> Weighted:
        """Return the cost with a weight in the objective."""
        return Weighted(self, weight)


@dataclass(frozen=True)
class Weighted:
    """A cost with its weight in the objective.

    Attributes:
        cost: The cost.
        weight: Its weight, ≥ 0, per unit of the cost.
    """

    cost: Cost
    weight: float = 1.0

    def __post_init__(self) -> None:
        if not isinstance(self.cost, Cost):
            raise InvalidValueError("costs", self.cost, "Cost objects, weighted or not")
        name = f"weight of {self.cost.name}"
        object.__setattr__(self, "weight", positive(name, self.weight, zero_allowed=True))


def own_costs(given: Iterable[Cost | Weighted]) -> tuple[Weighted, ...]:
    """Return the user's costs, each with a weight: 1 where none is given.

    Raises:
        InvalidValueError: If one is no cost, or has no unit, or no name or that of another one.
    """
    found = tuple(each if isinstance(each, Weighted) else Weighted(each) for each in _several("costs", given))
    _check_names("costs", tuple(each.cost for each in found), BUILT_IN_COSTS)
    return found


def own_constraints(given: Iterable[Requirement]) -> tuple[Requirement, ...]:
    """Return the user's requirements: constraints, or what is judged without being searched for.

    Raises:
        InvalidValueError: If one is no requirement, or has no unit, or no name or that of another one.
    """
    found = _several("constraints", given)
    for each in found:
        if not isinstance(each, Requirement):
            raise InvalidValueError("constraints", each, "Constraint objects")
    _check_names("constraints", found, BUILT_IN_CONSTRAINTS)
    return found


def _several(field: str, given: Any) -> tuple[Any, ...]:
    """Return what was given as a tuple."""
    try:
        return tuple(given)
    except TypeError:
        raise InvalidValueError(field, given, "several of them, such as (term,)") from None


def _check_names(field: str, terms: tuple[Any, ...], built_in: tuple[str, ...]) -> None:
    """Check that every term has a unit and a name of its own, which no built-in one has."""
    seen = set()
    for term in terms:
        name, unit = getattr(term, "name", None), getattr(term, "unit", None)
        if not isinstance(name, str) or not name:
            raise InvalidValueError(f"{field}: name of {type(term).__name__}", name, "a text")
        if not isinstance(unit, Unit):
            raise InvalidValueError(f"{field}: unit of {name}", unit, "a Unit, such as NEWTON")
        if name in seen:
            raise InvalidValueError(field, name, "every name once")
        if name in built_in:
            raise InvalidValueError(field, name, "a name that no built-in term has")
        seen.add(name)
