"""Where a KKT point moves when its program changes, its active constraints kept: Newton's method. No robotics."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..spatial import Array
from .kkt import Evaluate, Indices, KktPoint, NlpPoint, kkt_change, lagrangian_gradient, lagrangian_hessian

STEPS = 20
"""Most steps."""
CONTRACTING = 0.3
"""Steps with an old Hessian go on as long as each is shorter than this times the one before."""
LARGEST_STEP = 1.0
"""Step, in scaled variables of order one, from which Newton's method counts as astray."""
SMALL_STEP, SMALL_NEWTON_STEP = 1e-9, 1e-6
"""Steps, in scaled variables, that end the sequence: with an old Hessian, and with a new one, where what is left is of
the order of the step's square."""
LEFT = 1e-7
"""Violation of active constraints, and gradient of the Lagrangian relative to the objective's, that may be left."""


@dataclass(frozen=True)
class MovedPoint:
    """A KKT point of a changed program with the active constraints of the unchanged one.

    Attributes:
        z: The point, of shape (n,).
        multipliers: λ of the active constraints, of shape (a,).
        point: The program there.
    """

    z: Array
    multipliers: Array
    point: NlpPoint


def moved_point(
    found: KktPoint, evaluate: Evaluate, z: Array, multipliers: Array, free: Indices | None = None
) -> MovedPoint | None:
    """Return the KKT point of a changed program near a prediction, the active constraints kept.

    Args:
        found: The KKT point of the unchanged program.
        evaluate: The changed program.
        z: The predicted point, of shape (n,).
        multipliers: The predicted λ of the active constraints of ``found``, of shape (a,).
        free: Indices of the variables that may move; all if left out.

    Returns:
        The point; None if Newton's method does not converge from the prediction.
    """
    active, chosen = found.active, np.arange(len(z)) if free is None else free
    # With an old Hessian a step has to be much shorter than the one before; the first, than the prediction. A step
    # with a new one has to be shorter than the last such step.
    old_limit, new_limit = CONTRACTING * float(np.abs(z - found.z).max()), LARGEST_STEP
    point, hessian, fresh = evaluate(z), found.hessian, False
    for _ in range(STEPS):
        here = replace(found, z=z, point=point, hessian=hessian)
        step = kkt_change(here, lagrangian_gradient(point, active, multipliers), point.residuals, free)
        size = float(np.abs(step.z).max())
        if not size < (new_limit if fresh else max(old_limit, SMALL_STEP)):
            if fresh:
                return None
            everywhere = np.zeros(len(point.residuals))
            everywhere[active] = multipliers
            hessian, fresh = lagrangian_hessian(evaluate, z, everywhere), True
            continue
        z, multipliers = z + step.z, multipliers + step.multipliers
        point = evaluate(z)
        if size < (SMALL_NEWTON_STEP if fresh else SMALL_STEP):
            break
        new_limit = size if fresh else new_limit
        old_limit, fresh = CONTRACTING * size, False
    slope = np.abs(lagrangian_gradient(point, active, multipliers)[chosen]).max()
    left = max(np.abs(point.residuals[active]).max(initial=0.0), slope / np.abs(point.gradient).max())
    return MovedPoint(z, multipliers, point) if left < LEFT else None
