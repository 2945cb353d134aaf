"""Tolerance: how far the object may be off, in each coordinate of its pose, before a contact slips.

The palm and the references are held and the object is moved by a twist ν from the planned grasp and kept there, by
its support or by what it is pressed against. The springs of joints and contacts answer with f − K Gᵀ ν; the
tolerance is the motion at which that meets a friction cone or a limit of the hand. A contact slips before it is
lost. The same numbers hold for an error of the palm with the object fixed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .compliance import series_stiffness
from .grasp import Grasp
from .margins import holding, passive_margins

COORDINATES = ("x", "y", "z", "rx", "ry", "rz")
"""Coordinates of the object's pose in O: translations [m], rotations about its centre [rad]."""


@dataclass(frozen=True)
class Tolerance:
    """How far one coordinate of the object's pose may be off.

    Attributes:
        coordinate: One of :data:`COORDINATES`.
        down: Largest motion in the negative direction, ≥ 0 [m] or [rad].
        up: Largest motion in the positive direction.
        gives_way_down: What gives way there, such as ``friction at thumb``.
        gives_way_up: The same for the positive direction.
    """

    coordinate: str
    down: float
    up: float
    gives_way_down: str
    gives_way_up: str

    @property
    def unit(self) -> str:
        """Unit of the motions."""
        return "rad" if self.coordinate.startswith("r") else "m"


def pose_tolerances(grasp: Grasp) -> tuple[Tolerance, ...]:
    """Return the tolerance of every coordinate of the object's pose.

    Args:
        grasp: The grasp.

    Returns:
        Six tolerances; not a number without contact stiffness, zero where a contact slips already.
    """
    problem = grasp.problem
    stiffness = problem.parameters.contact_stiffness
    response = np.full((grasp.forces.size, 6), np.nan)
    if stiffness > 0.0:
        series = series_stiffness(grasp.hand_jacobian, problem.joint_compliance, stiffness)
        response = series @ grasp.grasp_matrix.T
    nothing = np.zeros((grasp.forces.size, 0))
    held = holding(problem, grasp.contacts, grasp.forces, grasp.hand_jacobian, response, nothing)
    ups, downs = passive_margins(held, np.eye(6)), passive_margins(held, -np.eye(6))
    return tuple(
        Tolerance(name, down.size, up.size, down.gives_way, up.gives_way)
        for name, down, up in zip(COORDINATES, downs, ups, strict=True)
    )
