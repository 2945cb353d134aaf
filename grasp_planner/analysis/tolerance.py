"""Tolerance: how far the object may be off, in each coordinate of its pose, before a contact slips.

The palm and the references are held and the object is moved by a twist ν from the planned grasp and kept there, by
its support or by what it is pressed against. The springs of joints and contacts answer with f − K Gᵀ ν; the
tolerance is the motion at which that meets a friction cone or a limit of the hand. A contact slips before it is
lost. The same numbers hold for an error of the palm with the object fixed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..grasp.grasp import Grasp
from ..judge.load_check import displacement_matrix
from ..judge.margins import Holding, holding, passive_margins, worst_passive_margin

QUESTION = "first slip, object clamped"
"""The question that a tolerance answers: hand and references are held, the object is moved as if clamped in a vice, and
the first thing to give way counts. Whether a hand that closes on an object off its place still grasps it is another
one, which :mod:`grasp_planner.closing` answers."""
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
        question: What it answers, always :data:`QUESTION`.
    """

    coordinate: str
    down: float
    up: float
    gives_way_down: str
    gives_way_up: str
    question: str = QUESTION

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
    held = _held(grasp)
    ups, downs = passive_margins(held, np.eye(6)), passive_margins(held, -np.eye(6))
    return tuple(
        Tolerance(name, down.size, up.size, down.gives_way, up.gives_way)
        for name, down, up in zip(COORDINATES, downs, ups, strict=True)
    )


def least_tolerance(grasp: Grasp, unit: str) -> float:
    """Return the least shift (unit ``m``) or turn (``rad``) of the object, in any direction, at which something gives.

    Args:
        grasp: The grasp.
        unit: ``m`` or ``rad``.

    Returns:
        The tolerance in the worst of many directions, refined [m] or [rad].
    """
    held = _held(grasp)
    if unit == "rad":
        held = replace(held, response=np.roll(held.response, 3, axis=1))
    return worst_passive_margin(held).size


def _held(grasp: Grasp) -> Holding:
    """Return the grasp with its answer to displacements, K Gᵀ, in the place of that to wrenches."""
    problem = grasp.problem
    response = np.full((grasp.intensities.size, 6), np.nan)
    if problem.parameters.contact_stiffness > 0.0:
        response = displacement_matrix(problem, grasp.grasp_matrix, grasp.hand_jacobian)
    nothing = np.zeros((grasp.intensities.size, 0))
    return holding(problem, grasp.contacts, grasp.intensities, grasp.hand_jacobian, response, nothing)
