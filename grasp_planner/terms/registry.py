"""The registry: every requirement that a problem can have. To add one, write its class and list it here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..evaluation.state import GraspState
from ..exceptions import InvalidValueError
from ..problem.problem import GraspProblem
from ..problem.term import Constraint, Requirement, own_costs
from ..spatial import Array
from .clearance import (
    ContactOffLink,
    GroundClearance,
    JointCentreClearance,
    LinkObjectClearance,
    SelfClearance,
    Tangency,
    TipPatch,
)
from .contact import ContactRegion, SurfaceContact
from .edge import EdgeDistance
from .equilibrium import ForceBalance, MomentBalance
from .friction import FrictionCone
from .loads import ForceBudget, LoadFriction, LoadMaxNormal, LoadMinNormal, LoadTorque
from .posture import AbductionOrder, JointLimits, SoftSynergy
from .share import FingerShare
from .tension import Tension

REQUIREMENTS: tuple[Requirement, ...] = (
    SurfaceContact(),
    SoftSynergy(),
    FrictionCone(),
    FingerShare(),
    ContactRegion(),
    JointLimits(),
    ForceBalance(),
    MomentBalance(),
    LinkObjectClearance(),
    JointCentreClearance(),
    SelfClearance(),
    GroundClearance(),
    TipPatch(),
    ContactOffLink(),
    Tangency(),
    EdgeDistance(),
    AbductionOrder(),
    Tension(),
    LoadFriction(),
    LoadMinNormal(),
    LoadMaxNormal(),
    LoadTorque(),
    ForceBudget(),
)
"""Every built-in requirement, in the order of their rows in the planning program."""


def judged_requirements(problem: GraspProblem) -> tuple[Requirement, ...]:
    """Return what a grasp of a problem has to meet: the built-in requirements it asks for, then the user's own."""
    return (*(term for term in REQUIREMENTS if term.judged and term.wanted(problem)), *_own(problem))


def problem_constraints(problem: GraspProblem) -> tuple[Constraint, ...]:
    """Return what the search holds: of the same requirements those that are constraints, and the helpers among them."""
    built_in = (term for term in REQUIREMENTS if isinstance(term, Constraint) and term.wanted(problem))
    return (*built_in, *(term for term in _own(problem) if isinstance(term, Constraint)))


def stacked(
    terms: Sequence[Constraint],
    problem: GraspProblem,
    state: GraspState,
    weight: Callable[[Constraint], float],
    margin: Callable[[Constraint], float] = lambda term: 0.0,
) -> tuple[Array, Array]:
    """Return the weighted residuals of terms, less margins, one below the other, and their Jacobian.

    Args:
        terms: The terms.
        problem: The problem.
        state: The state.
        weight: Weight of a term.
        margin: What is taken off the residuals of a term, in its unit.

    Returns:
        Residuals of shape (m,) and their derivatives by x, of shape (m, n_x).
    """
    if not terms:
        return np.zeros(0), np.zeros((0, state.x.size))
    value = np.concatenate([weight(term) * (term.residual(problem, state) - margin(term)) for term in terms])
    return value, np.vstack([weight(term) * term.jacobian(problem, state) for term in terms])


def check_shapes(problem: GraspProblem, state: GraspState) -> None:
    """Check that the user's own terms give arrays of the right shape.

    Raises:
        InvalidValueError: If one does not.
    """
    n_x = state.x.size
    for term in problem.constraints:
        if not isinstance(term, Constraint):
            continue
        residual, jacobian = term.residual(problem, state), term.jacobian(problem, state)
        if np.ndim(residual) != 1:
            raise InvalidValueError(f"residual of {term.name}", np.shape(residual), "an array of shape (m,)")
        _expect(f"jacobian of {term.name}", jacobian, (len(residual), n_x))
    for each in own_costs(problem.costs):
        _expect(f"value of {each.cost.name}", each.cost.value(problem, state), ())
        _expect(f"gradient of {each.cost.name}", each.cost.gradient(problem, state), (n_x,))


def _expect(field: str, values: Any, shape: tuple[int, ...]) -> None:
    """Raise if values have another shape."""
    if np.shape(values) != shape:
        raise InvalidValueError(field, np.shape(values), f"an array of shape {shape}" if shape else "one number")


def _own(problem: GraspProblem) -> tuple[Requirement, ...]:
    """Return the user's own requirements that are wanted."""
    return tuple(term for term in problem.constraints if term.wanted(problem))
