"""Where a KKT point moves when its program changes, its active constraints kept: Newton's method. No robotics."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..spatial import Array
from .kkt import KktPoint, kkt_change
from .lagrangian import Evaluate, Indices, NlpPoint, lagrangian_gradient, lagrangian_hessian, secant_hessian

STEPS = 8
"""Most steps."""
GROWING = 3.0
"""Steps with an old Hessian go on as long as each is shorter than this times the one before."""
FIRST_STEP = 0.3
"""First step with an old Hessian, in scaled variables, that is taken even where the prediction moved by less."""
LARGEST_STEP = 1.0
"""Step, in scaled variables of order one, from which Newton's method counts as astray."""
SMALL_STEP, SMALL_NEWTON_STEP = 1e-9, 1e-6
"""Steps, in scaled variables, that end the sequence: with an old Hessian, and with a new one, where what is left is of
the order of the step's square."""
SMALL_SHARE = 1e-3
"""Share of the whole move below which a step ends the sequence too."""
LEFT = 1e-7
"""Violation of active constraints, and gradient of the Lagrangian relative to the objective's, that may be left …"""
LEFT_SHARE = 1e-3
"""… per unit of the whole move."""


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
    found: KktPoint,
    evaluate: Evaluate,
    z: Array,
    multipliers: Array,
    free: Indices | None = None,
    *,
    renewals: int = STEPS,
) -> MovedPoint | None:
    """Return the KKT point of a changed program near a prediction, the active constraints kept.

    The Hessian is that of the unchanged program, kept up to date by what the steps show of it: a step costs one
    evaluation. A new one, of as many evaluations as there are variables, is made where steps grow too much.

    Args:
        found: The KKT point of the unchanged program.
        evaluate: The changed program.
        z: The predicted point, of shape (n,).
        multipliers: The predicted λ of the active constraints of ``found``, of shape (a,).
        free: Indices of the variables that may move; all if left out.
        renewals: Most new Hessians.

    Returns:
        The point; None if the steps do not converge from the prediction.
    """
    active, chosen = found.active, np.arange(len(z)) if free is None else free
    # With an old Hessian a step may be somewhat longer than the one before. A step with a new one has to be shorter
    # than the last such step.
    move = float(np.abs(z - found.z).max())
    old_limit, new_limit = max(move, FIRST_STEP), LARGEST_STEP
    point, hessian, fresh = evaluate(z), found.hessian, False
    for _ in range(STEPS):
        here = replace(found, z=z, point=point, hessian=hessian)
        step = kkt_change(here, lagrangian_gradient(point, active, multipliers), point.residuals, free)
        size = float(np.abs(step.z).max())
        if not size < (new_limit if fresh else max(old_limit, SMALL_STEP)):
            if fresh or renewals == 0:
                return None
            everywhere = np.zeros(len(point.residuals))
            everywhere[active] = multipliers
            hessian, fresh, renewals = lagrangian_hessian(evaluate, z, everywhere, at=point), True, renewals - 1
            continue
        z, multipliers, before = z + step.z, multipliers + step.multipliers, point
        point = evaluate(z)
        turned = lagrangian_gradient(point, active, multipliers) - lagrangian_gradient(before, active, multipliers)
        hessian = secant_hessian(hessian, step.z, turned)
        move = max(move, size)
        small = size < max(SMALL_NEWTON_STEP if fresh else SMALL_STEP, SMALL_SHARE * move)
        if small and _left(point, active, multipliers, chosen) < LEFT + LEFT_SHARE * move:
            return MovedPoint(z, multipliers, point)
        new_limit = size if fresh else new_limit
        old_limit, fresh = GROWING * size, False
    return None


def _left(point: NlpPoint, active: Indices, multipliers: Array, chosen: Indices) -> float:
    """Return the largest violation of an active constraint, or slope of the Lagrangian relative to the objective's."""
    slope = np.abs(lagrangian_gradient(point, active, multipliers)[chosen]).max()
    return max(float(np.abs(point.residuals[active]).max(initial=0.0)), float(slope / np.abs(point.gradient).max()))
