"""From a specification to its cases, made one by one when they are asked for."""

from __future__ import annotations

import bisect
import hashlib
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, overload

import numpy as np

from ..exceptions import GraspPlannerError, InvalidValueError, NameNotFoundError
from ..hand.hand import Hand
from ..hand.loading import load_hand
from ..objects import parse_object
from .axes import axis_stream
from .case import SETTINGS, GraspCase
from .errors import SpecError
from .spec import OBJECT_KEY, BatchSpec, Block, axis_values
from .yaml_file import join

MAX_CASES = 10_000_000
"""Most cases of a specification."""
MAX_CHECKED_ROWS, MAX_CHECKED_PROBLEMS = 100_000, 5000
"""Most cases that are made, and most different problems that are built, only to check them."""


@dataclass(frozen=True)
class _Grid:
    """The axes of one block: keys that vary together, with the rows of values they take."""

    groups: tuple[tuple[tuple[str, ...], tuple[tuple[Any, ...], ...]], ...]

    @property
    def size(self) -> int:
        """Number of cases."""
        return math.prod(len(rows) for _, rows in self.groups)

    def at(self, index: int) -> dict[str, Any]:
        """Return the values of one case; the last group varies fastest."""
        chosen: dict[str, Any] = {}
        for keys, rows in reversed(self.groups):
            index, row = divmod(index, len(rows))
            chosen.update(zip(keys, rows[row], strict=True))
        return chosen


class CaseTable(Sequence[GraspCase]):
    """The cases of a specification, by row; each is made when it is asked for."""

    def __init__(self, spec: BatchSpec) -> None:
        self.spec = spec
        self._grids = tuple(_grid(spec, number, block) for number, block in enumerate(spec.blocks))
        self._ends = list(itertools.accumulate(grid.size for grid in self._grids))
        if self._ends[-1] > MAX_CASES:
            raise spec.error("blocks", f"{self._ends[-1]:.3g} cases", f"at most {MAX_CASES} cases")

    def __len__(self) -> int:
        return self._ends[-1]

    @overload
    def __getitem__(self, index: int) -> GraspCase: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[GraspCase]: ...
    def __getitem__(self, index: int | slice) -> GraspCase | Sequence[GraspCase]:
        """Return one case, or some."""
        if isinstance(index, slice):
            return [self[row] for row in range(*index.indices(len(self)))]
        row = index + len(self) if index < 0 else index
        if not 0 <= row < len(self):
            raise IndexError(index)
        return self._case(row)

    def block_of(self, row: int) -> int:
        """Return the number of the block a row belongs to."""
        return bisect.bisect_right(self._ends, row)

    def _case(self, row: int) -> GraspCase:
        """Make the case of a row."""
        number = self.block_of(row)
        block = self.spec.blocks[number]
        values = {**self.spec.defaults, **block.fixed}
        values.update(self._grids[number].at(row - (self._ends[number - 1] if number else 0)))
        for override in self.spec.overrides:
            if all(_matches(values.get(key), wanted) for key, wanted in override.where.items()):
                values.update(override.set)
        try:
            return _case_of(values)
        except GraspPlannerError as error:
            raise self._error(row, values, error) from None

    def _error(self, row: int, values: dict[str, Any], error: GraspPlannerError) -> SpecError:
        """Return the error of a case, pointing at the entry that gave the value."""
        number = self.block_of(row)
        block, here = self.spec.blocks[number], f"blocks[{number}]"
        key = _blamed(error, values)
        if key is None:
            return self.spec.error(here, values, f"{error} (case {row})")
        parts = {f"{here}.product": block.product, f"{here}.zip": block.zip, f"{here}.fixed": block.fixed}
        parts["defaults"] = self.spec.defaults
        where = next((join(name, key) for name, part in parts.items() if key in part), here)
        return self.spec.error(where, values[key], f"{error} (case {row})")

    def _checked_rows(self) -> Iterable[int]:
        """Return the rows that are checked before anything is planned; others that are wrong say so in their rows."""
        if len(self) <= MAX_CHECKED_ROWS:
            return range(len(self))
        rng = np.random.default_rng(self.spec.seed)
        return np.unique(rng.integers(len(self), size=MAX_CHECKED_ROWS)).tolist()

    def check(self, on_hand: Callable[[Hand], None] | None = None) -> None:
        """Check that the cases make problems, of very many a sample; hands and synergies are looked at once each.

        Args:
            on_hand: Called once with each hand.

        Raises:
            SpecError: If one does not; names the entry and the first such case.
        """
        hands: dict[str, Hand] = {}
        seen: set[tuple[Any, ...]] = set()
        for row in self._checked_rows():
            case = self._case(row)
            kinds = tuple(sorted({task.partition(":")[0] for task in case.task}))
            key = (case.hand, case.n_synergies, kinds, repr(case.settings))
            if key in seen:
                continue
            seen.add(key)
            if len(seen) > MAX_CHECKED_PROBLEMS:
                return
            try:
                if case.hand not in hands:
                    hands[case.hand] = load_hand(case.hand)
                    if on_hand is not None:
                        on_hand(hands[case.hand])
                case.problem(hands[case.hand])
            except GraspPlannerError as error:
                values = case.model_dump(exclude={"settings"}) | case.settings
                raise self._error(row, values, error) from None


def cases_hash(cases: Sequence[GraspCase], planner: str) -> str:
    """Return sixteen hexadecimal digits that depend on every case, their order, and the planner."""
    digest = hashlib.sha256(planner.encode())
    for case in cases:
        digest.update(case.case_id.encode())
    return digest.hexdigest()[:16]


def _blamed(error: GraspPlannerError, values: dict[str, Any]) -> str | None:
    """Return the key of a case that an error is about, if it can be told."""
    about = error.field if isinstance(error, InvalidValueError) else str(error)
    size = about.rpartition(".")[2].split()[0] if about.startswith("object") and "." in about else ""
    named = error.name if isinstance(error, NameNotFoundError) else size
    if f"{OBJECT_KEY}{named}" in values:
        return f"{OBJECT_KEY}{named}"
    if "object" in about:
        return "object" if "object" in values else None
    return next((key for key in sorted(values, key=len, reverse=True) if key in about), None)


def _grid(spec: BatchSpec, number: int, block: Block) -> _Grid:
    """Expand the axes of a block."""
    groups: list[tuple[tuple[str, ...], tuple[tuple[Any, ...], ...]]] = []
    for key, values in block.product.items():
        where = join(f"blocks[{number}].product", key)
        found = axis_values(spec, where, values, axis_stream(spec.seed, number, key))
        groups.append(((key,), tuple((value,) for value in found)))
    columns = {
        key: axis_values(spec, join(f"blocks[{number}].zip", key), values, axis_stream(spec.seed, number, key))
        for key, values in block.zip.items()
    }
    if columns:
        lengths = {key: len(values) for key, values in columns.items()}
        if len(set(lengths.values())) > 1:
            raise spec.error(f"blocks[{number}].zip", lengths, "lists of equal length")
        groups.append((tuple(columns), tuple(zip(*columns.values(), strict=True))))
    return _Grid(tuple(groups))


def _matches(value: Any, wanted: Any) -> bool:
    """Return whether a value is the wanted one, or one of those wanted; numbers to nine digits."""
    if isinstance(wanted, list) and not isinstance(value, list):
        return any(_matches(value, one) for one in wanted)
    if isinstance(value, int | float) and isinstance(wanted, int | float):
        return math.isclose(value, wanted, rel_tol=1e-9)
    return bool(value == wanted)


def _case_of(values: dict[str, Any]) -> GraspCase:
    """Return the case of plain values by key."""
    sizes = {key.removeprefix(OBJECT_KEY): value for key, value in values.items() if key.startswith(OBJECT_KEY)}
    known = {key: value for key, value in values.items() if key in GraspCase.model_fields and key != "settings"}
    known["object"] = _object_text(values.get("object", "cylinder"), sizes)
    return GraspCase(**known, settings={key: value for key, value in values.items() if key in SETTINGS})


def _object_text(base: str, sizes: dict[str, Any]) -> str:
    """Return the full text form of an object, with some sizes replaced or added."""
    kind, _, rest = base.partition(":")
    parts = [part for part in rest.split(",") if part and part.partition("=")[0].strip() not in sizes]
    parts += [f"{key}={value}" for key, value in sizes.items()]
    return parse_object(f"{kind}:{','.join(parts)}" if parts else kind).text
