"""The gate before any physics: how deep hand and object, or links of the hand, overlap. By coal, not by the simulator.

Buried fingers make contacts that do not exist; such a posture is refused, whatever it would do in simulation.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..closing.path import posture_overlaps
from ..grasp.grasp import Grasp
from ..spatial import Array
from .protocol import Geometry


@dataclass(frozen=True)
class GateReport:
    """Overlaps at one posture.

    Attributes:
        posture: ``planned`` or ``open``.
        object_overlap: Deepest overlap of a link or fingertip with the object [m]; links around point fingertips are
            left out, as in the plan.
        self_overlap: Deepest overlap of two links [m].
        limit: Largest overlap allowed [m].
    """

    posture: str
    object_overlap: float
    self_overlap: float
    limit: float

    @property
    def passed(self) -> bool:
        """Whether neither is deeper than allowed."""
        return self.object_overlap <= self.limit and self.self_overlap <= self.limit


def check_posture(grasp: Grasp, q: Array, posture: str, geometry: Geometry, limit: float) -> GateReport:
    """Measure the overlaps at a posture.

    Args:
        grasp: The grasp, for problem and palm pose.
        q: The posture [rad], of shape (n_q,).
        posture: Its name.
        geometry: ``links`` for all solids of the hand, ``contacts`` for the fingertips only.
        limit: Largest overlap allowed [m].

    Returns:
        The overlaps.
    """
    overlap, own = posture_overlaps(grasp.problem, q, grasp.palm_pose, links=geometry == "links")
    return GateReport(posture, overlap, own, limit)
