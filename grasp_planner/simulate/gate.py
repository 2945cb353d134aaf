"""The gate before any physics: how deep hand and object, or links of the hand, overlap. By coal, not by the simulator.

Buried fingers make contacts that do not exist; such a posture is refused, whatever it would do in simulation.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..closing.path import posture_overlaps
from ..grasp.grasp import Grasp
from ..spatial import Array
from .protocol import Geometry
from .table import with_table


@dataclass(frozen=True)
class GateReport:
    """Overlaps at one posture.

    Attributes:
        posture: ``planned`` or ``open``.
        object_overlap: Deepest overlap of a link or fingertip with the object [m]; links around point fingertips are
            left out, as in the plan.
        self_overlap: Deepest overlap of two links [m].
        limit: Largest overlap allowed [m].
        table_overlap: Deepest overlap of a link with the table [m]; 0 without one.
    """

    posture: str
    object_overlap: float
    self_overlap: float
    limit: float
    table_overlap: float = 0.0

    @property
    def passed(self) -> bool:
        """Whether none is deeper than allowed."""
        return all(depth <= self.limit for depth in (self.object_overlap, self.self_overlap, self.table_overlap))


def check_posture(
    grasp: Grasp, q: Array, posture: str, geometry: Geometry, limit: float, *, table: bool = False
) -> GateReport:
    """Measure the overlaps at a posture.

    Args:
        grasp: The grasp, for problem and palm pose.
        q: The posture [rad], of shape (n_q,).
        posture: Its name.
        geometry: ``links`` for all solids of the hand, ``contacts`` for the fingertips only.
        limit: Largest overlap allowed [m].
        table: Whether there is a table under the object.

    Returns:
        The overlaps.
    """
    problem = with_table(grasp.problem) if table else grasp.problem
    overlap, own, below = posture_overlaps(problem, q, grasp.palm_pose, links=geometry == "links")
    return GateReport(posture, overlap, own, limit, below if table else 0.0)
