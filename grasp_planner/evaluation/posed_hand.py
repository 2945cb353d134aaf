"""What follows from posture and palm pose alone, contacts and clearances: the dear part of a state, kept for reuse."""

from __future__ import annotations

import pinocchio as pin

from ..problem.problem import GraspProblem
from ..spatial import Array
from .clearance import ClearanceEvaluator, ClearanceState
from .contact_geometry import ContactGeometry, ContactGeometryEvaluator
from .variables import PoseChart, VariableLayout


class PosedHandEvaluator:
    """Evaluates contact geometry and clearances and keeps the last ones: forces do not change them. For one thread."""

    def __init__(
        self, problem: GraspProblem, reference_pose: pin.SE3, clearance: ClearanceEvaluator | None = None
    ) -> None:
        """Make an evaluator; the clearances of another one may be given where they serve the problem."""
        self.problem, self.reference_pose = problem, reference_pose
        self.chart = PoseChart.around(reference_pose)
        self.clearance = clearance
        if clearance is None and problem.clearance.needs_geometry:
            self.clearance = ClearanceEvaluator(problem)
        self._geometry = ContactGeometryEvaluator(problem, self.chart)
        self._posed = slice(0, VariableLayout.of(problem).n_geometric)
        self._last: tuple[bytes, ContactGeometry, ClearanceState | None] | None = None

    @classmethod
    def of(cls, problem: GraspProblem, reference_pose: pin.SE3, like: PosedHandEvaluator | None) -> PosedHandEvaluator:
        """Return an evaluator, another one or what may be shared of it."""
        if like is None:
            return cls(problem, reference_pose)
        shared = like.clearance if like.clearance is not None and like.clearance.serves(problem) else None
        same = shared is not None and problem.contact_model == like.problem.contact_model
        return like if same and reference_pose is like.reference_pose else cls(problem, reference_pose, shared)

    def evaluate(self, x: Array) -> tuple[ContactGeometry, ClearanceState | None]:
        """Evaluate contacts and clearances.

        Args:
            x: The variables; only posture and palm pose are used, of shape (n_x,).

        Returns:
            The contact geometry, and the clearances of the hand; None if the problem asks for none.
        """
        key = x[self._posed].tobytes()
        if self._last is None or self._last[0] != key:
            geometry = self._geometry.evaluate(x)
            clearance = None if self.clearance is None else self.clearance.evaluate(geometry)
            self._last = key, geometry, clearance
        return self._last[1], self._last[2]
