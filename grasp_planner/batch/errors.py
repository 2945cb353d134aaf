"""Errors of batch planning: where in the spec, or which file of the run."""

from __future__ import annotations

from pathlib import Path

from ..exceptions import FileFormatError, GraspPlannerError, shown


class SpecError(GraspPlannerError):
    """A batch specification is wrong.

    Attributes:
        file: The file; None for a specification that was not read from one.
        where: Path inside the specification, such as ``blocks[0].product.n_synergies[2]``.
        value: The value found there.
        allowed: What would be allowed, in words.
        line: Line of the file, from 1; None if not known.
    """

    def __init__(self, file: Path | None, where: str, value: object, allowed: str, line: int | None = None) -> None:
        self.file, self.where, self.value, self.allowed, self.line = file, where, value, allowed, line
        place = f"{file}: " if file is not None else ""
        at = f" (line {line})" if line is not None else ""
        super().__init__(f"{place}{where or 'specification'}{at}: got {shown(value)}, allowed: {allowed}")

    def __reduce__(self) -> tuple[type, tuple[Path | None, str, object, str, int | None]]:
        return type(self), (self.file, self.where, self.value, self.allowed, self.line)


class ResultsError(FileFormatError):
    """A run can't be read, written or continued; what it holds already stays intact."""


class SchedulerError(GraspPlannerError):
    """The Dask scheduler can't be reached, or was lost."""


class BatchDependencyError(GraspPlannerError):
    """A library of the optional extra ``batch`` is not installed."""

    def __init__(self, library: str) -> None:
        self.library = library
        super().__init__(f"batch planning needs {library}: install the extra 'batch' (in a clone: scripts/setup batch)")

    def __reduce__(self) -> tuple[type, tuple[str]]:
        return type(self), (self.library,)
