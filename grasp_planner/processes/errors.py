"""Errors of worker processes."""

from __future__ import annotations

from ..exceptions import GraspPlannerError


class WorkerStartError(GraspPlannerError):
    """Worker processes end before they are ready.

    Attributes:
        detail: How the last one ended.
        log: File that says more; None if there is none.
    """

    def __init__(self, detail: str, log: str | None = None) -> None:
        self.detail, self.log = detail, log
        super().__init__(f"workers do not start ({detail})" + (f"; see {log}" if log else ""))

    def __reduce__(self) -> tuple[type, tuple[str, str | None]]:
        return type(self), (self.detail, self.log)


class JobError(GraspPlannerError):
    """A job gave no answer.

    Attributes:
        number: Number of the job.
        detail: What happened.
    """

    def __init__(self, number: int, detail: str) -> None:
        self.number, self.detail = number, detail
        super().__init__(f"job {number} gave no answer: {detail}")

    def __reduce__(self) -> tuple[type, tuple[int, str]]:
        return type(self), (self.number, self.detail)
