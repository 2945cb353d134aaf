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

    def __init__(self, problem: GraspProblem, reference_pose: pin.SE3, like: PosedHandEvaluator | None = None) -> None:
        """Make an evaluator; what it may share with another one it takes from there."""
        self.problem, self.reference_pose = problem, reference_pose
        self.chart = PoseChart.around(reference_pose)
        shared: ClearanceEvaluator | None = None if like is None else like.clearance
        if shared is None or not shared.serves(problem):
            shared = ClearanceEvaluator(problem) if problem.clearance.needs_geometry else None
        self.clearance: ClearanceEvaluator | None = shared
        geometry: ContactGeometryEvaluator | None = None if like is None else like._geometry
        self._geometry: ContactGeometryEvaluator = ContactGeometryEvaluator(problem, self.chart, geometry)
        self._posed = slice(0, VariableLayout.of(problem).n_geometric)
        self._last: tuple[bytes, ContactGeometry, ClearanceState | None] | None = None

    @classmethod
    def of(cls, problem: GraspProblem, reference_pose: pin.SE3, like: PosedHandEvaluator | None) -> PosedHandEvaluator:
        """Return an evaluator, another one or what may be shared of it."""
        if like is None or reference_pose is not like.reference_pose:
            return cls(problem, reference_pose, like)
        shared = like.clearance is not None and like.clearance.serves(problem)
        same = shared and problem.contact_model == like.problem.contact_model
        return like if same else cls(problem, reference_pose, like)

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
