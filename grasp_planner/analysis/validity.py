"""Validity of a first-order prediction of an optimum: how far a parameter may change until the prediction is off.

To first order it holds until an inactive constraint becomes active or a multiplier changes sign. Before that the
optimum may have bent away from its tangent. So the optimum is followed to the end of the first-order range with
its active constraints, and the range is shortened until F really changes as predicted and the active set stays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from ..exceptions import GraspPlannerError
from ..optimisation.kkt import KktPoint
from ..optimisation.kkt_path import MovedPoint, moved_point
from ..optimisation.lagrangian import Indices
from ..spatial import Array
from .optimality_program import OptimalityProgram
from .problem_parameters import Parameter

ACCURACY = 0.05
"""Largest error of the predicted change of F, relative to it."""
NOTHING = 1e-6
"""Changes of F below this, relative to F, count as none."""
FARTHEST = 0.5
"""Largest change of a parameter that is examined, relative to its scale."""
TRIALS = 5
"""Most points that an end of the range is sought with."""
ENOUGH, GROWTH = 0.7, 3.0
"""Share of the way to where it ends at which a range is long enough, and how much farther is looked at a time."""
TINY = 1e-3
"""Ends below this, relative to the parameter's scale, are not sought more closely."""
WORTH_RENEWING = 1e-2
"""Steps above this, relative to the parameter's scale, may cost a new Hessian on the way."""
TIGHT = 1e-7
"""Residuals and multipliers below minus this count as a change of the active set."""
NO_END = "examined no further"
BENT = f"the change of F is off by {100 * ACCURACY:g} %"
LOST = "the optimum can't be followed"


@dataclass(frozen=True)
class Prediction:
    """The first-order prediction of an optimum for one parameter.

    Attributes:
        program: The program around the grasp.
        found: Its KKT point.
        names: Names of its constraints.
        parameter: The parameter.
        d_z: dz/dp, of shape (n,).
        d_multipliers: dλ/dp of the active constraints, of shape (a,).
        rates: Change of all constraints per unit, of shape (m,).
        d_force_norm: dF*/dp [N per unit].
        free: Indices of the variables that answer; None for all.
    """

    program: OptimalityProgram
    found: KktPoint
    names: list[str]
    parameter: Parameter
    d_z: Array
    d_multipliers: Array
    rates: Array
    d_force_norm: float
    free: Indices | None


def validity(prediction: Prediction) -> tuple[tuple[float, str], tuple[float, str]]:
    """Return how far the parameter may fall and how far it may rise, each ≥ 0 and with what ends it."""
    down, up = _first_order(prediction)
    return _shortened(prediction, -1.0, down), _shortened(prediction, 1.0, up)


def _first_order(prediction: Prediction) -> tuple[tuple[float, str], tuple[float, str]]:
    """Return how far the parameter may fall and rise to first order, and which change of the active set ends it."""
    point, active, names = prediction.found.point, prediction.found.active, prediction.names
    values = [*point.residuals, *prediction.found.multipliers]
    slopes = [*prediction.rates, *prediction.d_multipliers]
    labels = [f"{name} becomes active" for name in names] + [f"{names[k]} stops being active" for k in active]
    skipped = set(active.tolist()) | set(range(point.n_equalities))
    ends = [(math.inf, NO_END), (math.inf, NO_END)]
    for k, (value, slope, label) in enumerate(zip(values, slopes, labels, strict=True)):
        if k in skipped or (k >= len(names) and active[k - len(names)] < point.n_equalities):
            continue
        if abs(slope) < 1e-14:
            continue
        distance = max(float(value), 0.0) / abs(float(slope))
        side = 0 if slope > 0.0 else 1
        if distance < ends[side][0]:
            ends[side] = (distance, label)
    return ends[0], ends[1]


def _shortened(prediction: Prediction, sign: float, end: tuple[float, str]) -> tuple[float, str]:
    """Return the end of the range to one side, brought in until the prediction holds there.

    Where the optimum can't be followed in one go it is followed part of the way, and from there farther again.
    """
    reach, label = end
    farthest = FARTHEST * prediction.parameter.scale
    if reach > farthest:
        reach, label = farthest, NO_END
    beyond, known, lost, examined = (reach, label), None, False, False
    for _ in range(TRIALS):
        if reach <= 0.0:
            break
        renewed = lost and known is None and reach > WORTH_RENEWING * prediction.parameter.scale
        moved = _followed(prediction, sign * reach, known, renewals=int(renewed))
        if moved is None:
            beyond, lost, examined = (reach, LOST), True, known is not None
            reach = 0.2 * reach if known is None else math.sqrt(reach * known.reach)
            continue
        changed = _changed_set(prediction, moved.point)
        off = 0.0 if changed is not None else _error(prediction, sign * reach, moved.force_norm)
        if changed is None and off <= 1.0:
            known = _Followed(reach, sign, moved.point)
            if reach >= ENOUGH * beyond[0] or beyond[0] < TINY * prediction.parameter.scale:
                break
            farther = min(beyond[0], GROWTH * reach)
            # What has been looked at is not looked at again.
            reach = math.sqrt(reach * beyond[0]) if examined and farther == beyond[0] else farther
        elif known is not None:
            beyond, examined = (reach, changed or BENT), True
            reach = math.sqrt(reach * known.reach)
        else:
            # The error of a tangent grows with the square of the step.
            reach *= 0.8 if changed is not None else float(np.clip(0.9 / off, 0.02, 0.9))
            beyond, examined = (reach, changed or BENT), False
    return (0.0, beyond[1]) if known is None else (known.reach, beyond[1])


@dataclass(frozen=True)
class _Moved:
    """An optimum after a change of the parameter, and F there [N]."""

    point: MovedPoint
    force_norm: float


@dataclass(frozen=True)
class _Followed:
    """An optimum that was followed to some change of the parameter, to one side."""

    reach: float
    sign: float
    moved: MovedPoint

    def farther(self, step: float, start: Array, slope: Array, here: Array) -> Array:
        """Return start + slope·step bent such that it passes through what was found here."""
        own = self.sign * self.reach
        return start + step * slope + (step / own) ** 2 * (here - start - own * slope)


def _followed(prediction: Prediction, step: float, known: _Followed | None, renewals: int) -> _Moved | None:
    """Return the optimum after a change of the parameter; None if it can't be followed there."""
    program, found, parameter = prediction.program, prediction.found, prediction.parameter
    z = found.z + step * prediction.d_z
    multipliers = found.multipliers + step * prediction.d_multipliers
    if known is not None:
        z = known.farther(step, found.z, prediction.d_z, known.moved.z)
        multipliers = known.farther(step, found.multipliers, prediction.d_multipliers, known.moved.multipliers)
    if parameter.palm is not None:
        pose = program.layout.pose
        z[pose] = program.base.evaluator.chart.coordinates(carried_palm(prediction, step)) / program.base.scale[pose]
    try:
        there = program.at(parameter.apply(step))
        point = moved_point(found, there.evaluate, z, multipliers, prediction.free, renewals=renewals)
        return None if point is None else _Moved(point, there.state(point.z).force_norm)
    except (GraspPlannerError, ValueError, FloatingPointError, np.linalg.LinAlgError):
        return None  # no such problem, or no such grasp


def carried_palm(prediction: Prediction, step: float) -> pin.SE3:
    """Return the pose of a held palm in O after the object has moved."""
    assert prediction.parameter.palm is not None
    before = prediction.program.base.evaluator.palm_pose(prediction.found.z * prediction.program.base.scale)
    shift, turn = prediction.parameter.palm[:3], prediction.parameter.palm[3:]
    twist = np.concatenate([shift - np.cross(turn, before.translation), turn])
    return pin.exp6(step * twist) * before


def _changed_set(prediction: Prediction, moved: MovedPoint) -> str | None:
    """Return the largest change of the active set; None if it is the same."""
    found, names, first = prediction.found, prediction.names, prediction.found.point.n_equalities
    residuals = moved.point.residuals.copy()
    residuals[:first], residuals[found.active] = 0.0, 0.0
    multipliers = np.where(found.active < first, 0.0, moved.multipliers)
    over, under = int(np.argmin(residuals)), int(np.argmin(multipliers)) if len(multipliers) else 0
    if residuals[over] < -TIGHT:
        return f"{names[over]} becomes active"
    if len(multipliers) and multipliers[under] < -TIGHT:
        return f"{names[found.active[under]]} stops being active"
    return None


def _error(prediction: Prediction, step: float, after: float) -> float:
    """Return the error of the predicted change of F over the one that is allowed."""
    told = step * prediction.d_force_norm
    before = prediction.program.base.state(prediction.found.z).force_norm
    return abs(after - before - told) / max(ACCURACY * abs(told) + NOTHING * before, 1e-300)
