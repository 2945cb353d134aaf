"""Costs and requirements in the JSON form: names, units and values. A file never names code to run."""

from __future__ import annotations

from collections.abc import Iterable

from ..exceptions import InvalidValueError
from ..grasp.grasp import Grasp
from ..problem.problem import GraspProblem
from ..problem.term import Cost, Requirement, Weighted, own_costs
from ..terms.objective import problem_objective
from .layout import CostRecord, GraspRecord, OwnTermsRecord, ViolationRecord
from .parts import finite_or_none


def violation_records(grasp: Grasp) -> dict[str, ViolationRecord]:
    """Return the records of all violations, by name."""
    return {
        name: ViolationRecord(value=finite_or_none(found.value), unit=found.unit.symbol)
        for name, found in grasp.violations.items()
    }


def cost_records(grasp: Grasp) -> dict[str, CostRecord]:
    """Return the records of all costs, by name."""
    return {
        each.cost.name: CostRecord(
            value=finite_or_none(each.cost.clear_value(grasp)), unit=each.cost.unit.symbol, weight=each.weight
        )
        for each in problem_objective(grasp.problem).terms
    }


def own_terms_record(problem: GraspProblem) -> OwnTermsRecord:
    """Return the names of the user's own terms."""
    return OwnTermsRecord(
        costs=[each.cost.name for each in own_costs(problem.costs)],
        constraints=[term.name for term in problem.constraints],
    )


def own_terms_of(
    record: GraspRecord, costs: Iterable[Cost | Weighted], constraints: Iterable[Requirement]
) -> tuple[tuple[Weighted, ...], tuple[Requirement, ...]]:
    """Return the user's own terms of a record, with the weights of the record, in its order.

    Args:
        record: The record, which has only their names.
        costs: The costs named there.
        constraints: The constraints named there.

    Raises:
        InvalidValueError: If one that is named is missing, or one is given that is not named.
    """
    by_name = {each.cost.name: each.cost for each in own_costs(costs)}
    _match("costs", record.own_terms.costs, by_name)
    given = {term.name: term for term in constraints}
    _match("constraints", record.own_terms.constraints, given)
    weighted = tuple(by_name[name].weighted(record.costs[name].weight) for name in record.own_terms.costs)
    return weighted, tuple(given[name] for name in record.own_terms.constraints)


def _match(field: str, named: Iterable[str], given: Iterable[str]) -> None:
    """Check that the terms given are those named."""
    missing, surplus = sorted(set(named) - set(given)), sorted(set(given) - set(named))
    if missing:
        allowed = f"own terms of the grasp: {', '.join(missing)} missing; pass them to grasp_from_record as {field}="
        raise InvalidValueError(field, tuple(given), allowed)
    if surplus:
        raise InvalidValueError(field, tuple(surplus), "only own terms that the file names")
